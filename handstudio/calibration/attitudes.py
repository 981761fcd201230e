"""Attitudes over a recording with rests in it: gravity at every rest, gyroscopes between.

No compass: headings come from outside, and run on from there by the gyroscopes alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.maths import so3


def unbiased(gyr: Float[Array, "n s 3"], rests: Sequence[slice]) -> Float[Array, "n s 3"]:
    """Angular velocity less the bias of every rest, straight between the middles of rests.

    A sensor that moved in a rest, as a glove does that slips, tells no bias there: one that is
    far from what the sensor's rests are like otherwise gives way to them.
    """
    middles = [0.5 * (rest.start + rest.stop) for rest in rests]
    means = np.stack([gyr[rest].mean(axis=0) for rest in rests])
    usual = np.median(means, axis=0)
    moved = (np.abs(means - usual) > _WANDERING).any(axis=-1, keepdims=True)
    means = np.where(moved, usual, means)
    at = np.arange(len(gyr))
    upper = np.clip(np.searchsorted(middles, at), 1, max(1, len(rests) - 1))
    if len(rests) == 1:
        return np.asarray(gyr - means[0])
    low, high = np.array(middles)[upper - 1], np.array(middles)[upper]
    share = np.clip((at - low) / (high - low), 0.0, 1.0)[:, None, None]
    return np.asarray(gyr - (means[upper - 1] * (1.0 - share) + means[upper] * share))


def attitudes_between_rests(
    time_s: Float[Array, " n"],
    gyr: Float[Array, "n s 3"],
    acc: Float[Array, "n s 3"],
    rests: Sequence[slice],
    heading: Float[Array, " s"],
) -> Float[Array, "n s 4"]:
    """Attitude ``q_world_sensor`` at every instant.

    At a rest the tilt is gravity's; what the gyroscopes had drifted in tilt since the rest before
    is laid out evenly over the time between. The heading runs on.

    Args:
        time_s: Of the samples.
        gyr: Without bias, see `unbiased` [rad/s].
        acc: Specific force [m/s²].
        rests: At least one, in order.
        heading: At the first rest [rad].
    """
    half = 0.5 * (gyr[1:] + gyr[:-1]) * np.diff(time_s)[:, None, None]
    steps = so3.exp(half)
    up = np.stack([acc[rest].mean(axis=0) for rest in rests])
    middles = [(rest.start + rest.stop) // 2 for rest in rests]
    out = np.empty((*gyr.shape[:2], 4))
    here = so3.multiply(so3.about_z(heading), attitude(up[0]))
    out[: middles[0] + 1] = here
    for count, start in enumerate(middles):
        last = count + 1 == len(middles)
        end = len(gyr) - 1 if last else middles[count + 1]
        leg = _summed(here, steps[start:end])
        if not last:
            share = np.linspace(0.0, 1.0, len(leg))[:, None, None]
            leg = so3.multiply(so3.exp(share * _to_upright(leg[-1], up[count + 1])), leg)
        out[start : end + 1] = leg
        here = leg[-1]
    return out


_WANDERING = np.deg2rad(0.15)  # biases wander less in the minutes of a course


def _summed(start: Array, steps: Array) -> Array:
    """Attitudes from a start on, one more than there are steps.

    Products of neighbours are made in a tree, which takes a dozen calls instead of thousands.
    """
    turns = np.concatenate([start[None], steps])
    reach = 1
    while reach < len(turns):
        turns[reach:] = so3.multiply(turns[:-reach], turns[reach:])
        reach *= 2
    return so3.normalize(turns)


def _to_upright(q_world_sensor: Array, up: Array) -> Array:
    """The least rotation vector, in the world, that stands a sensor's up on end."""
    lifted = so3.rotate(q_world_sensor, up / np.linalg.norm(up, axis=-1, keepdims=True))
    x, y, z = np.moveaxis(lifted, -1, 0)
    level = np.hypot(x, y)
    angle = np.arctan2(level, z) / np.where(level > 0.0, level, 1.0)
    return np.stack([y * angle, -x * angle, np.zeros_like(x)], axis=-1)
