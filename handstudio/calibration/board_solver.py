"""Gauss-Newton for all sensors of a board at once, each tied to the others by the board's turns.

What is solved for per sensor: ``M_a`` (symmetric: the frame that everything is
corrected into), ``b_a``, ``M_g``, and its attitude at every rest; and the turns of the board
between them. Residuals, each over its standard deviation:

- gravity: ``M_a (acc - b_a) - R_sensor_world g``
- turn: ``log(R_turned' R_world_before' R_world_after)`` of the integrated gyroscope
- board: ``log(R_board_turn R_world_before R_world_after')``, down-weighted where it is far off
- what is shipped: scales within some percent, axes nearly square.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from handstudio.arrays import Array
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

_SHIPPED = [0, 1, 2, *range(9, 18)]  # of these something is known beforehand
_PERFECT = np.concatenate([np.ones(3), np.eye(3).ravel()])
_PRIOR = len(_SHIPPED)
_DAMPING = 1e-3  # of what may be unseen
_HEADING_DAMPING = 1e3  # what is seen of an attitude has 1e7 and more
_CONVERGED = 1e-5


@dataclass(frozen=True, slots=True)
class Given:
    """What is known beforehand: gravity [m/s²], and how far scales are off as shipped."""

    gravity: float
    scale_sd: float

    @property
    def shipped_sd(self) -> Array:
        """Of what is shipped, in the order of the residuals, (12,)."""
        axes = np.where(np.eye(3), 1.0, 0.5).ravel()
        return self.scale_sd * np.concatenate([np.ones(3), axes])


def solved(
    state: State, poses: Poses, turns: Turns, given: Given, iterations: int, *, board: bool
) -> tuple[State, Array]:
    """The state after so many iterations at most, and standard deviations of its ``own``, (s, 18).

    Args:
        state: Where it begins.
        poses: Rests.
        turns: Between them.
        given: What is known beforehand.
        iterations: At most.
        board: Whether sensors are tied to one another by the board's turns.
    """
    sds = np.zeros_like(state.own)
    for _ in range(iterations):
        state = replace(state, gyr_rests=at_rest(poses, state.corrected(poses.acc)))
        moved = turned_along(state, turns)
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
        if np.abs(step[:, :OWN]).max() < _CONVERGED:
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
    damping[:OWN] = _DAMPING
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
    variance = np.diagonal(inverse, axis1=1, axis2=2)[:, :OWN]
    own = of_cross[:, :OWN]
    shared = np.sum((own @ np.linalg.inv(left)) * own, axis=-1)
    return -of_gradient - of_cross @ eta, eta, np.sqrt(variance + shared)


def _stepped(state: State, step: Array, eta: Array) -> State:
    """Attitudes are turned on the sensor's side, turns of the board on the world's."""
    small = step[:, OWN:].reshape(*state.q.shape[:2], 3)
    return replace(
        state,
        own=state.own + step[:, :OWN],
        q=so3.normalize(so3.multiply(state.q, so3.exp(small))),
        board=so3.normalize(so3.multiply(so3.exp(eta.reshape(-1, 3)), state.board)),
    )


def _residuals(state: State, poses: Poses, turned: Array, given: Given) -> tuple[Array, ...]:
    """Gravity (s, k, 3), turn and board (s, t, 3); what is shipped (s, 12) over its deviations."""
    back = so3.conjugate(state.q)
    turn = so3.multiply(back[:, :-1], state.q[:, 1:])
    return (
        state.corrected(poses.acc) - _felt(state, given),
        so3.log(so3.multiply(so3.conjugate(turned[:, :, -1]), turn)),
        so3.log(so3.multiply(state.board, so3.multiply(state.q[:, :-1], back[:, 1:]))),
        (state.own[:, _SHIPPED] - _PERFECT) / given.shipped_sd,
    )


def _felt(state: State, given: Given) -> Array:
    return so3.rotate(so3.conjugate(state.q), np.array([0.0, 0.0, given.gravity]))


def _weighed(
    state: State, poses: Poses, turns: Turns, apart: tuple[Array, ...], board: bool
) -> State:
    """How far to trust turns and board, by what is left of them now."""
    both = usable(poses, turns)
    # of a sensor for itself only two of three components are seen, the third is nothing
    seen = 1.0 if board else np.sqrt(1.5)
    state = replace(state, turn_sd=max(TURN_SD, seen * _spread_of(apart[1], both)))
    if not board:
        return state
    sd = max(BOARD_SD, _spread_of(apart[2], both))
    # far off is not of the board: the weight falls with the fourth power (Geman, McClure)
    rigid = both / (1.0 + np.sum(apart[2] ** 2, axis=-1) / (12.0 * sd**2)) ** 2
    return replace(state, board_sd=sd, rigid=rigid)


def _weights(state: State, poses: Poses, turns: Turns) -> tuple[Array, Array, Array]:
    """Of gravity, turn and board: one over the deviation."""
    return (
        (poses.usable / ACC_SD)[..., None],
        (usable(poses, turns) / state.turn_sd)[..., None],
        (np.sqrt(state.rigid) / state.board_sd)[..., None],
    )


def _jacobian(
    state: State,
    poses: Poses,
    turns: Turns,
    moved: tuple[Array, Array],
    given: Given,
    *,
    weights: tuple[Array, Array, Array],
) -> Array:
    """Of the weighed residuals, in their order, by what is a sensor's own: (s, r, 18 + 3 k)."""
    s, k = poses.usable.shape
    t = k - 1
    jacobian = np.zeros((s, 3 * (k + 2 * t) + _PRIOR, OWN + 3 * k))
    parts = np.split(jacobian, np.cumsum([3 * k, 3 * t, 3 * t]), axis=1)
    gravity, turn, board = (part.reshape(s, -1, 3, OWN + 3 * k) for part in parts[:3])
    gravity[..., :6] = np.einsum("nij,skj->skin", SYMMETRIC, poses.acc)
    gravity[..., 6:9] = -np.eye(3)
    turn[..., 9:18] = -_by_matrix(*moved, turns.time_s)
    tilted = -_cross_matrix(_felt(state, given))
    before, at = -so3.to_matrix(so3.conjugate(moved[0][:, :, -1])), so3.to_matrix(state.q)
    for i in range(k):
        columns = slice(OWN + 3 * i, OWN + 3 * i + 3)
        gravity[:, i, :, columns] = tilted[:, i]
        if i < t:
            turn[:, i, :, columns], board[:, i, :, columns] = before[:, i], at[:, i + 1]
        if i > 0:
            turn[:, i - 1, :, columns], board[:, i - 1, :, columns] = np.eye(3), -at[:, i]
    scaled = [
        (part * weight[..., None]).reshape(s, -1, OWN + 3 * k)
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


def _spread_of(residual: Array, usable: Array) -> float:
    """Standard deviation of a component, from the median length: the few far off do not count."""
    length = np.linalg.norm(residual, axis=-1)[usable]
    return float(np.median(length)) / 1.538 if length.size else 0.0


def _cross_matrix(v: Array) -> Array:
    return np.cross(v[..., None, :], np.eye(3)).swapaxes(-1, -2)
