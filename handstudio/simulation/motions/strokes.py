"""How a pen runs: strokes of a text on paper, and when it is where.

Between corners a pen speeds up and slows down as hands do: along the path minimum jerk (Flash and
Hogan, J. Neurosci. 5 (1985) 1688), slower where it is bent, by the power of one third (F.
Lacquaniti, C. Terzuolo and P. Viviani, Acta Psychol. 54 (1983) 115), and twice as far in less than
twice the time (P. Viviani and C. Terzuolo, Neuroscience 7 (1982) 431). The figures are ours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.simulation.motions.actor import Stroke

_GAP = 0.1  # between characters, in their height
_LATIN_GAP = 0.2
_SPACE = 0.5

_EVERY_M = 0.0003
_ROUNDED_M = 0.0004  # what a hand rounds off, sd
_CORNER_RAD, _CORNER_M = np.deg2rad(45.0), 0.0010  # a turn of this much within twice this is one
_STRAIGHT_M = 0.020  # a bend of a larger radius slows nobody
_TAKES_S, _LENGTH_M, _ISOCHRONY = 0.27, 0.015, 0.5
_LEAST_S = 0.09
_LIFTING_S = 0.12  # longer for lifting the pen and setting it down


@dataclass(frozen=True, slots=True)
class Character:
    """A character on the line.

    Attributes:
        name: The character.
        left: Where it begins, in heights from the beginning of the text.
        right: Where it ends.
        strokes: Right from the beginning of the text and up, in heights.
    """

    name: str
    left: float
    right: float
    strokes: Sequence[Stroke]

    @property
    def middle(self) -> float:
        """Along the line, in heights."""
        return 0.5 * (self.left + self.right)


def laid_out(text: str, strokes: Callable[[str], Sequence[Stroke]]) -> list[Character]:
    """A text in one line; Latin letters take the room they need, everything else a square.

    Raises:
        SetupError: nothing is to be written, or nobody knows how.
    """
    at, out = 0.0, list[Character]()
    for name in text:
        if name.isspace():
            at += _SPACE if name.isascii() else 1.0 + _GAP
            continue
        drawn, left, width = strokes(name), 0.0, 1.0
        if name.isascii():
            x = np.concatenate(drawn)[:, 0]
            left, width = float(x.min()), float(np.ptp(x))
        placed = [stroke + np.array([at - left, 0.0]) for stroke in drawn]
        out.append(Character(name, at, at + width, placed))
        at += width + (_LATIN_GAP if name.isascii() else _GAP)
    if not out:
        raise SetupError("There is nothing to write.", "Say what: writing:同志社大, for example.")
    return out


@dataclass(frozen=True, slots=True)
class Run:
    """A pen on its way for a while.

    Attributes:
        seconds: It takes.
        at: Place on the paper [m] at instants of it [s].
    """

    seconds: float
    at: Callable[[Array], Array]


def drawn(stroke: Float[Array, "m 2"], hurry: float) -> list[Run]:
    """A stroke [m] as its pieces between corners, each from rest to rest.

    Args:
        stroke: Points along it.
        hurry: How many times as fast as usual.
    """
    points = _even(stroke)
    return [_piece(points[a : b + 1], hurry) for a, b in _between_corners(points)]


def over(
    start: Float[Array, "2"], end: Float[Array, "2"], hurry: float, least_s: float = 0.0
) -> Run:
    """From one stroke's end to the next one's start, in this time or more."""
    way = float(np.linalg.norm(end - start))
    seconds = _whole(max(least_s, _LIFTING_S + _duration(way)) / hurry)
    return Run(
        seconds, lambda time_s: start + minimum_jerk(time_s / seconds)[:, None] * (end - start)
    )


def minimum_jerk(u: Float[Array, " n"]) -> Float[Array, " n"]:
    """From 0 to 1 while u does, at rest at both."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _duration(length_m: float) -> float:
    return max(_LEAST_S, float(_TAKES_S * (length_m / _LENGTH_M) ** _ISOCHRONY))


def _whole(seconds: float) -> float:
    return round(seconds, 3)


def _even(stroke: Array) -> Array:
    """The same path in even steps."""
    steps = np.linalg.norm(np.diff(stroke, axis=0), axis=-1)
    stroke = stroke[np.concatenate([[True], steps > 0.0])]
    along = np.concatenate([[0.0], np.cumsum(steps[steps > 0.0])])
    even = np.linspace(0.0, along[-1], max(8, round(along[-1] / _EVERY_M)) + 1)
    return np.stack([np.interp(even, along, stroke[:, i]) for i in (0, 1)], axis=-1)


def _between_corners(points: Array) -> list[tuple[int, int]]:
    """First and last point of every piece."""
    step = float(np.linalg.norm(np.diff(points, axis=0), axis=-1).mean())
    reach = max(1, round(_CORNER_M / step))
    if len(points) <= 2 * reach + 1:
        return [(0, len(points) - 1)]
    before, after = (
        points[reach:-reach] - points[: -2 * reach],
        points[2 * reach :] - points[reach:-reach],
    )
    across = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turn = np.abs(np.arctan2(across, np.sum(before * after, axis=-1)))
    corners = [
        i + reach
        for i in range(len(turn))
        if turn[i] > _CORNER_RAD
        and turn[i] == turn[max(0, i - 2 * reach) : i + 2 * reach + 1].max()
    ]
    # of a corner with two equal sides only the first point is one
    corners = [c for i, c in enumerate(corners) if i == 0 or c - corners[i - 1] > 2 * reach]
    ends = [0, *corners, len(points) - 1]
    return list(pairwise(ends))


def _piece(points: Array, hurry: float) -> Run:
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - takes a second to load
    from scipy.ndimage import gaussian_filter1d  # noqa: PLC0415

    smooth = _smoothed(points)
    steps = np.linalg.norm(np.diff(smooth, axis=0), axis=-1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    place = make_interp_spline(along, smooth, k=min(5, len(points) - 1))
    seconds = _whole(_duration(float(along[-1])) / hurry)
    # "as if it were longer where it is bent": minimum jerk runs along this length
    bent = (
        np.linalg.norm(np.atleast_2d(place(along, 2)), axis=-1) if len(points) > 3 else 0.0 * along
    )
    slower = gaussian_filter1d((1.0 + bent * _STRAIGHT_M) ** (1.0 / 3.0), 3.0, mode="nearest")
    felt = np.concatenate([[0.0], np.cumsum(0.5 * (slower[1:] + slower[:-1]) * steps)])
    real = make_interp_spline(felt, along, k=3)
    return Run(
        seconds,
        lambda time_s: np.asarray(place(real(felt[-1] * minimum_jerk(time_s / seconds)))),
    )


def _smoothed(points: Array) -> Array:
    """Without what a hand cannot follow; the ends stay."""
    from scipy.ndimage import gaussian_filter1d  # noqa: PLC0415 - takes a second to load

    sigma = _ROUNDED_M / max(1e-9, float(np.linalg.norm(points[1] - points[0])))
    pad = min(len(points) - 1, int(4.0 * sigma) + 1)
    before = 2.0 * points[0] - points[pad:0:-1]
    after = 2.0 * points[-1] - points[-2 : -2 - pad : -1]
    whole = np.concatenate([before, points, after])
    return np.asarray(gaussian_filter1d(whole, sigma, axis=0)[pad : pad + len(points)])
