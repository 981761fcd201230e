"""The tree filter's loop over instants, compiled by numba: SI units, arrays by sensor."""

from __future__ import annotations

from typing import no_type_check

import numpy as np

from handstudio.fusion import (
    tree_learn,
    tree_observe,
    tree_propagate,
    tree_small,
    tree_sweep,
)
from handstudio.fusion.tree_compiled import compiled, kept, stamp
from handstudio.fusion.tree_learn import learn, rested
from handstudio.fusion.tree_observe import observe
from handstudio.fusion.tree_parts import HEEDED, ODD, PLACED, Work
from handstudio.fusion.tree_propagate import apart, began, propagate
from handstudio.fusion.tree_small import inverse3, matrix, times_by_rows, turned_before
from handstudio.fusion.tree_sweep import swept, worst_of


@compiled
@no_type_check
def _correct(beliefs, m, st, gyr, flags, dt, w, sweep, x):
    """Correct the instant before by its own readings; the new rates tell how its rates changed."""
    observe(beliefs, m, st, dt, gyr, flags, w)
    n = len(m.order)
    gain, t = w.rot, np.empty((3, 3))
    for s in range(n):  # how biases go with errors: the sweep does not change that
        inverse3(st.cov[s], t)
        times_by_rows(st.bias_own[s], t, gain[s])
    swept(m.order, m.parent, st.cov, st.edge, w.info, w.pull, w.cross, sweep, x)
    for s in range(n):
        turned_before(st.q[s], x[s, 0], x[s, 1], x[s, 2])
        _turn_mean(st.root[s], x[s], 0)
        _turn_mean(st.root[s], x[s], 3)
        times_by_rows(gain[s], st.cov[s], t)
        for i in range(3):
            for j in range(3):
                st.bias[s, i] += gain[s, i, j] * x[s, j]
                for u in range(3):
                    st.bias_cov[s, i, j] += (t[i, u] - st.bias_own[s, i, u]) * gain[s, j, u]
        st.bias_own[s] = t
    for s in range(n):
        matrix(st.q[s], w.rot[s])
    period = st.scalar[0] if st.scalar[0] > 0.0 else dt
    learn(beliefs, m, st, w, x, period)
    for s in range(n):
        if int(st.past[s, 1]) & HEEDED:
            rested(beliefs, s, st, period)


@compiled
@no_type_check
def _turn_mean(mean, x, at):
    """What was averaged was seen in the orientation that is corrected now."""
    a, b, c = mean[at], mean[at + 1], mean[at + 2]
    mean[at] += x[1] * c - x[2] * b
    mean[at + 1] += x[2] * a - x[0] * c
    mean[at + 2] += x[0] * b - x[1] * a


@compiled
@no_type_check
def _remember(st, gyr, acc, mag, flags):
    for s in range(len(flags)):
        if st.past[s, 0] == ODD:
            st.past[s, 0] = st.past[s, 1] = 0.0
            continue
        if flags[s] & HEEDED:
            before = int(st.past[s, 1]) & HEEDED
            st.past[s, 0] = min(st.past[s, 0] + 1.0, 2.0) if before else 1.0
            st.gyr2[s] = st.gyr1[s]
            st.gyr1[s] = gyr[s]
            st.acc1[s] = acc[s]
            st.mag1[s] = mag[s]
        else:
            st.past[s, 0] = 0.0
        st.past[s, 1] = flags[s]


@no_type_check
def _compiled(known_by):
    """The loop. It alone is kept on disk, under the stamp: it is never older than its source."""

    @kept
    @no_type_check
    def run(beliefs, m, st, gyr, acc, mag, flags, dt, out, sd, tape):
        """Fuse consecutive instants; the memory ``st`` is changed in place.

        Args:
            beliefs: What is believed of sensors and people.
            m: Joints.
            st: Memory.
            gyr, acc, mag: Readings (n, s, 3).
            flags: Bits of `tree_parts` (n, s).
            dt: Length of the step to each instant [s].
            out: Orientations (n, s, 4) go here.
            sd: And how sure they are (n, s, 2).
            tape: What a smoother needs, where there is room for it.
        """
        assert known_by != 0
        after, sure, follow, spreads = tape
        n, taped = len(m.order), len(after) > 0
        w = Work(
            np.zeros((n, 3, 3)),
            np.zeros((n, 3)),
            np.zeros((n, 3, 3)),
            np.zeros((n, 3)),
            np.zeros((n, 3, 3)),
            np.zeros((n, 3)),
            np.zeros((n, 3)),
            np.zeros(3),
            np.zeros(3),
            np.zeros(4),
        )
        sweep, x = np.zeros((5, n, 3, 3)), np.zeros((n, 3))
        begins, added = np.zeros(n, dtype=np.bool_), np.zeros(n)
        for s in range(n):
            if st.past[s, 8] == PLACED:
                apart(m, st, s)
                st.past[s, 8] = 1.0
        for k in range(len(gyr)):
            if st.scalar[1] > 0.0:
                _correct(beliefs, m, st, gyr[k], flags[k], dt[k], w, sweep, x)
            if taped:
                after[k] = st.q
                sure[k] = sweep[2]
                follow[k] = sweep[1]
            for s in range(n):
                begins[s] = st.past[s, 8] == 0.0 and flags[k, s] & HEEDED
            propagate(beliefs, m, st, dt[k], gyr[k], flags[k], w, begins, added)
            for s in range(n):
                if begins[s]:
                    began(beliefs, m, s, st, acc[k, s], mag[k, s], flags[k, s])
            _remember(st, gyr[k], acc[k], mag[k], flags[k])
            for s in range(n):
                out[k, s] = st.q[s]
                p = m.parent[s]
                sd[k, s, 0] = np.sqrt(worst_of(p, s, False, st.cov, st.edge))
                sd[k, s, 1] = np.sqrt(worst_of(p, s, p >= 0, st.cov, st.edge))
            st.scalar[0], st.scalar[1] = dt[k], 1.0
            if taped:
                spreads[k] = added

    return run


_PARTS = (tree_small, tree_sweep, tree_observe, tree_learn, tree_propagate)

run = _compiled(stamp(*map(vars, _PARTS), globals()))
