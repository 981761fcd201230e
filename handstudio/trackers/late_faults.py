"""What becomes of a pose that a tracker tells, and the tests that decide it."""

from __future__ import annotations

from enum import IntEnum
from itertools import groupby

import numpy as np
from jaxtyping import Float, UInt8

from handstudio.arrays import Array

GATE = 30.0
"""Square of an innovation in standard deviations, of three numbers, beyond which it is not taken:
one good pose in a million."""

PATIENCE_S = 1.0
"""A tracker that stays elsewhere for so long, agreeing with itself, is believed again."""


class Fate(IntEnum):
    """What was done with a pose."""

    TAKEN = 0
    LOST = 1  # nothing was seen
    FROZEN = 2  # to the last bit the one before, told again
    JUMPED = 3  # too far from where the rest says that it is
    MIRRORED = 4  # on the other side of the transmitter: taken after mirroring
    AFRESH = 5  # it stayed where it jumped to: begun anew from it
    TURNED = 6  # its place fits and was taken, its attitude does not


def squared(innovation: Float[Array, " m"], covariance: Float[Array, "m m"]) -> float:
    """Square of an innovation in its own standard deviations."""
    return float(innovation @ np.linalg.solve(covariance, innovation))


def told_faults(fates: UInt8[Array, " n"], time_us: Array) -> list[tuple[Fate, float, float, int]]:
    """Stretches of poses that were not simply taken: what, from, to [s since the first], how many.

    Poses of the same fate with fewer than ten others between them are one stretch.
    """
    found: list[tuple[Fate, float, float, int]] = []
    seconds = (time_us - time_us[0]) * 1e-6 if len(time_us) else time_us
    for fate in Fate:
        at = np.flatnonzero(fates == fate)
        if fate is Fate.TAKEN or not len(at):
            continue
        part = np.concatenate([[0], np.cumsum(np.diff(at) > 10)])
        for _, group in groupby(range(len(at)), key=lambda k: int(part[k])):
            which = [int(at[k]) for k in group]
            begin, end = float(seconds[which[0]]), float(seconds[which[-1]])
            found.append((fate, begin, end, len(which)))
    return sorted(found, key=lambda one: one[1])
