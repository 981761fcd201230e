"""How characters are written: strokes in their order, from KanjiVG (an extra, ``writing``).

Kanji, kana, Latin letters and digits, as drawn by Ulrich Apel and others, licence CC BY-SA 3.0.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from importlib.util import find_spec
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.simulation.motions.actor import Stroke

_BOX = 109.0  # side of KanjiVG's square, y down
_EVERY = 0.01  # of a character's height
_PATH = "{http://www.w3.org/2000/svg}path"


def kanji_strokes(character: str) -> Sequence[Stroke]:
    """Strokes of one character, evenly sampled, its square from (0, 0) to (1, 1).

    Raises:
        SetupError: the extra is not installed, or it lacks this character.
    """
    if find_spec("kanji") is None or find_spec("svg") is None:
        raise SetupError(
            "Writing needs the stroke order of characters, which is not installed.",
            "Install it: pip install 'handstudio[writing]'.",
        )
    file = resources.files("kanji").joinpath(f"{ord(character):05x}.svg")
    if not file.is_file():
        raise SetupError(
            "How to write {character!r} is not known.",
            "Use kanji, kana, Latin letters and digits.",
            character=character,
        )
    root = ElementTree.fromstring(file.read_bytes())
    return [_sampled(path.attrib["d"]) for path in root.iter(_PATH)]


def _sampled(description: str) -> Float[Array, "m 2"]:
    """A path of the drawing, even steps along it."""
    from svg.path import Move, parse_path  # noqa: PLC0415 # in the extra

    share = np.linspace(0.0, 1.0, 65)
    pieces = [piece for piece in parse_path(description) if not isinstance(piece, Move)]
    points = np.array([piece.point(u) for piece in pieces for u in share])
    places = np.stack([points.real, _BOX - points.imag], axis=-1) / _BOX
    steps = np.linalg.norm(np.diff(places, axis=0), axis=-1)
    places = places[np.concatenate([[True], steps > 0.0])]
    along = np.concatenate([[0.0], np.cumsum(steps[steps > 0.0])])
    even = np.linspace(0.0, along[-1], max(2, round(along[-1] / _EVERY) + 1))
    return np.stack([np.interp(even, along, places[:, i]) for i in (0, 1)], axis=-1)
