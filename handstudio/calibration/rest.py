"""Rest: finding the first half second in which a sensor does not move, and what it tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.samples import ImuSamples

REST_S = 0.5

# Peak to peak within the window. A still MPU-9250 stays below 1.3 deg/s and 0.5 m/s² at 1000 Hz;
# a hand lying on a table adds less than that again.
_GYR_SPREAD = np.deg2rad(3.0)
_ACC_SPREAD = 1.0
# A steady turn looks like a bias: the largest bias of real units is 3.2 deg/s an axis, and a turn
# that is not about the vertical shows as a tilt between the halves of the window.
_GYR_MEAN = np.deg2rad(5.0)
_TILT_BETWEEN_HALVES = np.deg2rad(0.4)


@dataclass(frozen=True, slots=True)
class Rest:
    """What a resting sensor tells of itself."""

    q_world_sensor: Float[Array, " 4"]
    gyr_bias: Float[Array, " 3"]  # [rad/s]
    compass: bool  # the heading is a compass's, else of no meaning


def first_rest(recent: ImuSamples, sensor: int, window: int, start: int) -> tuple[int, Rest] | None:
    """Find the first instant by which a sensor has rested for a whole window.

    Args:
        recent: Consecutive samples.
        sensor: Which sensor.
        window: Number of samples of the rest.
        start: The earliest instant the rest may end at.

    Returns:
        The index of the last sample of the rest and what it tells, or None. The answer for an
        instant depends on the window before it alone, so it is the same in any chunking.
    """
    start = max(start, window - 1)
    for first in range(start, len(recent), _AT_ONCE * window):  # it mostly comes soon
        part = recent[first - window + 1 : first + _AT_ONCE * window]
        for end in np.flatnonzero(_still(part, sensor, window)) + first:
            rest = _rest(recent[end - window + 1 : end + 1], sensor)
            if rest is not None:
                return int(end), rest
    return None


_AT_ONCE = 4  # windows' lengths


def _still(recent: ImuSamples, sensor: int, window: int) -> Bool[Array, " m"]:
    """Whether the window that begins at each sample spreads little and misses nothing.

    Maxima and minima do not round, so chunking cannot change them.
    """
    windows = np.lib.stride_tricks.sliding_window_view
    gyr = windows(recent.gyr[:, sensor], window, axis=0)
    acc = windows(recent.acc[:, sensor], window, axis=0)
    complete = windows(recent.valid[:, sensor], window, axis=0).all(axis=-1)
    calm: Bool[Array, " m"] = (
        complete
        & (np.ptp(gyr, axis=-1) <= _GYR_SPREAD).all(axis=-1)
        & (np.ptp(acc, axis=-1) <= _ACC_SPREAD).all(axis=-1)
    )
    return calm


def _rest(window: ImuSamples, sensor: int) -> Rest | None:
    gyr = np.ascontiguousarray(window.gyr[:, sensor])
    acc = np.ascontiguousarray(window.acc[:, sensor])
    bias = gyr.mean(axis=0)
    half = len(acc) // 2
    before, after = acc[:half].mean(axis=0), acc[half:].mean(axis=0)
    tilt = np.arctan2(np.linalg.norm(np.cross(before, after)), before @ after)
    if np.linalg.norm(bias) > _GYR_MEAN or tilt > _TILT_BETWEEN_HALVES:
        return None
    mag = np.ascontiguousarray(window.mag[:, sensor][window.fresh[:, sensor]])
    field = mag.mean(axis=0) if len(mag) else None
    return Rest(attitude(acc.mean(axis=0), field), bias, field is not None)
