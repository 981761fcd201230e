"""Errors of accelerometers and gyroscopes that lay still together in many directions.

After D. Tedaldi, A. Pretto, E. Menegatti, "A robust and easy to implement method for IMU
calibration without external equipments", ICRA 2014: at rest the specific force is as long as
gravity whatever the direction, and between two rests the gyroscope must turn the one into the
other. Theirs is for one sensor. Here all sensors of a board are found at once: while they are
rigid to one another they turn alike in the world, about the vertical too, of which gravity tells
nothing. What is not rigid (a forearm's skin, a board that slips) loses that tie and keeps its own.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.board_solver import Given, solved
from handstudio.calibration.board_state import (
    ACC_SD,
    BOARD_SD,
    OWN,
    SYMMETRIC,
    TURN_SD,
    State,
    at_rest,
    turned_along,
    usable,
)
from handstudio.calibration.still import Poses, Turns
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

_ALONE, _TOGETHER = 10, 10  # iterations at most


@dataclass(frozen=True, slots=True, eq=False)
class Inertial:
    """Errors of all sensors; see `device.SensorErrors` for what the matrices mean.

    Attributes:
        acc_residual: RMS of the length of gravity over the poses [m/s²].
        gyr_residual: RMS angle between gravity turned and gravity felt, over the turns [rad].
        acc_scale_sd, acc_bias_sd, gyr_scale_sd, gyr_bias_sd: Standard deviations.
        q_world_sensor: At every pose. The heading is free, but alike for rigid sensors.
        turned: Attitude at every instant of the turns against the beginning of each.
        rigid: How far every sensor turned with the board, 0 to 1, in every turn.
        board_sd: How stiff the board is found to be [rad].
    """

    acc_matrix: Float[Array, "s 3 3"]
    acc_bias: Float[Array, "s 3"]
    gyr_matrix: Float[Array, "s 3 3"]
    gyr_bias: Float[Array, "s 3"]
    gyr_per_acc: Float[Array, "s 3 3"]
    acc_residual: Float[Array, " s"]
    gyr_residual: Float[Array, " s"]
    acc_scale_sd: Float[Array, "s 3"]
    acc_bias_sd: Float[Array, "s 3"]
    gyr_scale_sd: Float[Array, "s 3"]
    gyr_bias_sd: Float[Array, "s 3"]
    q_world_sensor: Float[Array, "s k 4"] = field(repr=False)
    turned: Float[Array, "s t l 4"] = field(repr=False)
    rigid: Float[Array, "s t"]
    board_sd: float


def inertial(
    poses: Poses,
    turns: Turns,
    *,
    gravity: float = STANDARD_GRAVITY,
    scale_sd: float = 0.03,
    together: bool = True,
) -> Inertial:
    """Find the errors of all sensors.

    Args:
        poses: At least nine directions of every sensor are wanted for what is found to be good.
        turns: Between these poses, one less.
        gravity: Where it was recorded [m/s²].
        scale_sd: How far scales are off as shipped; axes are taken to be half as far from square.
        together: Use that the board is stiff; otherwise every sensor is for itself.
    """
    given = Given(gravity, scale_sd)
    state = _begin(poses, turns, gravity)
    state, sds = solved(state, poses, turns, given, _ALONE, board=False)
    if together and len(poses.acc) > 2:
        state = _in_one_heading(state)
        state, sds = solved(state, poses, turns, given, _TOGETHER, board=True)
    return _told(state, sds, poses, turns, gravity)


def _begin(poses: Poses, turns: Turns, gravity: float) -> State:
    s, k = poses.usable.shape
    own = np.zeros((s, OWN))
    own[:, :9] = _lengths(poses, gravity)
    own[:, [9, 13, 17]] = 1.0
    board = np.tile(so3.IDENTITY, (len(turns.time_s), 1))
    state = State(
        own, np.tile(so3.IDENTITY, (s, k, 1)), at_rest(poses, poses.acc), board,
        np.zeros((s, len(board))), TURN_SD, BOARD_SD,
    )  # fmt: skip
    state = replace(state, gyr_rests=at_rest(poses, state.corrected(poses.acc)))
    return replace(state, q=_chained(state, poses, turns))


def _lengths(poses: Poses, gravity: float) -> Array:
    """Accelerometers by ``|M a - c| = g`` alone, (s, 9): where the whole search begins."""
    s = len(poses.acc)
    own = np.tile([1.0, 1.0, 1.0, *[0.0] * 6], (s, 1))
    prior = np.array([0.1, 0.1, 0.1, 0.05, 0.05, 0.05, 0.5, 0.5, 0.5])
    begin = own.copy()
    weight = poses.usable / ACC_SD**2
    for _ in range(8):
        matrix = np.einsum("sn,nij->sij", own[:, :6], SYMMETRIC)
        free = np.einsum("sij,skj->ski", matrix, poses.acc) - own[:, None, 6:]
        length = np.linalg.norm(free, axis=-1)
        unit = free / np.maximum(length, 1e-9)[..., None]
        jacobian = np.concatenate(
            [np.einsum("ski,nij,skj->skn", unit, SYMMETRIC, poses.acc), -unit], axis=-1
        )
        h = np.einsum("skn,sk,skm->snm", jacobian, weight, jacobian) + np.diag(prior**-2.0)
        g = np.einsum("skn,sk->sn", jacobian, weight * (length - gravity))
        own = own - np.linalg.solve(h, (g + (own - begin) / prior**2)[..., None])[..., 0]
    return own


def _chained(state: State, poses: Poses, turns: Turns) -> Array:
    """Attitudes at the poses: gravity tells the tilt, the gyroscope carries the heading on."""
    up = state.corrected(poses.acc)
    q = [attitude(up[:, 0])]
    turned = turned_along(state, turns)[0][:, :, -1]
    for i in range(turned.shape[1]):
        q.append(_level(so3.multiply(q[-1], turned[:, i]), up[:, i + 1]))
    return np.stack(q, axis=1)


def _level(q: Array, up: Array) -> Array:
    """Tilt an attitude, by the shortest way, so that what is felt points up."""
    felt = so3.rotate(q, up)
    felt = felt / np.linalg.norm(felt, axis=-1, keepdims=True)
    # half way between felt and up, as a quaternion
    half = np.stack(
        [1.0 + felt[..., 2], felt[..., 1], -felt[..., 0], np.zeros_like(felt[..., 0])], axis=-1
    )
    half[..., 0] = np.maximum(half[..., 0], 1e-9)
    return so3.multiply(so3.normalize(half), q)


def _in_one_heading(state: State) -> State:
    """Turn every sensor's world about the vertical until its turns are those of the others."""
    turn = so3.log(so3.multiply(state.q[:, 1:], so3.conjugate(state.q[:, :-1])))
    level = turn[..., 0] + 1j * turn[..., 1]
    off = np.angle(np.sum(level.conj() * level[:1], axis=1))
    q = so3.multiply(so3.about_z(off)[:, None], state.q)
    turn = so3.rotate(so3.about_z(off)[:, None], turn)
    return replace(state, q=q, board=so3.exp(np.median(turn, axis=0)))


def _told(state: State, sds: Array, poses: Poses, turns: Turns, gravity: float) -> Inertial:
    up = state.corrected(poses.acc)
    turned = turned_along(state, turns)[0]
    both = usable(poses, turns)
    carried = so3.rotate(so3.conjugate(turned[:, :, -1]), up[:, :-1])
    angle = np.arctan2(
        np.linalg.norm(np.cross(carried, up[:, 1:]), axis=-1),
        np.sum(carried * up[:, 1:], axis=-1),
    )
    rests = state.gyr_rests
    return Inertial(
        acc_matrix=state.acc_matrix,
        acc_bias=np.linalg.solve(state.acc_matrix, state.own[:, 6:9, None])[..., 0],
        gyr_matrix=state.gyr_matrix,
        gyr_bias=rests.bias,
        gyr_per_acc=rests.per_acc,
        acc_residual=_rms(np.linalg.norm(up, axis=-1) - gravity, poses.usable),
        gyr_residual=_rms(angle, both),
        acc_scale_sd=sds[:, :3],
        acc_bias_sd=sds[:, 6:9],
        gyr_scale_sd=sds[:, [9, 13, 17]],
        gyr_bias_sd=rests.bias_sd,
        q_world_sensor=state.q,
        turned=turned,
        rigid=state.rigid,
        board_sd=state.board_sd,
    )


def _rms(values: Array, usable: Array) -> Array:
    count = np.maximum(usable.sum(axis=1), 1)
    return np.asarray(np.sqrt(np.sum(np.where(usable, values, 0.0) ** 2, axis=1) / count))
