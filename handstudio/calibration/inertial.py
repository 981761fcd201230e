"""Errors of accelerometers and gyroscopes that lay still together in many directions.

After D. Tedaldi, A. Pretto, E. Menegatti, "A robust and easy to implement method for IMU
calibration without external equipments", ICRA 2014: at rest the specific force is as long as
gravity whatever the direction, and between two rests the gyroscope must turn the one into the
other. Theirs is for one sensor. Here all sensors of a board are found at once: while they are
rigid to one another they turn alike in the world, about the vertical too, of which gravity tells
nothing. What is not rigid (a forearm's skin, a board that slips) loses that tie and keeps its own.

What is solved for, by Gauss-Newton, per sensor: ``M_a`` (symmetric: the frame that everything is
corrected into), ``b_a``, ``M_g``, and its attitude at every rest; and the turns of the board
between them. Residuals, each over its standard deviation:

- gravity: ``M_a (acc - b_a) - R_sensor_world g``
- turn: ``log(R_turned' R_world_before' R_world_after)`` of the integrated gyroscope
- board: ``log(R_board_turn R_world_before R_world_after')``, down-weighted where it is far off
- what is shipped: scales within some percent, axes nearly square.

The gyroscope's bias, how it drifts, and what it takes from gravity are read at the rests.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.still import Poses, Turns
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

GYR_PER_ACC_SD = np.deg2rad(0.2) / STANDARD_GRAVITY  # twice the sd of the sensor's kind
_DRIFT_SD = np.deg2rad(0.1) / 60.0  # of the gyroscope's bias, warming up [rad/s²]
_ACC_SD = 0.004  # of a pose's mean: noise of 2 s, and what the bias wanders meanwhile [m/s²]
_TURN_SD = np.deg2rad(0.02)  # the least: noise of the gyroscope over some seconds
_BOARD_SD = np.deg2rad(0.02)  # the least: boards are taken to be no stiffer
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
    given = _Given(gravity, scale_sd)
    state = _begin(poses, turns, gravity)
    state, sds = _solved(state, poses, turns, given, _ALONE, board=False)
    if together and len(poses.acc) > 2:
        state = _in_one_heading(state)
        state, sds = _solved(state, poses, turns, given, _TOGETHER, board=True)
    return _told(state, sds, poses, turns, gravity)


_SYMMETRIC = np.zeros((6, 3, 3))
for _n, (_i, _j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]):
    _SYMMETRIC[_n, _i, _j] = _SYMMETRIC[_n, _j, _i] = 1.0
_OWN = 18  # six of M_a, three of M_a b_a, nine of M_g
_SHIPPED = [0, 1, 2, *range(9, 18)]  # of these something is known beforehand
_PERFECT = np.concatenate([np.ones(3), np.eye(3).ravel()])
_PRIOR = len(_SHIPPED)
_DAMPING = 1e-3  # of what may be unseen
_HEADING_DAMPING = 1e3  # what is seen of an attitude has 1e7 and more
_CONVERGED = 1e-5


@dataclass(frozen=True, slots=True)
class _Given:
    gravity: float
    scale_sd: float

    @property
    def shipped_sd(self) -> Array:
        axes = np.where(np.eye(3), 1.0, 0.5).ravel()
        return self.scale_sd * np.concatenate([np.ones(3), axes])


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    own: Array  # (s, 18)
    q: Array  # (s, k, 4), world from sensor
    gyr_rests: _Rests
    board: Array  # (t, 4), turns of the board in the world
    rigid: Array  # (s, t), weights
    turn_sd: float
    board_sd: float

    @property
    def acc_matrix(self) -> Array:
        return np.asarray(np.einsum("sn,nij->sij", self.own[:, :6], _SYMMETRIC))

    @property
    def gyr_matrix(self) -> Array:
        return self.own[:, 9:18].reshape(-1, 3, 3)

    def corrected(self, acc: Array) -> Array:
        """Accelerometer readings (s, ..., 3), corrected."""
        c = self.own[:, 6:9].reshape(-1, *[1] * (acc.ndim - 2), 3)
        return np.asarray(np.einsum("sij,s...j->s...i", self.acc_matrix, acc) - c)


@dataclass(frozen=True, slots=True, eq=False)
class _Rests:
    """Gyroscope at rest: ``bias + per_acc acc + drift (t - middle)``."""

    bias: Array
    per_acc: Array
    drift: Array
    middle_s: float
    bias_sd: Array


def _begin(poses: Poses, turns: Turns, gravity: float) -> _State:
    s, k = poses.usable.shape
    own = np.zeros((s, _OWN))
    own[:, :9] = _lengths(poses, gravity)
    own[:, [9, 13, 17]] = 1.0
    board = np.tile(so3.IDENTITY, (len(turns.time_s), 1))
    state = _State(
        own, np.tile(so3.IDENTITY, (s, k, 1)), _at_rest(poses, poses.acc), board,
        np.zeros((s, len(board))), _TURN_SD, _BOARD_SD,
    )  # fmt: skip
    state = replace(state, gyr_rests=_at_rest(poses, state.corrected(poses.acc)))
    return replace(state, q=_chained(state, poses, turns))


def _lengths(poses: Poses, gravity: float) -> Array:
    """Accelerometers by ``|M a - c| = g`` alone, (s, 9): where the whole search begins."""
    s = len(poses.acc)
    own = np.tile([1.0, 1.0, 1.0, *[0.0] * 6], (s, 1))
    prior = np.array([0.1, 0.1, 0.1, 0.05, 0.05, 0.05, 0.5, 0.5, 0.5])
    begin = own.copy()
    weight = poses.usable / _ACC_SD**2
    for _ in range(8):
        matrix = np.einsum("sn,nij->sij", own[:, :6], _SYMMETRIC)
        free = np.einsum("sij,skj->ski", matrix, poses.acc) - own[:, None, 6:]
        length = np.linalg.norm(free, axis=-1)
        unit = free / np.maximum(length, 1e-9)[..., None]
        jacobian = np.concatenate(
            [np.einsum("ski,nij,skj->skn", unit, _SYMMETRIC, poses.acc), -unit], axis=-1
        )
        h = np.einsum("skn,sk,skm->snm", jacobian, weight, jacobian) + np.diag(prior**-2.0)
        g = np.einsum("skn,sk->sn", jacobian, weight * (length - gravity))
        own = own - np.linalg.solve(h, (g + (own - begin) / prior**2)[..., None])[..., 0]
    return own


def _at_rest(poses: Poses, acc: Array) -> _Rests:
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
    return _Rests(found[:, 0], per_acc, found[:, 4], middle, bias_sd)


def _chained(state: _State, poses: Poses, turns: Turns) -> Array:
    """Attitudes at the poses: gravity tells the tilt, the gyroscope carries the heading on."""
    up = state.corrected(poses.acc)
    q = [attitude(up[:, 0])]
    turned = _turned(state, turns)[0][:, :, -1]
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


def _turned(state: _State, turns: Turns) -> tuple[Array, Array]:
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


def _in_one_heading(state: _State) -> _State:
    """Turn every sensor's world about the vertical until its turns are those of the others."""
    turn = so3.log(so3.multiply(state.q[:, 1:], so3.conjugate(state.q[:, :-1])))
    level = turn[..., 0] + 1j * turn[..., 1]
    off = np.angle(np.sum(level.conj() * level[:1], axis=1))
    q = so3.multiply(so3.about_z(off)[:, None], state.q)
    turn = so3.rotate(so3.about_z(off)[:, None], turn)
    return replace(state, q=q, board=so3.exp(np.median(turn, axis=0)))


def _solved(
    state: _State, poses: Poses, turns: Turns, given: _Given, iterations: int, *, board: bool
) -> tuple[_State, Array]:
    """Gauss-Newton; standard deviations (s, 18) too."""
    sds = np.zeros_like(state.own)
    for _ in range(iterations):
        state = replace(state, gyr_rests=_at_rest(poses, state.corrected(poses.acc)))
        moved = _turned(state, turns)
        apart = _residuals(state, poses, moved[0], given)
        state = _weighed(state, poses, turns, apart, board)
        weights = _weights(state, poses, turns)
        jacobian = _jacobian(state, poses, turns, moved, given, weights=weights)
        residual = np.concatenate(
            [(w * r).reshape(len(r), -1) for w, r in zip(weights, apart[:3], strict=True)]
            + [apart[3]],
            axis=1,
        )
        step, eta, sds = _step(jacobian, residual, weights[2])
        state = _stepped(state, step, eta)
        if np.abs(step[:, :_OWN]).max() < _CONVERGED:
            break
    return state, sds


def _step(jacobian: Array, residual: Array, w_board: Array) -> tuple[Array, Array, Array]:
    """Steps of the sensors (s, n) and of the board's turns (3 t), and deviations (s, 18).

    Sensors meet in the turns of the board only, so each is solved for itself and the turns after.
    """
    by_board = np.repeat(w_board[..., 0], 3, axis=1)  # a row of the board goes with its turn alone
    rows = slice(-_PRIOR - by_board.shape[1], -_PRIOR)
    # headings are free: only the damping holds them
    damping = np.full(jacobian.shape[2], _HEADING_DAMPING)
    damping[:_OWN] = _DAMPING
    h = jacobian.swapaxes(1, 2) @ jacobian + np.diag(damping)
    cross = jacobian[:, rows].swapaxes(1, 2) * by_board[:, None]
    gradient = jacobian.swapaxes(1, 2) @ residual[..., None]
    inverse = np.linalg.inv(h)
    of_cross, of_gradient = inverse @ cross, (inverse @ gradient)[..., 0]
    left = np.diag(np.sum(by_board**2, axis=0) + _DAMPING)
    left = left - np.sum(cross.swapaxes(1, 2) @ of_cross, axis=0)
    right = np.sum(by_board * residual[:, rows], axis=0)
    right = right - np.sum(cross * of_gradient[..., None], axis=(0, 1))
    eta = -np.linalg.solve(left, right)
    variance = np.diagonal(inverse, axis1=1, axis2=2)[:, :_OWN]
    own = of_cross[:, :_OWN]
    shared = np.sum((own @ np.linalg.inv(left)) * own, axis=-1)
    return -of_gradient - of_cross @ eta, eta, np.sqrt(variance + shared)


def _stepped(state: _State, step: Array, eta: Array) -> _State:
    """Attitudes are turned on the sensor's side, turns of the board on the world's."""
    small = step[:, _OWN:].reshape(*state.q.shape[:2], 3)
    return replace(
        state,
        own=state.own + step[:, :_OWN],
        q=so3.normalize(so3.multiply(state.q, so3.exp(small))),
        board=so3.normalize(so3.multiply(so3.exp(eta.reshape(-1, 3)), state.board)),
    )


def _residuals(state: _State, poses: Poses, turned: Array, given: _Given) -> tuple[Array, ...]:
    """Gravity (s, k, 3), turn and board (s, t, 3); what is shipped (s, 12) over its deviations."""
    back = so3.conjugate(state.q)
    turn = so3.multiply(back[:, :-1], state.q[:, 1:])
    return (
        state.corrected(poses.acc) - _felt(state, given),
        so3.log(so3.multiply(so3.conjugate(turned[:, :, -1]), turn)),
        so3.log(so3.multiply(state.board, so3.multiply(state.q[:, :-1], back[:, 1:]))),
        (state.own[:, _SHIPPED] - _PERFECT) / given.shipped_sd,
    )


def _felt(state: _State, given: _Given) -> Array:
    return so3.rotate(so3.conjugate(state.q), np.array([0.0, 0.0, given.gravity]))


def _weighed(
    state: _State, poses: Poses, turns: Turns, apart: tuple[Array, ...], board: bool
) -> _State:
    """How far to trust turns and board, by what is left of them now."""
    both = _usable(poses, turns)
    # of a sensor for itself only two of three components are seen, the third is nothing
    seen = 1.0 if board else np.sqrt(1.5)
    state = replace(state, turn_sd=max(_TURN_SD, seen * _spread_of(apart[1], both)))
    if not board:
        return state
    sd = max(_BOARD_SD, _spread_of(apart[2], both))
    # far off is not of the board: the weight falls with the fourth power (Geman, McClure)
    rigid = both / (1.0 + np.sum(apart[2] ** 2, axis=-1) / (12.0 * sd**2)) ** 2
    return replace(state, board_sd=sd, rigid=rigid)


def _weights(state: _State, poses: Poses, turns: Turns) -> tuple[Array, Array, Array]:
    """Of gravity, turn and board: one over the deviation."""
    return (
        (poses.usable / _ACC_SD)[..., None],
        (_usable(poses, turns) / state.turn_sd)[..., None],
        (np.sqrt(state.rigid) / state.board_sd)[..., None],
    )


def _jacobian(
    state: _State,
    poses: Poses,
    turns: Turns,
    moved: tuple[Array, Array],
    given: _Given,
    *,
    weights: tuple[Array, Array, Array],
) -> Array:
    """Of the weighed residuals, in their order, by what is a sensor's own: (s, r, 18 + 3 k)."""
    s, k = poses.usable.shape
    t = k - 1
    jacobian = np.zeros((s, 3 * (k + 2 * t) + _PRIOR, _OWN + 3 * k))
    parts = np.split(jacobian, np.cumsum([3 * k, 3 * t, 3 * t]), axis=1)
    gravity, turn, board = (part.reshape(s, -1, 3, _OWN + 3 * k) for part in parts[:3])
    gravity[..., :6] = np.einsum("nij,skj->skin", _SYMMETRIC, poses.acc)
    gravity[..., 6:9] = -np.eye(3)
    turn[..., 9:18] = -_by_matrix(*moved, turns.time_s)
    tilted = -_cross_matrix(_felt(state, given))
    before, at = -so3.to_matrix(so3.conjugate(moved[0][:, :, -1])), so3.to_matrix(state.q)
    for i in range(k):
        columns = slice(_OWN + 3 * i, _OWN + 3 * i + 3)
        gravity[:, i, :, columns] = tilted[:, i]
        if i < t:
            turn[:, i, :, columns], board[:, i, :, columns] = before[:, i], at[:, i + 1]
        if i > 0:
            turn[:, i - 1, :, columns], board[:, i - 1, :, columns] = np.eye(3), -at[:, i]
    scaled = [
        (part * weight[..., None]).reshape(s, -1, _OWN + 3 * k)
        for part, weight in zip((gravity, turn, board), weights, strict=True)
    ]
    parts[3][:, range(_PRIOR), _SHIPPED] = 1.0 / given.shipped_sd
    return np.concatenate([*scaled, parts[3]], axis=1)


def _by_matrix(turned: Array, rate: Array, time_s: Array) -> Array:
    """How a turn goes with the gyroscope's matrix, (s, t, 3, 9), at its end."""
    dt = np.diff(time_s, axis=1)
    share = 0.5 * (np.pad(dt, ((0, 0), (1, 0))) + np.pad(dt, ((0, 0), (0, 1))))
    at = so3.to_matrix(turned)
    summed = np.einsum("stlxa,stlb,tl->stxab", at, rate, share, optimize=True)
    result = np.einsum("stxy,stxab->styab", at[:, :, -1], summed)
    return np.asarray(result.reshape(*result.shape[:3], 9))


def _usable(poses: Poses, turns: Turns) -> Array:
    """Turns between two poses, all three of which can be used, (s, t)."""
    return np.asarray(turns.usable & poses.usable[:, 1:] & poses.usable[:, :-1])


def _spread_of(residual: Array, usable: Array) -> float:
    """Standard deviation of a component, from the median length: the few far off do not count."""
    length = np.linalg.norm(residual, axis=-1)[usable]
    return float(np.median(length)) / 1.538 if length.size else 0.0


def _cross_matrix(v: Array) -> Array:
    return np.cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2)


def _told(state: _State, sds: Array, poses: Poses, turns: Turns, gravity: float) -> Inertial:
    up = state.corrected(poses.acc)
    turned = _turned(state, turns)[0]
    both = _usable(poses, turns)
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
