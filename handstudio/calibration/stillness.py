"""Rest: how still sensors were, how they trembled, and in how many directions they lay."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.calibration import demands
from handstudio.calibration.heard import (
    angle_between,
    live_ones,
    mean_while,
    seconds_of,
    steps_in,
    thinned,
)
from handstudio.calibration.verdict import Reading
from handstudio.layout import Layout
from handstudio.samples import ImuSamples

BLOCK_S = 0.5  # that a rest is judged by, and the shortest there is
_TREMOR_S = 0.05  # half a period of tremor
_NAN = float("nan")


def stillness_of(samples: ImuSamples, layout: Layout, where: str) -> Reading:
    """The most that a sensor turned in half a second [deg/s], its bias taken off."""
    limit = demands.RESTING_DEG_S if where == "table" else demands.HELD_STILL_DEG_S
    samples = thinned(samples)
    live = live_ones(samples)
    if not len(live) or seconds_of(samples) < 0.5 * BLOCK_S:
        return Reading("stillness", _NAN, limit, "deg/s", at_least=False)
    gyr, valid = np.rad2deg(samples.gyr[:, live]), samples.valid[:, live]
    mean = mean_while(gyr, valid)
    square = np.where(valid, np.sum((gyr - mean) ** 2, axis=-1), 0.0)
    blocks = _blocks(samples)
    turned = np.sqrt(
        np.add.reduceat(square, blocks) / np.maximum(1, np.add.reduceat(valid, blocks, dtype=int))
    )
    fast = np.maximum(turned.max(axis=0), np.linalg.norm(mean, axis=-1) - demands.BIAS_DEG_S)
    fast = np.maximum(fast, _tilting(samples, live))
    worst = int(np.argmax(fast))
    value = float(fast[worst])
    about = layout.names[live[worst]] if value > limit else ""
    return Reading("stillness", value, limit, "deg/s", at_least=False, about=about)


def tremor_of(done: ImuSamples) -> float:
    """How much the sensor that trembles most does so at some 10 Hz [deg/s].

    The fourth difference over half periods: 1 at 10 Hz, a thousandth where an arm is lifted.
    """
    done, live = thinned(done), live_ones(done)
    count, (far, _) = len(done), steps_in(done, _TREMOR_S)
    if count <= 4 * far or not len(live):
        return 0.0
    gyr = done.gyr[:, live]
    pieces = [gyr[k * far : count - (4 - k) * far] for k in range(5)]
    fast = sum(w * piece for w, piece in zip((1, -4, 6, -4, 1), pieces, strict=True)) / 16.0
    return float(np.rad2deg(np.sqrt(np.mean(np.sum(fast**2, axis=-1), axis=0)).max()))


def directions_of(done: ImuSamples) -> Reading:
    """How many directions the first sensor that answers lay still in."""
    found = list[Array]()
    live = live_ones(done)
    if len(live) and seconds_of(done) >= BLOCK_S:
        gyr, acc = done.gyr[:, live[0]], done.acc[:, live[0]]
        blocks = _blocks(done)
        for part in zip(blocks, [*blocks[1:], len(done)], strict=True):
            rate, up = gyr[slice(*part)], acc[slice(*part)].mean(axis=0)
            still = np.rad2deg(np.linalg.norm(rate - np.median(rate, axis=0), axis=-1).max())
            slow = np.rad2deg(np.linalg.norm(rate.mean(axis=0))) < demands.BIAS_DEG_S
            new = all(angle_between(up, known) > np.deg2rad(demands.APART_DEG) for known in found)
            if slow and still < 2.0 * demands.HELD_STILL_DEG_S and new:
                found.append(up)
    return Reading("directions", float(len(found)), float(demands.DIRECTIONS), "")


def _blocks(samples: ImuSamples) -> Int64[Array, " b"]:
    """Where pieces of half a second begin; what is left over belongs to the last."""
    each = max(1, round(BLOCK_S * len(samples) / max(seconds_of(samples), 1e-3)))
    return np.arange(max(1, len(samples) // each)) * each


def _tilting(samples: ImuSamples, live: Int64[Array, " l"]) -> Float[Array, " l"]:
    """How fast gravity's direction moved [deg/s]: a slow turn looks like a bias otherwise."""
    seconds, half = seconds_of(samples), len(samples) // 2
    if seconds < BLOCK_S:
        return np.zeros(len(live))
    before, after = (mean_while(x.acc, x.valid)[live] for x in (samples[:half], samples[half:]))
    return np.nan_to_num(np.rad2deg(angle_between(before, after)) / (0.5 * seconds))
