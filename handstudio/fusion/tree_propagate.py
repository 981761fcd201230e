"""One step of the gyroscopes, and where a sensor begins; compiled."""

from __future__ import annotations

from typing import no_type_check

import numpy as np

from handstudio.fusion.tree_compiled import compiled
from handstudio.fusion.tree_parts import FRESH, HEEDED, ODD, SATURATED, TINY
from handstudio.fusion.tree_small import (
    inverse3,
    matrix,
    rotated,
    times_by_rows,
    turned_after,
    turned_before,
)

_SATURATED_RATE = 5.0  # [rad/s] that a rate at its limit may be short of
_CARRIED = 0.5  # [rad²/s]: how a segment goes away from its parent's motion
_SHARE_LASTS_S = 0.25  # a movement one way, in which a scale errs alike
_MOST_JUMP = 0.2  # [rad] of doubt about one step


@compiled
@no_type_check
def began(beliefs, m, s, st, acc, mag, flag):
    """Attitude of a first reading: accelerometer for gravity, the compass for the heading."""
    size = np.sqrt(acc[0] * acc[0] + acc[1] * acc[1] + acc[2] * acc[2])
    if size < 1e-3:  # falls
        return
    q = st.q[s]
    ux, uy, uz = acc[0] / size, acc[1] / size, acc[2] / size  # up, in the sensor
    if uz > -0.999:
        half = np.sqrt(0.5 * (1.0 + uz))
        q[0], q[1], q[2], q[3] = half, uy / (2.0 * half), -ux / (2.0 * half), 0.0
    else:
        q[0], q[1], q[2], q[3] = 0.0, 1.0, 0.0, 0.0
    turn = m.heading[s]
    known = flag & FRESH
    if known:
        rot, v = np.empty((3, 3)), np.empty(3)
        matrix(q, rot)
        rotated(rot, mag, v)
        turn -= np.arctan2(v[1], v[0])
    turned_before(q, 0.0, 0.0, turn)
    st.cov[s] = 0.0
    st.cov[s, 0, 0] = st.cov[s, 1, 1] = beliefs.unknown_tilt**2
    st.cov[s, 2, 2] = beliefs.unknown_heading**2 * (1.0 if known else 25.0)
    st.bias_own[s] = 0.0
    apart(m, st, s)
    st.root[s] = 0.0
    st.past[s, 8] = 1.0


@compiled
@no_type_check
def apart(m, st, s):
    """A sensor whose orientation was set anew errs with none of its neighbours."""
    st.edge[s] = 0.0
    for c in range(len(m.order)):
        if m.parent[c] == s:
            st.edge[c] = 0.0


@compiled
@no_type_check
def propagate(beliefs, m, st, dt, gyr, flags, w, begins, added):
    """One step of the gyroscopes; the variance that it adds goes to added [rad²]."""
    for s in m.order:
        matrix(st.q[s], w.rot[s])
        if begins[s]:
            w.there[s] = 0.0
            added[s] = 0.0
        elif flags[s] & HEEDED:
            added[s] = _turned(beliefs, m, s, st, dt, gyr[s], flags[s], w)
        else:  # carried along by its parent
            p = m.parent[s]
            for i in range(3):
                w.there[s, i] = w.there[p, i] if p >= 0 else 0.0
            turned_before(st.q[s], w.there[s, 0], w.there[s, 1], w.there[s, 2])
            added[s] = _CARRIED * dt
    _spread(beliefs, m, st, dt, w, added)


@compiled
@no_type_check
def _turned(beliefs, m, s, st, dt, gyr, flag, w):
    """Turn a sensor by the mean rate of the step; the variance of that."""
    turn = w.here[s]
    fast = jump = 0.0
    follows = st.past[s, 0] >= 1.0
    for i in range(3):
        between = follows and not m.mean_rates
        mean = 0.5 * (gyr[i] + st.gyr1[s, i]) if between else gyr[i]
        jump = max(jump, abs(gyr[i] - st.gyr1[s, i]) if follows else 0.0)
        turn[i] = (mean - st.bias[s, i]) * dt
        fast += (mean - st.bias[s, i]) ** 2
    share = m.gyr_share**2 * _SHARE_LASTS_S * fast
    variance = (beliefs.gyr_noise**2 + share) * dt
    if jump > beliefs.jump * dt:
        # no hand turns like that: go on as before, and believe neither much
        for i in range(3):
            turn[i] = (st.gyr1[s, i] - st.bias[s, i]) * dt
        variance += min(jump * dt, _MOST_JUMP) ** 2
        st.past[s, 0] = ODD
    if (flag | int(st.past[s, 1])) & SATURATED:
        variance += (_SATURATED_RATE * dt) ** 2
    rotated(w.rot[s], turn, w.there[s])
    turned_after(st.q[s], turn[0], turn[1], turn[2])
    return variance


@compiled
@no_type_check
def _spread(beliefs, m, st, dt, w, added):
    """Covariances after the step: an error becomes ``x - dt R b``, b the error of the bias."""
    gain, drift, t, u = w.info, w.cross, np.empty((3, 3)), np.empty((3, 3))
    n = len(m.order)
    for s in range(n):
        inverse3(st.cov[s], t)
        times_by_rows(st.bias_own[s], t, gain[s])
        times_by_rows(w.rot[s], gain[s], drift[s])  # R times how the bias goes with the error
    for s in range(n):
        p = m.parent[s]
        if p >= 0:
            times_by_rows(drift[s], st.edge[s], t)
            for i in range(3):
                for j in range(3):
                    u[i, j] = (
                        st.edge[s, i, 0] * drift[p, j, 0]
                        + st.edge[s, i, 1] * drift[p, j, 1]
                        + st.edge[s, i, 2] * drift[p, j, 2]
                    )
            for i in range(3):
                for j in range(3):
                    st.edge[s, i, j] -= dt * (t[i, j] + u[i, j])
    for s in range(n):
        rot, bias_cov = w.rot[s], st.bias_cov[s]
        times_by_rows(rot, st.bias_own[s], t)
        times_by_rows(rot, bias_cov, u)
        for i in range(3):
            for j in range(i, 3):
                v = st.cov[s, i, j] - dt * (t[i, j] + t[j, i])
                for k in range(3):
                    v += dt * dt * u[i, k] * rot[j, k]
                st.cov[s, i, j] = st.cov[s, j, i] = v
            st.cov[s, i, i] += added[s] + TINY
        for i in range(3):
            for j in range(3):
                st.bias_own[s, j, i] -= dt * u[i, j]
            st.bias_cov[s, i, i] += beliefs.bias_walk**2 * dt
