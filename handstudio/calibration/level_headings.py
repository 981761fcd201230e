"""Headings of sensors from compasses, and from level angular velocities that they share."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.averages import valid_mean
from handstudio.maths import so3
from handstudio.samples import ImuSamples

_ROUNDS = 3


def shared_headings(rate: Float[Array, "n s 3"], weight: Float[Array, "n s"]) -> Float[Array, " s"]:
    """Headings [rad] that bring level angular velocities nearest to their robust mean.

    Least squares over all samples; the mean is the median over sensors. Of one sample it is
    (4.19), but for a turn that all share.
    """
    level = rate[..., 0] + 1j * rate[..., 1]
    psi = wg_heading(rate[np.argmax(np.median(np.linalg.norm(rate, axis=-1), axis=1))])
    for _ in range(_ROUNDS):
        turned = level * np.exp(1j * psi)
        common = np.median(turned.real, axis=1) + 1j * np.median(turned.imag, axis=1)
        psi = np.angle((level.conj() * common[:, None] * weight).sum(axis=0))
    return np.asarray(psi)


def compass_headings(rest: ImuSamples) -> Float[Array, " s"]:
    """Headings psi [rad] that the compasses give at rest (2.11); NaN where there is none."""
    fresh = rest.fresh & rest.valid & np.isfinite(rest.mag).all(axis=-1)
    level = attitude(valid_mean(rest.acc, rest.valid))
    field = so3.rotate(level, valid_mean(np.nan_to_num(rest.mag), fresh))
    told = np.hypot(field[..., 0], field[..., 1]) > 0.0
    return np.where(told, -np.arctan2(field[..., 1], field[..., 0]), np.nan)


def robust_mean(angles: Float[Array, " m"]) -> float:
    """Circular mean [rad] that far ones pull at with a constant force only (Huber)."""
    centre = angles[np.argmin(np.abs(wrapped(angles[:, None] - angles)).sum(axis=0))]
    for _ in range(20):
        off = wrapped(angles - centre)
        near = max(2.0 * float(np.median(np.abs(off))), 1e-9)
        weight = np.minimum(1.0, near / np.maximum(np.abs(off), 1e-12))
        centre += (weight * off).sum() / weight.sum()
    return float(np.angle(np.exp(1j * centre)))


def wg_heading(rate: Float[Array, "*s 3"]) -> Float[Array, "*s"]:
    """Heading of gravity × angular velocity, both level (4.18, 4.19)."""
    return np.asarray(-np.arctan2(rate[..., 0], -rate[..., 1]))


def wrapped(angle: Float[Array, "*b"]) -> Float[Array, "*b"]:
    """The same angle, from -pi to pi."""
    return np.asarray(np.angle(np.exp(1j * angle)))
