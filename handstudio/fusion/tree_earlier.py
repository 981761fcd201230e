"""How sure a smoother is of an instant, from how sure it is of the one after; compiled.

The covariance that goes with `tree_smoother`'s step back, ``A = 1 - Q S``:

    C_k = A C_k+1 A' + Q - Q S Q

S joins neighbours only, and given a sensor's own error those of its neighbours do not depend on
each other: so every block of the result that is kept, a sensor's own and that with its parent, is a
sum over neighbours, and the nearest tree is kept again.
"""

from __future__ import annotations

from typing import no_type_check

import numpy as np

from handstudio.fusion.tree_compiled import compiled
from handstudio.fusion.tree_parts import TINY
from handstudio.fusion.tree_small import inverse3, times_by_rows
from handstudio.fusion.tree_sweep import is_positive


@compiled
@no_type_check
def spread_before(order, parent, sure, follow, cov, edge):
    """Covariances of a tree whose sensors follow their parents, into cov and edge."""
    t = np.empty((3, 3))
    for s in order:
        p = parent[s]
        inverse3(sure[s], cov[s])
        if p < 0:
            edge[s] = 0.0
            continue
        times_by_rows(follow[s], cov[p], edge[s])
        _times_turned(edge[s], follow[s], t)
        for i in range(3):
            for j in range(3):
                cov[s, i, j] += t[i, j]


@compiled
@no_type_check
def earlier(parent, sure, follow, added, cov, edge, work):
    """One instant back, in place.

    Args:
        parent: Of each sensor.
        sure, follow: The tree before the later instant was corrected (`Tape`).
        added: Variance that the step to it added.
        cov, edge: Smoothed covariances, of the later instant and then of the earlier one.
        work: Room for seven matrices a sensor.
    """
    own, link, down, up, gain, noise, whole = work
    n = len(parent)
    t, u, v = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    _precision(parent, sure, follow, own, link)
    for s in range(n):
        gain[s] = -added[s] * own[s]
        noise[s] = -(added[s] ** 2) * own[s]
        for i in range(3):
            gain[s, i, i] += 1.0
            noise[s, i, i] += added[s]
    for s in range(n):  # what children do to their parents
        p = parent[s]
        if p < 0:
            continue
        inverse3(cov[p], t)
        times_by_rows(edge[s], t, down[s])
        _rest(cov[s], edge[s], down[s], u)
        _turn_over(link[s], t, added[p])
        times_by_rows(t, down[s], v)
        gain[p] += v
        _around(t, u, noise[p])
    for s in range(n):  # and these to them: beside what their own children do
        p = parent[s]
        whole[s] = gain[s]
        if p < 0:
            continue
        _turn_over(edge[s], u, 1.0)
        inverse3(cov[s], t)
        times_by_rows(u, t, up[s])
        _rest(cov[p], u, up[s], v)
        for i in range(3):
            for j in range(3):
                t[i, j] = added[s] * link[s, i, j]
        _around(t, v, noise[s])
        times_by_rows(t, up[s], u)
        whole[s] += u
    for s in range(n):
        if parent[s] >= 0:
            _edge(s, parent[s], added, cov, edge, (link, down, gain, whole, up), (t, u, v))
    for s in range(n):
        if parent[s] >= 0:
            edge[s] = up[s]
    for s in range(n):
        _around_to(whole[s], cov[s], noise[s], t)
        if is_positive(t):  # rounding, where nearly nothing is known: then as it was
            cov[s] = t


@compiled
@no_type_check
def _precision(parent, sure, follow, own, link):
    """Inverse of the covariance of all: a sensor's own block, and minus that with its parent."""
    t = np.empty((3, 3))
    own[:] = sure
    for s in range(len(parent)):
        p = parent[s]
        if p < 0:
            continue
        times_by_rows(sure[s], follow[s], link[s])
        _turn_over(follow[s], t, 1.0)
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    own[p, i, j] += t[i, k] * link[s, k, j]


@compiled
@no_type_check
def _edge(s, p, added, cov, edge, parts, room):
    """Covariance of a sensor with its parent one instant back, into the room of ``up``."""
    link, down, gain, whole, up = parts
    t, u, v = room
    _turn_over(link[s], t, added[p])  # how the parent takes from the sensor
    times_by_rows(t, down[s], v)
    for i in range(3):
        for j in range(3):
            v[i, j] = whole[p, i, j] - v[i, j]  # and from itself and its others
    for i in range(3):
        for j in range(3):
            a = b = 0.0
            for k in range(3):
                to_parent = added[s] * link[s, i, k]
                a += gain[s, i, k] * cov[s, k, j] + to_parent * edge[s, j, k]
                b += gain[s, i, k] * edge[s, k, j] + to_parent * cov[p, k, j]
            u[i, j] = a
            up[s, i, j] = b
    _times_turned(u, t, down[s])
    _times_turned(up[s], v, t)
    both = added[s] * added[p]
    for i in range(3):
        for j in range(3):
            up[s, i, j] = down[s, i, j] + t[i, j] + both * link[s, i, j]


@compiled
@no_type_check
def _rest(cov, edge, by, out):
    """What is left of a covariance where a neighbour is known: ``cov - by edge'``."""
    _times_turned(by, edge, out)
    for i in range(3):
        for j in range(3):
            out[i, j] = cov[i, j] - out[i, j]


@compiled
@no_type_check
def _times_turned(a, b, out):
    """Matrix product ``a b'``, into out."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[j, 0] + a[i, 1] * b[j, 1] + a[i, 2] * b[j, 2]


@compiled
@no_type_check
def _turn_over(a, out, by):
    """``by a'``, into out."""
    for i in range(3):
        for j in range(3):
            out[i, j] = by * a[j, i]


@compiled
@no_type_check
def _around(a, b, out):
    """Add ``a b a'`` to out."""
    for i in range(3):
        r0 = a[i, 0] * b[0, 0] + a[i, 1] * b[1, 0] + a[i, 2] * b[2, 0]
        r1 = a[i, 0] * b[0, 1] + a[i, 1] * b[1, 1] + a[i, 2] * b[2, 1]
        r2 = a[i, 0] * b[0, 2] + a[i, 1] * b[1, 2] + a[i, 2] * b[2, 2]
        for j in range(3):
            out[i, j] += r0 * a[j, 0] + r1 * a[j, 1] + r2 * a[j, 2]


@compiled
@no_type_check
def _around_to(a, b, more, out):
    """``a b a' + more``, made symmetric, into out."""
    out[:] = more
    _around(a, b, out)
    for i in range(3):
        for j in range(i):
            out[i, j] = out[j, i] = 0.5 * (out[i, j] + out[j, i])
        out[i, i] += TINY
