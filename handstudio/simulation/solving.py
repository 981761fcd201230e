"""Least squares for postures: one with limits, or thousands at once without."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array

Residuals: TypeAlias = Callable[[Array], Array]
"""Unknowns (n, x) to residuals (n, r), in units of what each may be off."""

Sloped: TypeAlias = Callable[[Array, Array], tuple[Array, Array]]
"""Unknowns (n, x) of some rows, and which, to residuals (n, r) and their slopes (n, r, x)."""

_STEP = 1e-7
_STUCK = 1e12


def solved(
    residuals: Residuals,
    start: Float[Array, " x"],
    least: Float[Array, " x"],
    most: Float[Array, " x"],
    *,
    within: float = 1e-8,
    tries: int = 80,
) -> Float[Array, " x"]:
    """Unknowns within limits whose residuals are smallest, from a start nearby.

    Levenberg's and Marquardt's way; what stands at a limit and would go beyond stays. Done as soon
    as a step makes the sum of squares smaller by no more than this share. (scipy's is as good, but
    its singular values take ten times as long where every core is busy.)
    """
    x = np.clip(start, least, most)
    r, slopes = _sloped(residuals, x)
    damping, growth = 1.0, 2.0
    for _ in range(tries):
        gradient = slopes.T @ r
        free = ~(((x <= least) & (gradient > 0.0)) | ((x >= most) & (gradient < 0.0)))
        normal = slopes[:, free].T @ slopes[:, free]
        step = np.zeros_like(x)
        step[free] = -np.linalg.solve(normal + damping * np.eye(len(normal)), gradient[free])
        there = np.clip(x + step, least, most)
        step, r_there = there - x, residuals(there[None])[0]
        gained = float(r @ r - r_there @ r_there)
        foreseen = -float(2.0 * gradient @ step + np.sum((slopes @ step) ** 2))
        if gained < 0.0:
            damping, growth = damping * growth, 2.0 * growth
            if damping > _STUCK:
                break
            continue
        x, done = there, gained <= within * float(r @ r)
        if done:
            break
        r, slopes = _sloped(residuals, x)
        ease = 2.0 * min(1.0, gained / max(foreseen, 1e-300)) - 1.0
        damping, growth = max(1e-9, damping * max(1.0 / 3.0, 1.0 - ease**3)), 2.0
    return x


def _sloped(residuals: Residuals, x: Array) -> tuple[Array, Array]:
    """Residuals and their slopes, without those that are nothing and stay so."""
    at = residuals(np.concatenate([x[None], x + _STEP * np.eye(len(x))]))
    slopes = ((at[1:] - at[0]) / _STEP).T
    some = (at[0] != 0.0) | slopes.any(axis=1)
    return at[0, some], slopes[some]


def settled(
    sloped: Sloped, start: Float[Array, "n x"], within: float = 1e-8, tries: int = 60
) -> Float[Array, "n x"]:
    """Each row where its own residuals are smallest: Levenberg's and Marquardt's way, all at once.

    What a row ends in depends on its own residuals only, and smoothly, as long as they have one
    minimum near the start. Damping as in H. B. Nielsen, IMM-REP-1999-05, Technical University of
    Denmark.

    Args:
        sloped: The residuals.
        start: Unknowns to start from.
        within: A row is done as soon as no unknown would go farther than this.
        tries: Steps at most.
    """
    out, rows = start.copy(), np.arange(len(start))
    x = start.copy()
    r, slopes = sloped(x, rows)
    damping, growth = np.ones(len(x)), np.full(len(x), 2.0)
    for _ in range(tries):
        turned = np.swapaxes(slopes, 1, 2)
        gradient = (turned @ r[..., None])[..., 0]
        damped = turned @ slopes + damping[:, None, None] * np.eye(x.shape[1])
        step = -np.linalg.solve(damped, gradient[..., None])[..., 0]
        r_new, slopes_new = sloped(x + step, rows)
        cost, cost_new = np.sum(r**2, axis=1), np.sum(r_new**2, axis=1)
        expected = np.sum(step * (damping[:, None] * step - gradient), axis=1)
        gain = (cost - cost_new) / np.maximum(expected, 1e-300)
        better = cost_new <= cost * (1.0 + 1e-12)  # at the end rounding alone decides
        x = np.where(better[:, None], x + step, x)
        out[rows] = x
        r = np.where(better[:, None], r_new, r)
        slopes = np.where(better[:, None, None], slopes_new, slopes)
        easier = np.maximum(1.0 / 3.0, 1.0 - (2.0 * np.clip(gain, 0.0, 1.0) - 1.0) ** 3)
        damping = (damping * np.where(better, easier, growth)).clip(1e-9, 1e9)
        growth = np.where(better, 2.0, 2.0 * growth).clip(2.0, 64.0)
        on = np.abs(step).max(axis=1) > within
        if not on.any():
            break
        rows, x, r, slopes, damping, growth = (
            part[on] for part in (rows, x, r, slopes, damping, growth)
        )
    return out
