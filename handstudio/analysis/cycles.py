"""Repetitions: how often a joint moved to and fro, how far, how fast, how evenly."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int64

from handstudio.analysis.measure import Measure, missing
from handstudio.analysis.series import AngleSeries
from handstudio.analysis.unbroken import unbroken
from handstudio.arrays import Array

LEAST_RAD = float(np.deg2rad(10.0))
"""Smaller swings are no repetition."""

SHARE = 0.3
"""Nor are those below this share of the whole range, 1st to 99th percentile."""

LEAST_CYCLES = 3
"""Of fewer nothing can be said of how even they are."""


@dataclass(frozen=True, slots=True, eq=False)
class Cycles:
    """Repetitions of one angle: from trough over peak to trough.

    Attributes:
        ways: Each way to or fro, its first and its last instant, without the rest at its ends.
        amplitude: Of each cycle [rad]: mean of the way up and the way down.
        period_s: From one cycle to the next, where both are half way up.
    """

    ways: Int64[Array, "h 2"]
    amplitude: Float[Array, " c"]
    period_s: Float[Array, " p"]

    def __len__(self) -> int:
        return len(self.amplitude)


def cycles_of(time_s: Float[Array, " n"], values: Float[Array, " n"]) -> Cycles:
    """Find repetitions; swings count from `LEAST_RAD` and `SHARE` on."""
    ways: list[tuple[int, int]] = []
    amplitudes: list[Array] = []
    periods: list[Array] = []
    known = values[np.isfinite(values)]
    if len(known) > 2:
        low, high = np.percentile(known, [1.0, 99.0])
        least = max(LEAST_RAD, SHARE * float(high - low))
        for part in unbroken(time_s, values):
            here, when = values[part], time_s[part]
            turns = turning_points(here, least)
            ways += [_way(here, a, b, part.start) for a, b in pairwise(turns.tolist())]
            rising = int(len(turns) > 1 and here[turns[0]] > here[turns[1]])  # begin in a trough
            troughs, peaks = turns[rising::2], turns[rising + 1 :: 2]
            count = max(len(troughs) - 1, 0)
            around = 0.5 * (here[troughs[:count]] + here[troughs[1:]])
            amplitudes.append(here[peaks[:count]] - around)
            pairs = zip(troughs[:count].tolist(), peaks[:count].tolist(), strict=True)
            periods.append(np.diff([_half_way(here, when, a, b) for a, b in pairs]))
    return Cycles(
        np.array(ways, dtype=np.int64).reshape(-1, 2),
        np.concatenate([np.empty(0), *amplitudes]),
        np.concatenate([np.empty(0), *periods]),
    )


def turning_points(values: Float[Array, " n"], least: float) -> Int64[Array, " t"]:
    """Troughs and peaks in turn, each at least ``least`` from the one before; ends count too."""
    from scipy.signal import find_peaks  # noqa: PLC0415 - takes a second to load

    padded = np.concatenate([[values[0]], values, [values[-1]]])
    found: list[tuple[int, float]] = []
    for sign in (1.0, -1.0):
        edged = sign * padded
        edged[[0, -1]] = -np.inf  # so that an end may be a turning point
        peaks, _ = find_peaks(edged, prominence=0.5 * least)
        found += [(int(peak) - 1, sign) for peak in peaks]
    kept: list[tuple[int, float]] = []
    for at, sign in sorted(found):
        if kept and kept[-1][1] == sign:
            if sign * values[at] > sign * values[kept[-1][0]]:
                kept[-1] = at, sign
        elif kept and abs(values[at] - values[kept[-1][0]]) < least:
            continue
        else:
            kept.append((at, sign))
    if len(kept) < 2:
        return np.empty(0, dtype=np.int64)
    return np.array([at for at, _sign in kept], dtype=np.int64)


def cycle_measures(series: AngleSeries, name: str, cycles: Cycles) -> list[Measure]:
    """Count, amplitude, period and their variation (SD over mean, %) of one angle."""
    count = len(cycles)
    if count < LEAST_CYCLES:
        return [missing("cycles", name, "", "no_movement")]
    amplitude, period = np.rad2deg(cycles.amplitude), cycles.period_s
    scale = float(series.share_sd[series.names.index(name)] * amplitude.mean())
    amplitude_cv = _cv(amplitude)
    out = [
        Measure("cycles", name, float(count), ""),
        Measure(
            "cycle_amplitude",
            name,
            float(amplitude.mean()),
            "deg",
            sd=float(np.hypot(amplitude.std(ddof=1) / np.sqrt(count), scale)),
        ),
        Measure("cycle_amplitude_cv", name, amplitude_cv, "%", sd=amplitude_cv * _share(count)),
    ]
    intervals = len(period)
    if intervals < LEAST_CYCLES - 1:
        return [*out, missing("cycle_period", name, "s", "gaps")]
    period_cv = _cv(period)
    spread = float(period.std(ddof=1) / np.sqrt(intervals))
    return [
        *out,
        Measure("cycle_period", name, float(period.mean()), "s", sd=spread),
        Measure("cycle_period_cv", name, period_cv, "%", sd=period_cv * _share(intervals)),
    ]


_REST = 0.05  # a way begins and ends where this share of it is left


def _way(values: Array, a: int, b: int, start: int) -> tuple[int, int]:
    """A way from one turning point to the next without the rest before and after it."""
    done = (values[a : b + 1] - values[a]) / (values[b] - values[a])
    first = int(np.flatnonzero(done < _REST)[-1])
    last = int(np.flatnonzero(done > 1.0 - _REST)[0])
    return start + a + min(first, last), start + a + max(first, last)


def _half_way(values: Array, time_s: Array, a: int, b: int) -> float:
    """When a rising way is half done [s], between instants."""
    middle = 0.5 * (values[a] + values[b])
    after = a + 1 + int(np.argmax(values[a + 1 : b + 1] >= middle))
    low, high = values[after - 1], values[after]
    share = 1.0 if high == low else (middle - low) / (high - low)
    return float(time_s[after - 1] + share * (time_s[after] - time_s[after - 1]))


def _cv(values: Array) -> float:
    return 100.0 * float(values.std(ddof=1) / values.mean())


def _share(count: int) -> float:
    """Standard error of a standard deviation, as a share of it."""
    return float(1.0 / np.sqrt(2.0 * (count - 1)))
