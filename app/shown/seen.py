"""The curves of a take that are seen: of a window of its time, as many points as pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from app.shown.channels import SIGNALS, SPEEDS, picked, sds_of, signals_of, speeds_of, values_of
from app.shown.comparison import Comparison, nearest
from handstudio.arrays import Array
from handstudio.pipeline import Doubt, Motion
from handstudio.setup import Setup
from handstudio.signals import Signals

_APART_S = 0.25  # two motions farther apart in time than this are not compared
_PLOTTED = 1000  # instants in a plot: more than it has pixels


@dataclass(frozen=True, slots=True)
class Choice:
    """Which curves are wanted.

    Attributes:
        name: Of the set, see `app.shown.channels.sets_of`.
        sensor: Index of the one whose signals are wanted.
    """

    name: str = "overview"
    sensor: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Curves at some instants.

    Attributes:
        time_s: From the take's first instant.
        values: One column a curve.
        sds: Standard deviations, inf where nobody tells; None: of no such curves.
        second: The same curves of the motion that is compared with.
        rms: And by how much each differs where every sensor was placed in both; NaN nowhere.
    """

    time_s: Float[Array, " p"]
    values: Float[Array, "p c"]
    sds: Float[Array, "p c"] | None = None
    second: Float[Array, "p c"] | None = None
    rms: Float[Array, " c"] | None = None


def seen(
    setup: Setup,
    motion: Motion,
    time_s: Float[Array, " n"],
    window: tuple[float, float],
    choice: Choice,
    *,
    signals: Signals | None = None,
    comparison: Comparison | None = None,
) -> Seen:
    """The curves of a window; signals that are wanted and not there yet are flat."""
    first = min(int(np.searchsorted(time_s, window[0])), len(time_s) - 1)
    last = max(int(np.searchsorted(time_s, window[1], side="right")) - 1, first)
    at = np.linspace(first, last, _PLOTTED).round().astype(np.int64)
    at = at[np.diff(at, prepend=-1) > 0]  # np.unique loads what takes a tenth of a second
    shown_s = np.asarray(time_s[at])
    if choice.name == SIGNALS:
        if signals is None or len(signals.gyr) != len(motion):
            return Seen(shown_s, np.zeros((len(at), 9)))
        return Seen(shown_s, signals_of(signals, at, choice.sensor))
    values = _values(setup, motion, at, choice.name)
    sds = None if choice.name == SPEEDS else sds_of(setup, picked(motion, at), choice.name)
    if comparison is None:
        return Seen(shown_s, values, sds)
    wanted_s = shown_s - comparison.later_s
    there = nearest(comparison.time_s, wanted_s)
    second = _values(comparison.setup, comparison.motion, there, choice.name)
    if second.shape != values.shape:  # another kind of hand
        return Seen(shown_s, values, sds)
    off = second - values
    if choice.name != SPEEDS:
        off = (off + 180.0) % 360.0 - 180.0  # a turn more is no difference
    doubts = np.concatenate([motion.doubt[at], comparison.motion.doubt[there]], axis=1)
    off[np.abs(comparison.time_s[there] - wanted_s) > _APART_S] = np.nan  # beyond its ends
    return Seen(shown_s, values, sds, second, _rms(off, doubts))


def _values(setup: Setup, motion: Motion, at: Int64[Array, " p"], name: str) -> Array:
    if name == SPEEDS:
        return speeds_of(setup, motion, at)
    return values_of(setup, picked(motion, at), name)


def _rms(off: Array, doubts: Array) -> Array:
    placed = (doubts & np.uint8(Doubt.UNPLACED) == 0).all(axis=1)
    counted = placed[:, None] & np.isfinite(off)
    squares = np.where(counted, np.square(off), 0.0).sum(axis=0)
    count = counted.sum(axis=0)
    return np.where(count > 0, np.sqrt(squares / np.maximum(count, 1)), np.nan)
