"""Curves that people's movements follow: swings to and fro, and states that are passed through."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.simulation.trajectory import Trajectory


def through_states(
    time_s: Float[Array, " m"],
    postures: Float[Array, "m c"],
    rates: Float[Array, "m c"],
    accelerations: Float[Array, "m c"],
) -> Trajectory:
    """Meet posture, rate and acceleration at every instant [s], the first 0.

    One quintic between two instants; between states of a quintic it is that quintic.
    """
    span = np.diff(time_s)[:, None]
    p0, v0, a0 = postures[:-1], rates[:-1], accelerations[:-1]
    # what is left to do where everything would go on as it is at the earlier instant
    p = postures[1:] - p0 - (v0 + 0.5 * a0 * span) * span
    v = (rates[1:] - v0 - a0 * span) * span
    a = (accelerations[1:] - a0) * span**2
    coefficients = np.stack(
        [
            (6.0 * p - 3.0 * v + 0.5 * a) / span**5,
            (-15.0 * p + 7.0 * v - a) / span**4,
            (10.0 * p - 4.0 * v + 0.5 * a) / span**3,
            0.5 * a0,
            v0,
            p0,
        ]
    )
    return Trajectory(time_s, coefficients)


def through_reversals(time_s: Float[Array, " m"], postures: Float[Array, "m c"]) -> Trajectory:
    """Reach every posture at its instant [s], and turn there as a pendulum does, without a pause.

    Where a channel turns back it does so at the acceleration of a sine; where it goes on the same
    way it passes at a pace between those of the two sides (the harmonic mean); where it has been
    still or stays, it rests. So nothing goes further than the postures.
    """
    way, span = np.diff(postures, axis=0), np.diff(time_s)[:, None]
    sine = 0.5 * way * (np.pi / span) ** 2  # acceleration at the begin; minus that at the end
    before, after = -sine[:-1], sine[1:]
    least = np.minimum(np.abs(before), np.abs(after))
    # a slow swing before a fast one would bulge if it had to turn as fast as that
    size = np.minimum(0.5 * np.abs(before + after), 1.5 * least)
    accelerations, rates = np.zeros_like(postures), np.zeros_like(postures)
    accelerations[1:-1] = np.where(before * after > 0.0, np.sign(after) * size, 0.0)
    came, goes = (way / span)[:-1], (way / span)[1:]
    both = np.where(came * goes > 0.0, came + goes, np.inf)  # infinite: no pace
    rates[1:-1] = 2.0 * came * goes / both
    return through_states(time_s, postures, rates, accelerations)


def instants(rng: np.random.Generator, mean_s: float, total_s: float) -> Float[Array, " m"]:
    """Instants of reversals from 0 to the total, no two steps alike: a tenth either way."""
    count = max(2, round(total_s / mean_s))
    steps = np.clip(rng.normal(1.0, 0.1, count), 0.75, 1.25)
    at = np.concatenate([[0.0], np.cumsum(steps)])
    whole: Array = np.round(at * total_s / at[-1], 6)
    return whole
