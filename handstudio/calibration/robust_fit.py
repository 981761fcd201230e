"""Robust least squares for places of joint centres, with a covariance that can be believed.

Gauss-Newton with Huber's weights. A direction of a place that the signals hardly show is left out
and said to be unseen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.rigid_rotation import SMOOTHED_OVER_S

UNSEEN_SD_M = 0.1
"""Standard deviation along a direction of which the signals say nothing: as large as a hand."""

LEAST_SEEN = 0.1
"""A direction seen worse than this, relative to the one seen best, counts as unseen.

A hinge that wobbles by a tenth of its own rate is a hinge: what its wobble tells is skin and play.
"""

BLOCK_S = 1.0
"""Residuals so far apart are taken to be independent."""

Model: TypeAlias = Callable[[Array], tuple[Array, Array]]
"""Unknowns to what is left ``(n, m)`` and its derivatives ``(n, m, k)``."""

_HUBER, _BEYOND = 1.5, 6.0  # standard deviations
_SCALE_FLOOR = 1e-6  # of residuals [m/s²]: those of ideal data vanish
_MOST_STEPS, _SMALL_STEP = 40, 1e-7


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A robust least-squares fit whose first unknowns are places [m].

    Attributes:
        x: All unknowns; unseen directions of the places are at zero.
        covariance: Of the places [m²].
        unseen: Directions of the places that are not seen, one a column.
        residual: RMS of what is left.
        condition: Condition number of the places, everything else eliminated.
    """

    x: Float[Array, " k"]
    covariance: Float[Array, "p p"]
    unseen: Float[Array, "p u"]
    residual: float
    condition: float


def fit(
    model: Model, start: Float[Array, " k"], prior: Float[Array, "k k"], places: int, rate_hz: float
) -> Fitted:
    """Gauss-Newton with Huber's weights; the covariance holds for correlated residuals too.

    What lies far beyond (a knock) weighs next to nothing: it makes vectors longer, never shorter,
    so that even a constant pull adds up. The covariance is a jackknife over blocks of `BLOCK_S` in
    closed form (the sandwich known as CR3): what neighbours err by together adds up within a
    block. Directions of the places seen less than `LEAST_SEEN` are left at zero.

    Args:
        model: What is left, and its derivatives, at the used instants.
        start: First guess.
        prior: Information (inverse covariance) on all unknowns, about zero.
        places: How many of the unknowns, the first ones, are places.
        rate_hz: Samples a second.
    """
    x = start
    for _ in range(_MOST_STEPS):
        equations = _equations(model, x, prior, rate_hz)
        seen, unseen, condition = _split(equations.information, places)
        basis = _basis(seen, len(x))
        inner = basis.T @ equations.information @ basis
        toward = equations.information @ x - equations.slope
        before, x = x, basis @ np.linalg.solve(inner, basis.T @ toward)
        if np.abs(x - before).max() < _SMALL_STEP:
            break
    equations = _equations(model, x, prior, rate_hz)
    inverse = basis @ np.linalg.inv(basis.T @ equations.information @ basis) @ basis.T
    covariance = _sandwich(equations, inverse, prior, rate_hz)[:places, :places]
    covariance = 0.5 * (covariance + covariance.T) + UNSEEN_SD_M**2 * unseen @ unseen.T
    return Fitted(x, covariance, unseen, equations.residual, condition)


@dataclass(frozen=True, slots=True, eq=False)
class _Equations:
    rows: Array  # (n, m, k), weighed
    left: Array  # (n, m), weighed
    information: Array
    slope: Array
    residual: float


def _equations(model: Model, x: Array, prior: Array, rate_hz: float) -> _Equations:
    left, rows = model(x)
    length = np.linalg.norm(left, axis=1)
    scale = max(float(np.median(length)) * 1.4826 / np.sqrt(left.shape[1]), _SCALE_FLOOR)
    relative = length / (scale * np.sqrt(left.shape[1]))
    # smoothed samples repeat one another: as many as the window holds tell as much as one
    alike = max(1.0, SMOOTHED_OVER_S * rate_hz)
    robust = _HUBER / np.maximum(relative, _HUBER) / (1.0 + (relative / _BEYOND) ** 4)
    weight = np.sqrt(robust / alike) / scale
    rows, weighed = rows * weight[:, None, None], left * weight[:, None]
    flat = rows.reshape(-1, len(x))
    return _Equations(
        rows=rows,
        left=weighed,
        information=flat.T @ flat + prior,
        slope=flat.T @ weighed.ravel() + prior @ x,
        residual=float(np.sqrt((left**2).sum(axis=1).mean())),
    )


def _sandwich(equations: _Equations, inverse: Array, prior: Array, rate_hz: float) -> Array:
    """How much leaving out one block moves the unknowns, summed over blocks."""
    size = max(1, round(BLOCK_S * rate_hz))
    covariance: Array = inverse @ prior @ inverse
    for start in range(0, len(equations.rows), size):
        rows = equations.rows[start : start + size].reshape(-1, len(inverse))
        left = equations.left[start : start + size].ravel()
        without = np.eye(len(inverse)) - rows.T @ rows @ inverse
        moved = inverse @ np.linalg.lstsq(without, rows.T @ left)[0]
        covariance += np.outer(moved, moved)
    return covariance


def _split(information: Array, places: int) -> tuple[Array, Array, float]:
    """Directions of the places that are seen, those that are not, and the condition number."""
    own, shared = information[:places, :places], information[:places, places:]
    others = information[places:, places:]
    own = own - shared @ np.linalg.solve(others, shared.T)
    # two sensors may turn at very different rates: each by its own measure
    each = np.trace(own.reshape(places // 3, 3, places // 3, 3), axis1=1, axis2=3).diagonal()
    unit = np.repeat(1.0 / np.sqrt(each), 3)
    power, directions = np.linalg.eigh(own * unit[:, None] * unit)
    strength = np.sqrt(np.maximum(power, 0.0) / power[-1])
    seen = strength >= LEAST_SEEN
    condition = 1.0 / float(strength[0]) if strength[0] > 0.0 else float("inf")
    directions = directions * unit[:, None]
    unseen = directions[:, ~seen] / np.linalg.norm(directions[:, ~seen], axis=0)
    return directions[:, seen], unseen, condition


def _basis(seen: Array, count: int) -> Array:
    places, free = seen.shape
    basis = np.zeros((count, free + count - places))
    basis[:places, :free] = seen
    basis[places:, free:] = np.eye(count - places)
    return basis
