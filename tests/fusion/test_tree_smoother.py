"""How sure the smoother is, against the same computed with everything at once."""

from __future__ import annotations

import numpy as np

from handstudio.arrays import Array
from handstudio.fusion.tree_backward import backward
from handstudio.maths import so3

PARENT = np.array([-1, 0, 1, 0, 3, 3])
SENSORS, INSTANTS = len(PARENT), 4


def dense(sure: Array, follow: Array) -> Array:
    """Inverse covariance of all sensors together, of a tree."""
    precision = np.zeros((3 * SENSORS, 3 * SENSORS))
    for s, p in enumerate(PARENT):
        row = np.zeros((3, 3 * SENSORS))
        row[:, 3 * s : 3 * s + 3] = np.eye(3)
        if p >= 0:
            row[:, 3 * p : 3 * p + 3] = -follow[s]
        precision += row.T @ sure[s] @ row
    return precision


def block(cov: Array, i: int, j: int) -> Array:
    return cov[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]


def nearest_tree(cov: Array) -> Array:
    """The same blocks of sensors, and of sensors with their parents; the rest by way of these."""
    sure, follow = np.zeros((SENSORS, 3, 3)), np.zeros((SENSORS, 3, 3))
    for s, p in enumerate(PARENT):
        rest = block(cov, s, s)
        if p >= 0:
            follow[s] = block(cov, s, p) @ np.linalg.inv(block(cov, p, p))
            rest = rest - follow[s] @ block(cov, p, s)
        sure[s] = np.linalg.inv(rest)
    return np.linalg.inv(dense(sure, follow))


def expected_sd(cov: Array) -> Array:
    """Of each sensor, and relative to its parent, about the axis that is known least."""
    out = np.zeros((SENSORS, 2))
    for s, p in enumerate(PARENT):
        own = relative = block(cov, s, s)
        if p >= 0:
            relative = own + block(cov, p, p) - block(cov, s, p) - block(cov, p, s)
        out[s] = np.sqrt([np.diag(own).max(), np.diag(relative).max()])
    return out


def test_how_sure_it_is_goes_back_as_with_everything_at_once():
    """Rauch, Tung and Striebel's step, written out for the whole."""
    rng = np.random.default_rng(1)
    shape = (INSTANTS, SENSORS, 3, 3)
    half = rng.normal(0.0, 1.0, shape)
    sure = half @ np.swapaxes(half, -1, -2) + 5.0 * np.eye(3)
    follow = rng.normal(0.0, 0.3, shape) + 0.5 * np.eye(3)
    added = rng.uniform(0.001, 0.02, (INSTANTS, SENSORS))
    q = np.tile(so3.IDENTITY, (INSTANTS, SENSORS, 1))
    sd = np.full((INSTANTS, SENSORS, 2), 9.0)
    backward(np.arange(SENSORS), PARENT, q, q, sure, follow, added, q.copy(), sd)
    cov = np.linalg.inv(dense(sure[-1], follow[-1]))
    for k in (2, 1):
        noise, whole = np.diag(np.repeat(added[k], 3)), dense(sure[k + 1], follow[k + 1])
        step = np.eye(3 * SENSORS) - noise @ whole
        cov = step @ cov @ step.T + noise - noise @ whole @ noise
        np.testing.assert_allclose(sd[k - 1], expected_sd(cov), rtol=1e-9)
        cov = nearest_tree(cov)
    np.testing.assert_array_equal(sd[2:], 9.0)
