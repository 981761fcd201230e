"""Least squares for postures: one with limits, or thousands at once without."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from handstudio.arrays import Array

Residuals: TypeAlias = Callable[[Array], Array]
"""Unknowns (n, x) to residuals (n, r), in units of what each may be off."""

Sloped: TypeAlias = Callable[[Array], tuple[Array, Array]]
"""Unknowns (n, x) to residuals (n, r) and their slopes (n, r, x)."""

_STEP = 1e-6


def solved(
    residuals: Residuals,
    start: Float[Array, " x"],
    least: Float[Array, " x"],
    most: Float[Array, " x"],
    tries: int = 80,
) -> Float[Array, " x"]:
    """Unknowns within limits whose residuals are smallest, from a start nearby."""

    def one(x: Array) -> Array:
        return residuals(x[None])[0]

    def slope(x: Array) -> Array:
        steps = _STEP * np.eye(len(x))
        both = residuals(np.concatenate([x + steps, x - steps]))
        ahead, behind = np.split(both, 2)
        change: Array = ((ahead - behind) / (2.0 * _STEP)).T
        return change

    inside = np.clip(start, least + 1e-9, most - 1e-9)
    found = least_squares(
        one, inside, slope, bounds=(least, most), x_scale=1.0, max_nfev=tries, xtol=1e-9, ftol=1e-9
    )
    best: Array = np.asarray(found.x)
    return best


def settled(sloped: Sloped, start: Float[Array, "n x"], tries: int = 40) -> Float[Array, "n x"]:
    """Each row where its own residuals are smallest: Levenberg's and Marquardt's way, all at once.

    What a row ends in depends on its own residuals only, and smoothly, as long as they have one
    minimum near the start.
    """
    x = start.copy()
    r, slopes = sloped(x)
    cost, damping = np.sum(r**2, axis=1), np.full(len(x), 1e-3)
    for _ in range(tries):
        turned = np.swapaxes(slopes, 1, 2)
        normal, gradient = turned @ slopes, (turned @ r[..., None])[..., 0]
        damped = normal + damping[:, None, None] * np.eye(x.shape[1])
        step = -np.linalg.solve(damped, gradient[..., None])[..., 0]
        r_new, slopes_new = sloped(x + step)
        cost_new = np.sum(r_new**2, axis=1)
        # at the end rounding alone decides; a step that is no step is taken
        better = cost_new <= cost * (1.0 + 1e-12)
        x = np.where(better[:, None], x + step, x)
        r = np.where(better[:, None], r_new, r)
        slopes = np.where(better[:, None, None], slopes_new, slopes)
        cost = np.where(better, cost_new, cost)
        damping = np.where(better, 0.1 * damping, 10.0 * damping).clip(1e-12, 1e6)
        if np.abs(step).max() < 1e-8:
            break
    return x
