"""Sensors of a board: their errors and attitudes while they are solved for, and what follows.

The gyroscope's bias, how it drifts, and what it takes from gravity are read at the rests.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.still import Poses, Turns
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

GYR_PER_ACC_SD = np.deg2rad(0.2) / STANDARD_GRAVITY  # twice the sd of the sensor's kind
_DRIFT_SD = np.deg2rad(0.1) / 60.0  # of the gyroscope's bias, warming up [rad/s²]
ACC_SD = 0.004  # of a pose's mean: noise of 2 s, and what the bias wanders meanwhile [m/s²]
TURN_SD = np.deg2rad(0.02)  # the least: noise of the gyroscope over some seconds
BOARD_SD = np.deg2rad(0.02)  # the least: boards are taken to be no stiffer
SYMMETRIC = np.zeros((6, 3, 3))
for _n, (_i, _j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]):
    SYMMETRIC[_n, _i, _j] = SYMMETRIC[_n, _j, _i] = 1.0
OWN = 18  # six of M_a, three of M_a b_a, nine of M_g


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """What is known of all sensors, and how far it is trusted."""

    own: Array  # (s, OWN): of M_a, M_a b_a and M_g
    q: Array  # (s, k, 4), world from sensor
    gyr_rests: Rests
    board: Array  # (t, 4), turns of the board in the world
    rigid: Array  # (s, t), weights
    turn_sd: float
    board_sd: float

    @property
    def acc_matrix(self) -> Array:
        """``M_a``, (s, 3, 3)."""
        return np.asarray(np.einsum("sn,nij->sij", self.own[:, :6], SYMMETRIC))

    @property
    def gyr_matrix(self) -> Array:
        """``M_g``, (s, 3, 3)."""
        return self.own[:, 9:18].reshape(-1, 3, 3)

    def corrected(self, acc: Array) -> Array:
        """Accelerometer readings (s, ..., 3), corrected."""
        c = self.own[:, 6:9].reshape(-1, *[1] * (acc.ndim - 2), 3)
        return np.asarray(np.einsum("sij,s...j->s...i", self.acc_matrix, acc) - c)


@dataclass(frozen=True, slots=True, eq=False)
class Rests:
    """Gyroscope at rest: ``bias + per_acc acc + drift (t - middle)``."""

    bias: Array
    per_acc: Array
    drift: Array
    middle_s: float
    bias_sd: Array


def at_rest(poses: Poses, acc: Array) -> Rests:
    """What gyroscopes read at rest, by least squares over the poses."""
    middle = float(poses.time_s.mean())
    s, k = poses.usable.shape
    ones, time = np.ones((s, k, 1)), np.broadcast_to((poses.time_s - middle)[:, None], (s, k, 1))
    design = np.concatenate([ones, acc, time], axis=-1)
    sd = np.deg2rad(0.0066) / np.sqrt(np.maximum(poses.seconds, 0.1))
    weight = poses.usable / sd**2
    prior = np.array([1.0, *[GYR_PER_ACC_SD] * 3, _DRIFT_SD])
    h = np.einsum("skn,sk,skm->snm", design, weight, design) + np.diag(prior**-2.0)
    inverse = np.linalg.inv(h)
    found = inverse @ np.einsum("skn,sk,ski->sni", design, weight, poses.gyr)
    bias_sd = np.repeat(np.sqrt(inverse[:, 0, 0])[:, None], 3, axis=1)
    per_acc = found[:, 1:4].transpose(0, 2, 1)
    return Rests(found[:, 0], per_acc, found[:, 4], middle, bias_sd)


def turned_along(state: State, turns: Turns) -> tuple[Array, Array]:
    """Attitude along every turn against its beginning, and the rates without bias."""
    rests = state.gyr_rests
    drift = rests.drift[:, None, None] * (turns.time_s - rests.middle_s)[..., None]
    felt = np.einsum("sij,stlj->stli", rests.per_acc, state.corrected(turns.acc))
    rate = turns.gyr - rests.bias[:, None, None] - felt - drift
    omega = np.einsum("sij,stlj->stli", state.gyr_matrix, rate)
    dt = np.diff(turns.time_s, axis=1)[..., None]
    before, after = omega[:, :, :-1], omega[:, :, 1:]
    # exact for rates that run straight between samples, to fourth order (coning and all)
    step = so3.exp(0.5 * dt * (before + after) + dt**2 / 12.0 * np.cross(before, after))
    q = np.empty((*omega.shape[:3], 4))
    q[:, :, 0] = so3.IDENTITY
    for i in range(step.shape[2]):
        q[:, :, i + 1] = so3.multiply(q[:, :, i], step[:, :, i])
    return q, rate


def usable(poses: Poses, turns: Turns) -> Array:
    """Turns between two poses, all three of which can be used, (s, t)."""
    return np.asarray(turns.usable & poses.usable[:, 1:] & poses.usable[:, :-1])
