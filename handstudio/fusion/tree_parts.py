"""What the compiled parts of the tree filter have in common: constants, and arrays by name."""

from __future__ import annotations

from typing import NamedTuple

from handstudio.arrays import Array

HEEDED, FRESH, SATURATED = 1, 2, 4
"""Bits of a sample's flags."""

PLACED = 2.0
"""In place of 1 for a sensor that has begun: it was placed, and those beyond do not know yet."""

ODD = -1.0
"""In place of a count of instants: the newest reading was no hand's, and is forgotten."""

GRAVITY = 9.80665
TINY = 1e-18


class Joints(NamedTuple):
    """`Mechanism`, as the kernels see it: axes are unit vectors in the sensors."""

    order: Array
    parent: Array
    axes: Array
    tp: Array  # from the parent sensor to the joint
    tc: Array  # from the sensor to the joint
    xp: Array  # flexion axis in the parent sensor
    yp: Array  # along the bone there
    zp: Array  # and dorsal
    xc: Array  # and in the sensor
    yc: Array
    zc: Array  # the second axis, in the sensor
    axis_sd: Array
    lever_sd: Array
    heading: Array
    ends: Array  # of both turns: cosine and sine of the middle, cosine of half the range
    gyr_share: float
    mean_rates: bool


class Memory(NamedTuple):
    """`TreeState`, as the kernels see and change it."""

    q: Array
    cov: Array
    edge: Array
    bias: Array
    bias_cov: Array
    bias_own: Array
    gyr1: Array
    gyr2: Array
    acc1: Array
    mag1: Array
    past: Array
    scalar: Array
    turn: Array
    slow: Array
    root: Array


class Work(NamedTuple):
    """Arrays that are written anew at every step."""

    rot: Array  # rotation matrices
    force: Array  # specific force at the joint before each sensor, in the world
    info: Array  # what an instant tells of each sensor: information ...
    pull: Array  # ... and its product with the mean
    cross: Array  # and along the edges, rows are the child's
    here: Array  # rates
    there: Array  # their derivatives
    vx: Array
    vy: Array
    quat: Array


class Beliefs(NamedTuple):
    """The numbers of `TreeFilter`, by their names there."""

    gyr_noise: float
    acc_noise: float
    acc_share: float
    joint_lasts_s: float
    root_noise: float
    root_share: float
    root_lasts_s: float
    axis_lasts_s: float
    mag_noise: float
    mag_lasts_s: float
    bias_walk: float
    rest_rate: float
    rest_s: float
    rest_noise: float
    jump: float
    gate: float
    axis_noise: float
    axis_walk: float
    mag_off: float
    mag_walk: float
    long_s: float
    unknown_tilt: float
    unknown_heading: float
