"""When sensors were really read, against what their stamp says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.simulation.imperfections.noise import generator, normals
from handstudio.simulation.imperfections.strengths import Imperfections

AGE_S = 0.001  # the chips' own sampling period
DRIFT_SD = 20e-6
JITTER_SD_S = 10e-6


@dataclass(frozen=True, slots=True, eq=False)
class Timing:
    """How a device's stamps stand to true time.

    Attributes:
        drift: The device's clock is fast by this share.
        jitter_s: A stamp's scatter about the reading, standard deviation.
        age_s: How old every sensor's reading is when it is read.
    """

    seed: int
    drift: float
    jitter_s: float
    age_s: Float[Array, " s"]


def timing_of(what: Imperfections, sensors: int, seed: int) -> Timing:
    """Timing of one glove; a seed is one."""
    rng = generator(seed, _TIMING)
    drift = what.clock_drift * DRIFT_SD * float(rng.standard_normal())
    age_s = what.skew * AGE_S * rng.uniform(size=sensors)
    return Timing(seed, drift, what.jitter * JITTER_SD_S, age_s)


def true_time_s(
    timing: Timing, first: int, time_us: Int64[Array, " n"], rate_hz: int
) -> Float[Array, " n"]:
    """True instants [s] of stamps [µs], the first of which is number ``first`` of the stream."""
    time_s = time_us * 1e-6 / (1.0 + timing.drift)
    if timing.jitter_s:
        off_s = timing.jitter_s * normals(timing.seed, _JITTER, first, len(time_us), ())
        time_s += np.clip(off_s, -0.2 / rate_hz, 0.2 / rate_hz)  # never out of order
    return time_s


def step_back_s(timing: Timing, rate_hz: int) -> float:
    """How much before every stamp to look too, so that ages can be had by interpolation; 0: not."""
    return min(float(timing.age_s.max()), 0.5 / rate_hz)


_TIMING, _JITTER = 60, 61  # which of a seed's streams
