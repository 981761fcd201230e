"""A recording of a course, as it came, on an even raster: for what is computed from all of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from handstudio.arrays import Array
from handstudio.calibration.device import DeviceCalibration, corrected
from handstudio.errors import CalibrationError
from handstudio.samples import ImuSamples

_BRIDGED_S = 0.25  # missing instants are interpolated over so long; more is a hole
_ANSWERED = 0.9  # share of instants below which a sensor is left out


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """Samples on an even raster.

    Attributes:
        samples: None missing; interpolated where some were.
        hole: Instants that nobody knows anything of.
        alive: Sensors that answered nearly always.
    """

    samples: ImuSamples
    hole: Bool[Array, " n"]
    alive: tuple[int, ...]

    def part(self, start_s: float, end_s: float, rate_hz: float) -> ImuSamples:
        """A stretch, in seconds from the first instant."""
        return self.samples[max(0, round(start_s * rate_hz)) : max(0, round(end_s * rate_hz))]


def even(
    runs: Sequence[ImuSamples],
    rate_hz: float,
    errors: DeviceCalibration | None = None,
    names: Sequence[str] = (),
) -> Recorded:
    """Lay runs of samples onto an even raster, freed of the sensors' errors where they are known.

    Args:
        runs: As they were read.
        rate_hz: Of the raster.
        errors: Of the sensors; None: not known.
        names: Of the sensors, in order; needed for their errors only.

    Raises:
        CalibrationError: there are none.
    """
    runs = [run for run in runs if len(run)]
    if not runs:
        raise CalibrationError("There are no samples in it.", "Record the calibration again.")
    columns = ImuSamples.__slots__
    whole = ImuSamples(*(np.concatenate([getattr(run, c) for run in runs]) for c in columns))
    time_s = (whole.time_us - whole.time_us[0]) * 1e-6
    keep = np.concatenate([[True], np.diff(time_s) > 0.0])
    whole, time_s = ImuSamples(*(getattr(whole, c)[keep] for c in columns)), time_s[keep]
    at = np.arange(round(time_s[-1] * rate_hz) + 1) / rate_hz
    after = np.clip(np.searchsorted(time_s, at), 1, len(time_s) - 1)
    nearest = np.where(at - time_s[after - 1] < time_s[after] - at, after - 1, after)
    hole = (time_s[after] - time_s[after - 1] > _BRIDGED_S) & (np.abs(time_s[nearest] - at) > 1e-3)
    answered = whole.valid.mean(axis=0)
    filled = _filled(whole, time_s)
    samples = ImuSamples(
        time_us=np.asarray(np.rint(at * 1e6), dtype=np.int64),
        gyr=_laid(filled.gyr, time_s, at, after),
        acc=_laid(filled.acc, time_s, at, after),
        mag=whole.mag[nearest],
        fresh=whole.fresh[nearest],
        valid=whole.valid[nearest],
        saturated=whole.saturated[nearest],
    )
    if errors is not None:
        samples = corrected(samples, errors, names)
    return Recorded(samples, hole, tuple(int(i) for i in np.flatnonzero(answered >= _ANSWERED)))


def _laid(x: Array, time_s: Array, at: Array, after: Array) -> Array:
    before = after - 1
    share = (at - time_s[before]) / (time_s[after] - time_s[before])
    share = np.clip(share, 0.0, 1.0)[:, None, None]
    laid: Array = x[before] * (1.0 - share) + x[after] * share
    return laid


def _filled(samples: ImuSamples, time_s: Array) -> ImuSamples:
    """What a silent sensor would have read, between what it did read."""
    if samples.valid.all():
        return samples
    gyr, acc = samples.gyr.copy(), samples.acc.copy()
    for sensor in np.flatnonzero(~samples.valid.all(axis=0)):
        there = samples.valid[:, sensor]
        if not there.any():
            continue
        for x in (gyr, acc):
            for axis in range(3):
                x[:, sensor, axis] = np.interp(time_s, time_s[there], x[there, sensor, axis])
    return replace(samples, gyr=gyr, acc=acc)
