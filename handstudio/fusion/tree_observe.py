"""What one instant tells of the orientations: accelerations, axes, compasses; compiled."""

from __future__ import annotations

from typing import no_type_check

import numpy as np

from handstudio.fusion.tree_compiled import compiled
from handstudio.fusion.tree_parts import FRESH, GRAVITY, HEEDED, SATURATED
from handstudio.fusion.tree_small import (
    at_joint,
    cross_to,
    matrix,
    rotated,
    square_to,
    turned_after,
)
from handstudio.fusion.tree_sweep import spread_of


@compiled
@no_type_check
def joint_to(fp, fc, weight, p, c, info, pull, cross):
    """Both sides see one vector: ``exp(xp) fp = exp(xc) fc`` but for noise, weighed."""
    square_to(fp, weight, info[p])
    square_to(fc, weight, info[c])
    d = weight * (fp[0] * fc[0] + fp[1] * fc[1] + fp[2] * fc[2])
    for i in range(3):
        cross[c, i, i] -= d
        for j in range(3):  # [fp]x [fc]x transposed: rows are the child's
            cross[c, i, j] += weight * fp[i] * fc[j]
    e0, e1, e2 = fp[0] - fc[0], fp[1] - fc[1], fp[2] - fc[2]
    pull[p, 0] -= weight * (fp[1] * e2 - fp[2] * e1)
    pull[p, 1] -= weight * (fp[2] * e0 - fp[0] * e2)
    pull[p, 2] -= weight * (fp[0] * e1 - fp[1] * e0)
    pull[c, 0] += weight * (fc[1] * e2 - fc[2] * e1)
    pull[c, 1] += weight * (fc[2] * e0 - fc[0] * e2)
    pull[c, 2] += weight * (fc[0] * e1 - fc[1] * e0)


@compiled
@no_type_check
def turn_to(axis, angle, weight, p, c, info, pull, cross):
    """The child is to turn so far against its parent, about an axis of the world, weighed."""
    for i in range(3):
        pull[p, i] -= weight * axis[i] * angle
        pull[c, i] += weight * axis[i] * angle
        for j in range(3):
            v = weight * axis[i] * axis[j]
            info[p, i, j] += v
            info[c, i, j] += v
            cross[c, i, j] -= v


@compiled
@no_type_check
def observe(beliefs, m, st, dt, gyr, flags, w):
    """Gather what the instant before tells: information, pull, and coupling along edges."""
    w.info[:], w.pull[:], w.cross[:] = 0.0, 0.0, 0.0
    before = st.scalar[0]
    period = before if before > 0.0 else dt
    for s in range(len(m.order)):
        _rates(st, s, gyr[s], flags[s], dt, before, w)
        _seen_from(m, st, s, period, w)
        if int(st.past[s, 1]) & HEEDED:
            at_joint(st.acc1[s], w.here[s], w.there[s], m.tc[s], w.vx)
            rotated(w.rot[s], w.vx, w.force[s])
    for s in range(len(m.order)):
        flag = int(st.past[s, 1])
        usable = flag & HEEDED and not flag & SATURATED
        p = m.parent[s]
        if p < 0 and usable:
            _gravity(beliefs, m, st, s, period, w)
        if p >= 0:
            flag_p = int(st.past[p, 1])
            if usable and flag_p & HEEDED and not flag_p & SATURATED:
                _shared_force(beliefs, m, st, s, period, w)
            if m.axes[s] <= 2:
                _axes(beliefs, m, st, s, period, w)
            _ranges(beliefs, m, st, s, period, w)
        if usable and flag & FRESH:
            _compass(beliefs, m, st, s, period, w)


@compiled
@no_type_check
def _seen_from(m, st, s, period, w):
    """The attitude in which a reading was taken: means are of half a step before their instant."""
    if not m.mean_rates:
        matrix(st.q[s], w.rot[s])
        return
    w.quat[:] = st.q[s]
    half = -0.5 * period
    turned_after(w.quat, half * w.here[s, 0], half * w.here[s, 1], half * w.here[s, 2])
    matrix(w.quat, w.rot[s])


@compiled
@no_type_check
def _rates(st, s, gyr, flag, dt, before, w):
    """Rates of the instant before, and how they changed: by the newest ones, where there are."""
    follows = st.past[s, 0] >= 2.0
    for i in range(3):
        w.here[s, i] = st.gyr1[s, i] - st.bias[s, i]
        if follows and flag & HEEDED:
            w.there[s, i] = (gyr[i] - st.gyr2[s, i]) / (dt + before)
        elif follows:
            w.there[s, i] = (st.gyr1[s, i] - st.gyr2[s, i]) / before
        elif flag & HEEDED:
            w.there[s, i] = (gyr[i] - st.gyr1[s, i]) / dt
        else:
            w.there[s, i] = 0.0


@compiled
@no_type_check
def _lever_doubt(m, s, at, w):
    """Variance of an acceleration carried over a lever that is off [m²/s⁴]; rates of sensor at."""
    here, there = w.here[at], w.there[at]
    fast = here[0] ** 2 + here[1] ** 2 + here[2] ** 2
    change = there[0] ** 2 + there[1] ** 2 + there[2] ** 2
    return m.lever_sd[s] ** 2 * (change + fast * fast)


@compiled
@no_type_check
def _gravity(beliefs, m, st, s, period, w):
    """What is felt at the root, in the long run, is gravity: nothing gathers speed for ever.

    The force is averaged in the world, where gravity stays and accelerations come and go (as VQF
    does); what is left of them is what speed is gained over the average's length.
    """
    f, slow = w.force[s], st.root[s]
    slow[7] += period
    share = min(1.0, period / min(slow[7], 0.5 * beliefs.root_lasts_s))
    spread = 0.0
    for i in range(3):
        slow[i] += share * (f[i] - slow[i])
        slow[3 + i] += share * (slow[i] - slow[3 + i])
        spread += (f[i] - slow[3 + i]) ** 2
    slow[6] += share * (spread - slow[6])
    sd = beliefs.root_noise + beliefs.root_share * np.sqrt(slow[6])
    variance = sd * sd + _lever_doubt(m, s, s, w)
    weight = period / (variance * beliefs.root_lasts_s)
    w.vy[0], w.vy[1], w.vy[2] = slow[3], slow[4], slow[5]
    w.vx[0], w.vx[1], w.vx[2] = slow[3], slow[4], slow[5] - GRAVITY
    square_to(w.vy, weight, w.info[s])
    cross_to(w.vy, w.vx, -weight, w.pull[s])


@compiled
@no_type_check
def _shared_force(beliefs, m, st, s, period, w):
    """Both sensors beside a joint feel one force there (4.29)."""
    p, mine, other = m.parent[s], w.force[s], w.vy
    at_joint(st.acc1[p], w.here[p], w.there[p], m.tp[s], w.vx)
    rotated(w.rot[p], w.vx, other)
    size = np.sqrt(mine[0] ** 2 + mine[1] ** 2 + mine[2] ** 2)
    variance = beliefs.acc_noise**2 + (beliefs.acc_share * (size - GRAVITY)) ** 2
    variance += _lever_doubt(m, s, s, w) + _lever_doubt(m, s, p, w)
    off = (other[0] - mine[0]) ** 2 + (other[1] - mine[1]) ** 2 + (other[2] - mine[2]) ** 2
    expected = 3.0 * variance + size**2 * spread_of(p, s, True, st.cov, st.edge)
    weight = period / (variance * beliefs.joint_lasts_s)
    if off > beliefs.gate**2 * expected:  # a shock of skin, a blow
        weight *= beliefs.gate**2 * expected / off
    joint_to(other, mine, weight, p, s, w.info, w.pull, w.cross)


@compiled
@no_type_check
def _axes(beliefs, m, st, s, period, w):
    """A hinge has one axis in both its segments; two axes of a joint stay square."""
    p = m.parent[s]
    short = beliefs.axis_noise**2 * beliefs.axis_lasts_s
    weight = period / (short + st.slow[s, 0] * beliefs.long_s)
    a, b = w.vx, w.vy
    rotated(w.rot[p], m.xp[s], a)
    if m.axes[s] == 1:
        axis_of(w.rot[s], m.xc[s], st.turn[s], b)
        joint_to(a, b, weight, p, s, w.info, w.pull, w.cross)
        return
    axis_of(w.rot[s], m.zc[s], st.turn[s], b)
    e = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    n0, n1, n2 = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    a[0], a[1], a[2] = n0, n1, n2
    turn_to(a, e, weight, p, s, w.info, w.pull, w.cross)


@compiled
@no_type_check
def _ranges(beliefs, m, st, s, period, w):
    """A joint is nowhere it cannot be: beyond an end it is led back, within nothing is told.

    The child's bone in the joint's frame in the parent tells both turns: it is turned about x, then
    about z, and along it what is turned about y does not show.
    """
    p, bone, v = m.parent[s], w.vx, w.vy
    rotated(w.rot[s], m.yc[s], bone)
    for i in range(3):
        v[i] = w.rot[p, 0, i] * bone[0] + w.rot[p, 1, i] * bone[1] + w.rot[p, 2, i] * bone[2]
    x, y, z = m.xp[s], m.yp[s], m.zp[s]
    across = v[0] * x[0] + v[1] * x[1] + v[2] * x[2]
    along = v[0] * y[0] + v[1] * y[1] + v[2] * y[2]
    up = v[0] * z[0] + v[1] * z[1] + v[2] * z[2]
    flat = np.sqrt(along * along + up * up)
    flexion, deviation = m.ends[s, 0], m.ends[s, 1]
    if flat < _UPRIGHT:  # the two turns are not told apart
        return
    if flexion[0] * along + flexion[1] * up < flexion[2] * flat:
        rotated(w.rot[p], x, v)
        _led_back(beliefs, st, p, s, np.arctan2(up, along), flexion, v, period, w)
    if deviation[0] * flat - deviation[1] * across < deviation[2]:
        for i in range(3):  # z, turned about x as the bone is
            bone[i] = (along * z[i] - up * y[i]) / flat
        rotated(w.rot[p], bone, v)
        _led_back(beliefs, st, p, s, np.arctan2(-across, flat), deviation, v, period, w)


@compiled
@no_type_check
def _led_back(beliefs, st, p, s, turn, ends, axis, period, w):
    """A turn of a joint, about an axis of the world, is beyond one of its ends: to the nearer."""
    off = turn - np.arctan2(ends[1], ends[0])
    off -= 2.0 * np.pi * np.round(off / (2.0 * np.pi))
    beyond = abs(off) - np.arccos(ends[2])
    back = -beyond if off > 0.0 else beyond
    # ends have a margin for axes that are off for long: what is off does not count so long here
    weight = period / ((beliefs.axis_noise**2 + st.slow[s, 0]) * beliefs.axis_lasts_s)
    turn_to(axis, back, weight, p, s, w.info, w.pull, w.cross)


@compiled
@no_type_check
def axis_of(rot, axis, turn, out):
    """An axis of a joint in the world: as calibrated, turned by what it was found to be off."""
    t0 = axis[0] + turn[1] * axis[2] - turn[2] * axis[1]
    t1 = axis[1] + turn[2] * axis[0] - turn[0] * axis[2]
    t2 = axis[2] + turn[0] * axis[1] - turn[1] * axis[0]
    n = 1.0 / np.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
    for i in range(3):
        out[i] = (rot[i, 0] * t0 + rot[i, 1] * t1 + rot[i, 2] * t2) * n


@compiled
@no_type_check
def _compass(beliefs, m, st, s, period, w):
    """The field's horizontal part points along x, as far as it is the undisturbed field."""
    past, slow, v = st.past[s], st.slow[s], w.vx
    rotated(w.rot[s], st.mag1[s], v)
    across = np.sqrt(v[0] * v[0] + v[1] * v[1])
    if across < _LEAST_FIELD_UT:
        return
    size = np.sqrt(across * across + v[2] * v[2])
    dip = np.arctan2(-v[2], across)
    if past[2] == 0.0:
        past[2], past[3] = size, dip
    odd = abs(size / past[2] - 1.0) / _ODD_SHARE + abs(dip - past[3]) / _ODD_DIP
    share = min(1.0, period / _USUAL_S)
    if odd < 1.0:
        past[2] += share * (size - past[2])
        past[3] += share * (dip - past[3])
    angle = np.arctan2(v[1], v[0]) - m.heading[s] - slow[1]
    angle -= 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
    short = beliefs.mag_noise**2 * (1.0 + odd**4) * beliefs.mag_lasts_s
    weight = period / (short + slow[2] * beliefs.long_s)
    w.info[s, 2, 2] += weight
    w.pull[s, 2] -= weight * angle
    slow[3], slow[4] = short / period, angle  # for what is learnt after the sweep


_LEAST_FIELD_UT = 1.0
_UPRIGHT = 0.1
_ODD_SHARE, _ODD_DIP = 0.1, float(np.deg2rad(10.0))  # from where a field counts as disturbed
_USUAL_S = 20.0  # over which a sensor's usual field is averaged
