"""How much of every error there is: a number each, 0 is none of it and 1 its default size.

As text: ``typical,-soft_tissue,scale=2``. A preset may come first; then, in order, ``name`` for an
error at its default size, ``name=2`` for twice that, ``-name`` for none; the name of a group stands
for its members. `table` says what the names mean.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import msgspec

from handstudio.errors import SetupError

STRONGEST = 10.0
"""Beyond ten times its default size no error is of this kind of sensor."""


class Imperfections(msgspec.Struct, frozen=True):
    """The strength of every error, 0 to `STRONGEST`; what they are says `table.TABLE`.

    Raises:
        SetupError: a strength is none.
    """

    white_noise: float = 0.0
    bias: float = 0.0
    turn_on_bias: float = 0.0
    random_walk: float = 0.0
    scale: float = 0.0
    misalignment: float = 0.0
    g_sensitivity: float = 0.0
    temperature: float = 0.0
    saturation: float = 0.0
    quantisation: float = 0.0
    mag_noise: float = 0.0
    hard_iron: float = 0.0
    soft_iron: float = 0.0
    mag_hold: float = 0.0
    compass_scatter: float = 0.0
    skew: float = 0.0
    clock_drift: float = 0.0
    jitter: float = 0.0
    lost_packets: float = 0.0
    damaged_packets: float = 0.0
    dying_sensor: float = 0.0
    slide: float = 0.0
    rock: float = 0.0
    wobble: float = 0.0
    board_slip: float = 0.0
    mounting: float = 0.0
    magnetic_gradient: float = 0.0
    desk_edge: float = 0.0
    magnet: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            strength = getattr(self, name)
            if not (math.isfinite(strength) and 0.0 <= strength <= STRONGEST):
                raise SetupError(
                    "{name} cannot have the strength {strength}.",
                    "Choose 0 (none of it) to {strongest}; 1 is its default size.",
                    name=name,
                    strength=strength,
                    strongest=int(STRONGEST),
                )


NAMES = Imperfections.__struct_fields__

GROUPS: Mapping[str, tuple[str, ...]] = {
    "noise": ("white_noise", "random_walk", "mag_noise"),
    "calibration": ("bias", "turn_on_bias", "scale", "misalignment", "g_sensitivity"),
    "magnetic": (
        "hard_iron",
        "soft_iron",
        "compass_scatter",
        "magnetic_gradient",
        "desk_edge",
        "magnet",
    ),
    "timing": ("skew", "clock_drift", "jitter"),
    "packets": ("lost_packets", "damaged_packets"),
    "soft_tissue": ("slide", "rock", "wobble"),
}
"""Names for several at once."""

IDEAL = Imperfections()
"""Perfect sensors where the maker meant them, in an undisturbed room."""

TYPICAL = Imperfections(
    **dict.fromkeys(NAMES, 1.0)
    | {
        "temperature": 0.3,  # the glove was on for some minutes before
        "lost_packets": 0.1,
        "damaged_packets": 0.1,
        "board_slip": 0.5,
        "desk_edge": 0.5,
        "dying_sensor": 0.0,
        "magnet": 0.0,
    }
)
"""A study done with care: a sound glove, warmed up, away from magnets."""

HARSH = Imperfections(
    **dict.fromkeys(NAMES, 2.5)
    | {
        # what a chip is, not how good it is
        "saturation": 1.0,
        "quantisation": 1.0,
        "mag_hold": 1.0,
        "dying_sensor": 1.0,
        "magnet": 1.0,
    }
)
"""A bad day: everything two to three times as bad, a dying sensor, a magnet on the desk."""

PRESETS: Mapping[str, Imperfections] = {"ideal": IDEAL, "typical": TYPICAL, "harsh": HARSH}


def told(imperfections: Imperfections) -> dict[str, float]:
    """Strengths by name."""
    return {name: getattr(imperfections, name) for name in NAMES}


def parse(text: str) -> Imperfections:
    """Understand a description; without a preset it begins with `IDEAL`.

    Raises:
        SetupError: it is not one.
    """
    first, *rest = (part.strip() for part in text.split(","))
    strengths = told(PRESETS.get(first, IDEAL))
    for part in rest if first in PRESETS else [first, *rest]:
        strengths |= _asked(part)
    return Imperfections(**strengths)


def tell(imperfections: Imperfections) -> str:
    """The shortest description that `parse` understands as these strengths."""
    descriptions = [
        ",".join([preset, *_changes(told(base), told(imperfections))])
        for preset, base in PRESETS.items()
    ]
    return min(descriptions, key=len)


_PART = re.compile(r"(?P<off>-)?\s*(?P<name>[a-z_]+)\s*(?:=\s*(?P<strength>[^=]+))?")


def _asked(part: str) -> dict[str, float]:
    match = _PART.fullmatch(part)
    if match is None or (match["off"] and match["strength"]):
        raise SetupError(
            "{part!r} is no description of an imperfection.",
            "Write names with commas between them: scale (at its default size), scale=2 (twice), "
            "-scale (none).",
            part=part,
        )
    name = match["name"]
    if name in PRESETS:
        raise SetupError("{name} stands behind other names.", "Put it first.", name=name)
    if name not in NAMES and name not in GROUPS:
        raise SetupError(
            "There is no imperfection {name!r}.",
            "Choose from: {known}.",
            name=name,
            known=", ".join([*PRESETS, *GROUPS, *NAMES]),
        )
    strength = 0.0 if match["off"] else _number(name, match["strength"] or "1")
    return dict.fromkeys(GROUPS.get(name, (name,)), strength)


def _number(name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise SetupError(
            "The strength of {name} is no number: {text!r}.",
            "Choose 0 (none of it) to {strongest}; 1 is its default size.",
            name=name,
            text=text.strip(),
            strongest=int(STRONGEST),
        ) from None


def _changes(base: Mapping[str, float], asked: Mapping[str, float]) -> list[str]:
    """What has to be said after a preset; a group where all its members change alike."""
    changes = {name: value for name, value in asked.items() if value != base[name]}
    said = []
    for group, members in GROUPS.items():
        values = {changes.get(name) for name in members}
        if len(values) == 1 and None not in values:
            said.append(_change(group, changes[members[0]]))
            for name in members:
                del changes[name]
    return said + [_change(name, value) for name, value in changes.items()]


def _change(name: str, strength: float) -> str:
    if strength == 0.0:
        return f"-{name}"
    if strength == 1.0:
        return name
    short = f"{strength:g}"
    return f"{name}={short if float(short) == strength else repr(strength)}"
