"""A sensor that loses contact: ever oftener, in the end for good."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.simulation.imperfections.noise import generator

DIES_AFTER_S = 60.0
_FIRST_AFTER = 0.25  # of that time
_OUTAGES = 12
_OUTAGE_S = (0.02, 0.6)


def outages(strength: float, sensors: int, seed: int) -> tuple[int, Float[Array, "o 2"]]:
    """Which sensor, and from when to when it is silent [s]; the last time for ever.

    Twice the strength dies in half the time.
    """
    rng = generator(seed, _DYING)
    sensor = int(rng.integers(sensors))
    if not strength:
        return sensor, np.zeros((0, 2))
    # the square root crowds them towards the end
    starts = np.sqrt(np.sort(rng.uniform(_FIRST_AFTER**2, 1.0, _OUTAGES)))
    starts[-1] = 1.0
    starts *= DIES_AFTER_S / strength
    ends = starts + rng.uniform(*_OUTAGE_S, _OUTAGES)
    ends[-1] = np.inf
    return sensor, np.stack([starts, ends], axis=-1)


def answering(
    sensors: int, dying: tuple[int, Float[Array, "o 2"]], time_us: Int64[Array, " n"]
) -> Bool[Array, "n s"]:
    """Whether each sensor answers."""
    out = np.ones((len(time_us), sensors), dtype=bool)
    sensor, silent = dying
    time_s = time_us * 1e-6
    for start, end in silent:
        out[(time_s >= start) & (time_s < end), sensor] = False
    return out


_DYING = 70  # which of a seed's streams
