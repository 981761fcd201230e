"""The thesis's way to a joint's centre: pairs of instants of two rotations (3.2 to 3.10).

Where a swing turns back, omega is near zero, ``a_r = domega x P``, and P lies in the plane normal
to a_r. Two such planes, of rotations about two axes, meet in the direction of P. Kept as the
reference it is: `one_sided` uses every sample instead, and `two_sided` holds no segment still.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from handstudio.arrays import Array
from handstudio.calibration.rigid_rotation import (
    CentreEstimate,
    RigidRotation,
    excitation,
    joined,
)
from handstudio.errors import CalibrationError

LEAST_TURNS = 3
"""Swings of each rotation that must turn back."""

_NEAR_ZERO = 0.3  # a minimum of the rate counts below this share of its RMS
_DEEP = 0.5  # and where it is so much lower than its surroundings
_EXACT = 1e-9  # deviations are taken to be no smaller, or ideal data weigh infinitely


@dataclass(frozen=True, slots=True, eq=False)
class _Pairs:
    """All pairs of an instant of the first rotation and one of the second.

    Attributes:
        index: Which minimum of the first, and which of the second.
        u: Direction of P (3.2), its sign right.
        x: ``sqrt(|domega|^2 - (u.domega)^2)`` of the instants that tell the length [rad/s²].
        y: ``|a_r|`` of the same [m/s²].
    """

    index: Int[Array, "p 2"]
    u: Float[Array, "p 3"]
    x: Float[Array, "p j"]
    y: Float[Array, "p j"]


def centre(first: RigidRotation, second: RigidRotation, hinge: bool = False) -> CentreEstimate:
    """The centre from rotations about two axes, as published.

    The thesis gives no uncertainty. The covariance here is a jackknife over the minima: how much
    the place moves when one is left out.

    Args:
        first: Rotation about one axis; ``acc`` is free of gravity (3.7).
        second: About another. For a hinge that of the nearest two-axis joint proximal to it.
        hinge: Sign, length and weights are of the first rotation alone.

    Raises:
        CalibrationError: too few swings, or both about the same axis.
    """
    own = first if hinge else joined([first, second])
    turned = excitation(own)
    pairs = _pairs(first, second, 1 if hinge else 2)
    length = _length(pairs)
    weight = 1.0 / np.maximum(_deviation(pairs, length), _EXACT)  # w1
    weight /= np.maximum(_misfit(own, length * pairs.u), _EXACT)  # w2
    place = _place(pairs, weight, np.ones(len(weight), dtype=bool))
    left = own.acc[own.used] - own.gamma[own.used] @ place
    both = joined([first, second])
    return CentreEstimate(
        from_centre_m=place,
        covariance=_jackknife(pairs, weight),
        unseen=np.zeros(3),
        residual=float(np.sqrt((left**2).sum(axis=1).mean())),
        excitation=turned,
        condition=float(np.linalg.cond(both.gamma[both.used].reshape(-1, 3))),
    )


def turning_points(rotation: RigidRotation) -> Int[Array, " m"]:
    """Instants at which a swing turns back: minima of ``|omega|`` near zero."""
    rate = np.linalg.norm(rotation.gyr, axis=1)
    usual = float(np.sqrt((rate[rotation.used] ** 2).mean()))
    from scipy.signal import find_peaks  # noqa: PLC0415 - takes a second to load

    found, _ = find_peaks(-rate, height=-_NEAR_ZERO * usual, prominence=_DEEP * usual)
    return np.asarray(found[rotation.used[found]])


def _pairs(first: RigidRotation, second: RigidRotation, telling: int) -> _Pairs:
    at = [turning_points(rotation) for rotation in (first, second)]
    _refuse_few(min(len(a) for a in at))
    i, k = (index.ravel() for index in np.indices((len(at[0]), len(at[1]))))
    acc = np.stack([first.acc[at[0][i]], second.acc[at[1][k]]], axis=1)
    domega = np.stack([first.domega[at[0][i]], second.domega[at[1][k]]], axis=1)
    across = np.cross(acc[:, 0], acc[:, 1])
    size = np.linalg.norm(across, axis=1)
    apart = size > 0.0
    _refuse_few(int(apart.sum()))
    u = across[apart] / size[apart, None]
    acc, domega = acc[apart, :telling], domega[apart, :telling]
    sign = np.einsum("pi,pji->p", u, np.cross(acc, domega))
    u = np.where(sign[:, None] < 0.0, -u, u)
    along = np.einsum("pi,pji->pj", u, domega)
    x = np.sqrt(np.maximum((domega**2).sum(axis=-1) - along**2, 0.0))
    return _Pairs(np.stack([i, k], axis=1)[apart], u, x, np.linalg.norm(acc, axis=-1))


def _length(pairs: _Pairs) -> float:
    """Slope of the line through the origin (3.8)."""
    return float((pairs.x * pairs.y).sum() / (pairs.x**2).sum())


def _deviation(pairs: _Pairs, length: float) -> Float[Array, " p"]:
    """Of every direction's points from the line."""
    away = np.linalg.norm(pairs.y - length * pairs.x, axis=1)
    return np.asarray(away / np.hypot(1.0, length))


def _misfit(rotation: RigidRotation, places: Float[Array, "p 3"]) -> Float[Array, " p"]:
    """RMSE norm of (3.1) over the whole recording, of every place."""
    acc, gamma = rotation.acc[rotation.used], rotation.gamma[rotation.used].reshape(-1, 3)
    # |a - Gamma P|^2 summed is quadratic in P
    inner, mixed, whole = gamma.T @ gamma, gamma.T @ acc.ravel(), float((acc**2).sum())
    square = np.einsum("pi,ij,pj->p", places, inner, places) - 2.0 * places @ mixed + whole
    return np.asarray(np.sqrt(np.maximum(square, 0.0) / len(acc)))


def _place(pairs: _Pairs, weight: Array, kept: Array) -> Float[Array, " 3"]:
    """Weighted mean direction, made a unit vector (3.10), times the length."""
    mean = (weight[kept, None] * pairs.u[kept]).sum(axis=0)
    part = _Pairs(pairs.index[kept], pairs.u[kept], pairs.x[kept], pairs.y[kept])
    return np.asarray(_length(part) * mean / np.linalg.norm(mean))


def _jackknife(pairs: _Pairs, weight: Array) -> Float[Array, "3 3"]:
    covariance = np.zeros((3, 3))
    for side in (0, 1):
        minima = np.unique(pairs.index[:, side])
        places = np.stack([_place(pairs, weight, pairs.index[:, side] != m) for m in minima])
        covariance += (len(minima) - 1) * np.cov(places.T, bias=True)
    return covariance


def _refuse_few(found: int) -> None:
    if found < LEAST_TURNS:
        raise CalibrationError(
            "A rotation turned back {found} times; at least {least} are needed, of each of two.",
            "Swing the joint to and fro about one axis, then about another, for longer.",
            found=found,
            least=LEAST_TURNS,
        )
