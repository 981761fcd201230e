"""The smoother's loop, compiled: from the last instant to the first."""

from __future__ import annotations

from typing import no_type_check

import numpy as np

from handstudio.fusion import tree_earlier, tree_small, tree_sweep
from handstudio.fusion.tree_compiled import compiled, kept, stamp
from handstudio.fusion.tree_earlier import earlier, spread_before
from handstudio.fusion.tree_sweep import worst_of


@no_type_check
def _compiled(known_by):
    """The loop. It alone is kept on disk, under the stamp: it is never older than its source."""

    @kept
    @no_type_check
    def backward(order, parent, out, after, sure, follow, added, result, sd):
        """Smooth in place; see `tree_smoother`. The last two instants stay as they are.

        Args:
            order: All sensors, each after its parent.
            parent: Of each sensor.
            out: What the filter gave out, before correction (n, s, 4).
            after, sure, follow, added: Its tape.
            result: The same as ``out`` to begin with; the smoothed orientations.
            sd: How sure the filter was (n, s, 2); how sure the smoother is.
        """
        assert known_by != 0
        n, sensors = out.shape[0], out.shape[1]
        d, pulled, e = np.zeros((sensors, 3)), np.zeros((sensors, 3)), np.zeros(3)
        cov, edge = np.zeros((sensors, 3, 3)), np.zeros((sensors, 3, 3))
        work = np.zeros((7, sensors, 3, 3))
        if n > 2:
            spread_before(order, parent, sure[n - 1], follow[n - 1], cov, edge)
        for k in range(n - 2, 0, -1):
            # how far the future moves instant k, and what of that is not the step's own doing
            for s in range(sensors):
                _between(result[k], out[k], s, d)
            _pull(parent, sure[k + 1], follow[k + 1], d, pulled)
            for s in range(sensors):
                for i in range(3):
                    e[i] = d[s, i] - added[k, s] * pulled[s, i]
                _turned(after[k, s], e, result[k - 1, s])
            earlier(parent, sure[k + 1], follow[k + 1], added[k], cov, edge, work)
            for s in range(sensors):
                p = parent[s]
                sd[k - 1, s, 0] = np.sqrt(worst_of(p, s, False, cov, edge))
                sd[k - 1, s, 1] = np.sqrt(worst_of(p, s, p >= 0, cov, edge))

    return backward


@compiled
@no_type_check
def _pull(parent, sure, follow, d, pulled):
    """Product of the inverse covariance before correction with errors d, into pulled."""
    e, u = np.zeros(3), np.zeros(3)
    pulled[:] = 0.0
    for s in range(len(parent)):
        p = parent[s]
        for i in range(3):
            e[i] = d[s, i]
            if p >= 0:
                for j in range(3):
                    e[i] -= follow[s, i, j] * d[p, j]
        for i in range(3):
            u[i] = 0.0
            for j in range(3):
                u[i] += sure[s, i, j] * e[j]
            pulled[s, i] += u[i]
        if p >= 0:
            for i in range(3):
                for j in range(3):
                    pulled[p, i] -= follow[s, j, i] * u[j]


@compiled
@no_type_check
def _between(q, p, s, d):
    """Rotation vector in the world from p to q: ``log(q conj(p))``."""
    a, b, c, e = q[s, 0], q[s, 1], q[s, 2], q[s, 3]
    w, x, y, z = p[s, 0], -p[s, 1], -p[s, 2], -p[s, 3]
    r0 = a * w - b * x - c * y - e * z
    r1 = a * x + b * w + c * z - e * y
    r2 = a * y - b * z + c * w + e * x
    r3 = a * z + b * y - c * x + e * w
    if r0 < 0.0:
        r0, r1, r2, r3 = -r0, -r1, -r2, -r3
    sine = np.sqrt(r1 * r1 + r2 * r2 + r3 * r3)
    scale = 2.0 if sine < 1e-9 else 2.0 * np.arctan2(sine, r0) / sine
    d[s, 0], d[s, 1], d[s, 2] = scale * r1, scale * r2, scale * r3


@compiled
@no_type_check
def _turned(q, v, out):
    """``exp(v) q``, into out."""
    angle = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    c, s = np.cos(0.5 * angle), 0.5 if angle < 1e-9 else np.sin(0.5 * angle) / angle
    a, b, d = s * v[0], s * v[1], s * v[2]
    out[0] = c * q[0] - a * q[1] - b * q[2] - d * q[3]
    out[1] = c * q[1] + a * q[0] + b * q[3] - d * q[2]
    out[2] = c * q[2] - a * q[3] + b * q[0] + d * q[1]
    out[3] = c * q[3] + a * q[2] - b * q[1] + d * q[0]


_PARTS = (tree_small, tree_sweep, tree_earlier)

backward = _compiled(stamp(*map(vars, _PARTS), globals()))
