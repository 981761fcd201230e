"""How well readings of a tumble agree with gravity, before and after their errors are taken off."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.still import poses_of, still_intervals, turns_of
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY, ImuSamples


class Agreement(msgspec.Struct, frozen=True):
    """What does not agree with gravity: its length [m/s²], and where turns carry it [deg], RMS.

    NaN where a sensor was never seen at rest.
    """

    acc: float
    gyr: float


def agreement_of(samples: ImuSamples) -> list[Agreement]:
    """Of every sensor of a tumble, the gyroscope's bias at the rests taken off."""
    stills = still_intervals(samples)
    poses, turns = poses_of(samples, stills), turns_of(samples, stills)
    out_of: list[Agreement] = []
    steps_s = np.diff(turns.time_s, axis=1)[..., None]
    for sensor, up in enumerate(poses.acc):
        usable = poses.usable[sensor]
        bias = poses.gyr[sensor][usable].mean(axis=0) if usable.any() else np.zeros(3)
        rate = turns.gyr[sensor] - bias
        q = np.tile(so3.IDENTITY, (len(rate), 1))
        for step in np.moveaxis(0.5 * (rate[:, 1:] + rate[:, :-1]) * steps_s, 1, 0):
            q = so3.multiply(q, so3.exp(step))
        carried = so3.rotate(so3.conjugate(q), up[:-1])
        angle = np.rad2deg(_angle(carried, up[1:]))
        both = usable[:-1] & usable[1:] & turns.usable[sensor]
        length = np.linalg.norm(up, axis=-1) - STANDARD_GRAVITY
        out_of.append(Agreement(_rms(length[usable]), _rms(angle[both])))
    return out_of


def _angle(a: Array, b: Array) -> Array:
    across = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.asarray(np.arctan2(across, np.sum(a * b, axis=-1)))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan
