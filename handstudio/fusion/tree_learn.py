"""What stays: how far axes and compasses are off, and biases read at rest; compiled."""

from __future__ import annotations

from typing import no_type_check

import numpy as np

from handstudio.fusion.tree_compiled import compiled
from handstudio.fusion.tree_observe import axis_of
from handstudio.fusion.tree_small import rotated
from handstudio.fusion.tree_sweep import spread_of


@compiled
@no_type_check
def learn(beliefs, m, st, w, x, period):
    """What stays off: each is one number's Kalman filter, beside the orientations.

    What is known of an orientation without it counts as one piece of knowledge for ``long_s``: the
    errors of both go together, which these filters do not know.
    """
    for s in range(len(m.order)):
        slow = st.slow[s]
        if slow[3] > 0.0:  # the compass was heeded
            slow[2] += beliefs.mag_walk**2 * period
            noise = slow[3] + st.cov[s, 2, 2] * beliefs.long_s / period
            gain = slow[2] / (slow[2] + noise)
            slow[1] += gain * (slow[4] + x[s, 2])
            slow[2] *= 1.0 - gain
            slow[3] = 0.0
        if m.parent[s] >= 0 and m.axes[s] <= 2:
            _axes_off(beliefs, m, st, s, w, period)


@compiled
@no_type_check
def _axes_off(beliefs, m, st, s, w, period):
    """How far a joint's axes are off in the sensor beyond it, as its neighbour sees them."""
    p, slow = m.parent[s], st.slow[s]
    slow[0] += beliefs.axis_walk**2 * period
    relative = spread_of(p, s, True, st.cov, st.edge) / 3.0
    noise = (beliefs.axis_noise**2 * beliefs.axis_lasts_s + relative * beliefs.long_s) / period
    gain = slow[0] / (slow[0] + noise)
    slow[0] *= 1.0 - gain
    a, b = w.vx, w.vy
    rotated(w.rot[p], m.xp[s], a)
    axis_of(w.rot[s], m.xc[s] if m.axes[s] == 1 else m.zc[s], st.turn[s], b)
    t0, t1, t2 = b[1] * a[2] - b[2] * a[1], b[2] * a[0] - b[0] * a[2], b[0] * a[1] - b[1] * a[0]
    if m.axes[s] == 2:  # not one direction but square to one another
        gain *= -(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
    for i in range(3):
        back = w.rot[s, 0, i] * t0 + w.rot[s, 1, i] * t1 + w.rot[s, 2, i] * t2
        st.turn[s, i] += gain * back


@compiled
@no_type_check
def rested(beliefs, s, st, period):
    """A sensor that has been still for long tells the bias of its gyroscope."""
    past, bias, cov, own = st.past[s], st.bias[s], st.bias_cov[s], st.bias_own[s]
    share = min(1.0, period / _SMOOTH_S)
    rough = fast = 0.0
    # what turns as slowly as biases are known is at rest; a slow hand is not
    known = _SURE * np.sqrt((cov[0, 0] + cov[1, 1] + cov[2, 2]) / 3.0) + _LEAST_RATE
    for i in range(3):
        rough = max(rough, abs(st.gyr1[s, i] - past[5 + i]))
        past[5 + i] += share * (st.gyr1[s, i] - past[5 + i])
        fast = max(fast, abs(past[5 + i] - bias[i]))
    if rough > beliefs.rest_rate or fast > min(known, beliefs.rest_rate):
        past[4] = 0.0
        return
    past[4] += period
    if past[4] < beliefs.rest_s:
        return
    noise = beliefs.rest_noise**2 / period
    b, x = np.empty(3), np.empty(3)
    for i in range(3):  # axis by axis
        total = cov[i, i] + noise
        off = (st.gyr1[s, i] - bias[i]) / total
        b[:], x[:] = cov[:, i], own[i]
        for u in range(3):
            bias[u] += b[u] * off
            for v in range(3):
                cov[u, v] -= b[u] * b[v] / total
                own[u, v] -= b[u] * x[v] / total


_SURE = 3.0
_LEAST_RATE = float(np.deg2rad(0.1))
_SMOOTH_S = 0.5  # over which a rate at rest is averaged
