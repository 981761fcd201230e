"""One sweep over the tree and back: what an instant tells, made one estimate.

The error of a sensor's orientation is a small rotation in the world, ``R = exp([e]x) R_estimate``.
All errors are normal together, and as in a tree: given its parent's error, a sensor's does not
depend on those of others. Kept are the covariance of each, and of each with its parent: of all such
trees the nearest to what is really known. So an update costs a sensor as much however many there
are.
"""

from __future__ import annotations

from typing import no_type_check

import numpy as np

from handstudio.fusion.tree_compiled import compiled
from handstudio.fusion.tree_small import inverse3, rotated, times_by_rows


@compiled
@no_type_check
def spread_of(p, c, has_parent, cov, own):
    """Sum of the variances of a relative (or, without parent, of its own) orientation."""
    total = cov[c, 0, 0] + cov[c, 1, 1] + cov[c, 2, 2]
    if has_parent:
        total += cov[p, 0, 0] + cov[p, 1, 1] + cov[p, 2, 2]
        total -= 2.0 * (own[c, 0, 0] + own[c, 1, 1] + own[c, 2, 2])
    return max(total, 0.0)


@compiled
@no_type_check
def worst_of(p, c, has_parent, cov, own):
    """Of the same the largest variance about one axis of the world."""
    worst = 0.0
    for i in range(3):
        v = cov[c, i, i]
        if has_parent:
            v += cov[p, i, i] - 2.0 * own[c, i, i]
        worst = max(worst, v)
    return worst


@compiled
@no_type_check
def swept(order, parent, cov, edge, info, pull, cross, work, x):
    """One sweep towards the root and one back: new covariances, and the errors' means in x.

    ``work`` holds, by sensor: inverse covariance before (0), how it follows its parent before (1)
    and how sure of that (2), the same after (3: gain, 4: covariance given the parent).
    """
    n = len(order)
    inverse, follow, sure, gain, given = work[0], work[1], work[2], work[3], work[4]
    t = np.empty((3, 3))
    for s in range(n):
        inverse3(cov[s], inverse[s])
    for at in range(n - 1, -1, -1):
        c = order[at]
        p = parent[c]
        if p < 0:
            for i in range(3):
                for j in range(3):
                    sure[c, i, j] = inverse[c, i, j]
                    follow[c, i, j] = 0.0
                    t[i, j] = inverse[c, i, j] + info[c, i, j]
            inverse3(t, given[c])
            continue
        times_by_rows(edge[c], inverse[p], follow[c])
        for i in range(3):
            for j in range(i, 3):
                v = cov[c, i, j] - (
                    follow[c, i, 0] * edge[c, j, 0]
                    + follow[c, i, 1] * edge[c, j, 1]
                    + follow[c, i, 2] * edge[c, j, 2]
                )
                t[i, j] = t[j, i] = v
        if not is_positive(t):  # rounding, or a model that is wrong: better to know less
            edge[c], follow[c] = 0.0, 0.0
            t[:] = cov[c]
        inverse3(t, sure[c])
        # message to the parent
        for i in range(3):
            for j in range(3):
                t[i, j] = sure[c, i, j] + info[c, i, j]
        inverse3(t, given[c])
        for i in range(3):
            for j in range(3):  # t: -(sure follow), the coupling before
                t[i, j] = -(
                    sure[c, i, 0] * follow[c, 0, j]
                    + sure[c, i, 1] * follow[c, 1, j]
                    + sure[c, i, 2] * follow[c, 2, j]
                )
        for i in range(3):
            for j in range(3):
                before = -(
                    follow[c, 0, i] * t[0, j]
                    + follow[c, 1, i] * t[1, j]
                    + follow[c, 2, i] * t[2, j]
                )
                info[p, i, j] += before
        for i in range(3):
            for j in range(3):
                t[i, j] += cross[c, i, j]
        for i in range(3):
            for j in range(3):
                gain[c, i, j] = -(
                    given[c, i, 0] * t[0, j] + given[c, i, 1] * t[1, j] + given[c, i, 2] * t[2, j]
                )
        for i in range(3):
            pull[p, i] += (
                gain[c, 0, i] * pull[c, 0] + gain[c, 1, i] * pull[c, 1] + gain[c, 2, i] * pull[c, 2]
            )
            for j in range(3):
                info[p, i, j] += (
                    t[0, i] * gain[c, 0, j] + t[1, i] * gain[c, 1, j] + t[2, i] * gain[c, 2, j]
                )
    for at in range(n):
        c = order[at]
        p = parent[c]
        rotated(given[c], pull[c], x[c])
        if p < 0:
            cov[c] = given[c]
            continue
        for i in range(3):
            x[c, i] += gain[c, i, 0] * x[p, 0] + gain[c, i, 1] * x[p, 1] + gain[c, i, 2] * x[p, 2]
        times_by_rows(gain[c], cov[p], edge[c])
        for i in range(3):
            for j in range(i, 3):
                v = given[c, i, j] + (
                    edge[c, i, 0] * gain[c, j, 0]
                    + edge[c, i, 1] * gain[c, j, 1]
                    + edge[c, i, 2] * gain[c, j, 2]
                )
                cov[c, i, j] = cov[c, j, i] = v


@compiled
@no_type_check
def is_positive(a):
    """Whether a symmetric 3 x 3 is a covariance."""
    two = a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1]
    c02 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    c12 = a[0, 1] * a[0, 2] - a[0, 0] * a[1, 2]
    return a[0, 0] > 0.0 and two > 0.0 and a[0, 2] * c02 + a[1, 2] * c12 + a[2, 2] * two > 0.0
