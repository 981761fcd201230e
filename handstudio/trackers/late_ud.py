"""Covariances as ``U D U'``, which no rounding can make indefinite.

U is unit upper triangular, D a vector of variances. Bierman, *Factorization Methods for Discrete
Sequential Estimation*, 1977: the measurement of one number (chapter V) and the weighted
Gram-Schmidt of a time step after Thornton (chapter VI).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array


def factors_of(p: Float[Array, "m m"]) -> tuple[Float[Array, "m m"], Float[Array, " m"]]:
    """U and D of a covariance."""
    p, size = p.copy(), len(p)
    u, d = np.eye(size), np.zeros(size)
    for j in range(size - 1, -1, -1):
        d[j] = p[j, j]
        u[:j, j] = p[:j, j] / d[j] if d[j] > 0.0 else 0.0
        p[:j, :j] -= d[j] * np.outer(u[:j, j], u[:j, j])
    return u, d


def covariance_of(u: Float[Array, "m m"], d: Float[Array, " m"]) -> Float[Array, "m m"]:
    """The covariance whose factors these are."""
    return np.asarray((u * d) @ u.T)


def stepped(
    u: Float[Array, "m m"],
    d: Float[Array, " m"],
    f: Float[Array, "m m"],
    q: Float[Array, " m"],
) -> tuple[Float[Array, "m m"], Float[Array, " m"]]:
    """Factors of ``F P F' + diag(q)``: equations (5) and (14)."""
    size = len(d)
    w = np.concatenate([f @ u, np.eye(size)], axis=1)
    weights = np.concatenate([d, q])
    after, variances = np.eye(size), np.zeros(size)
    for j in range(size - 1, -1, -1):
        weighed = weights * w[j]
        variances[j] = weighed @ w[j]
        if variances[j] > 0.0:
            after[:j, j] = w[:j] @ weighed / variances[j]
            w[:j] -= np.outer(after[:j, j], w[j])
    return after, variances


def measured(
    u: Float[Array, "m m"], d: Float[Array, " m"], h: Float[Array, " m"], r: float
) -> tuple[Float[Array, "m m"], Float[Array, " m"], Float[Array, " m"]]:
    """Factors after one number was measured, and the gain: (7), (8), (10), (11), (16), (17).

    Args:
        u, d: Factors before.
        h: Row of the observation matrix.
        r: Variance of the number's error, above 0.
    """
    f = h @ u
    v = d * f
    after, variances, gain = u.copy(), d.copy(), np.zeros(len(d))
    alpha = r
    for j in range(len(d)):
        before, alpha = alpha, alpha + f[j] * v[j]
        variances[j] = d[j] * before / alpha
        after[:, j] = u[:, j] - f[j] / before * gain
        gain = gain + v[j] * u[:, j]
    return after, variances, gain / alpha
