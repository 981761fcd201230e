"""Means of what sensors read, over the instants that count."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.samples import ImuSamples


def blocks_of(part: ImuSamples, size: int) -> tuple[Array, Array, Array, Array]:
    """Time [s], means of gyroscope and accelerometer, weight; of blocks of so many samples."""
    count = len(part) // size

    def cut(values: Array) -> Array:
        return values[: count * size].reshape(count, size, *values.shape[1:])

    good = cut(part.valid & ~part.saturated)
    means = (averaged(cut(v), good) for v in (part.gyr, part.acc))
    return cut(part.time_us).mean(axis=1) * 1e-6, *means, good.all(axis=1).astype(float)


def averaged(values: Float[Array, "n m *s k"], weight: Array) -> Float[Array, "n *s k"]:
    """Mean over the second axis."""
    total = (values * weight[..., None]).sum(axis=1)
    return np.asarray(total / np.maximum(weight.sum(axis=1), 1e-9)[..., None])


def valid_mean(values: Float[Array, "n s k"], good: Bool[Array, "n s"]) -> Float[Array, "s k"]:
    """Mean over the instants that are good."""
    mean: Array = averaged(values[None], good[None])[0]
    return mean
