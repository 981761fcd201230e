"""The equations of `chain`: what accelerometers feel in a swing, by the unknown vectors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.chain_tree import Key, Priors, Tree
from handstudio.calibration.rigid_rotation import skew
from handstudio.calibration.swings import Swing, Swings
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

_HUBER = 2.5
_GRAVITY = np.array([0.0, 0.0, STANDARD_GRAVITY])
_TILTED = np.array([[0.0, STANDARD_GRAVITY], [-STANDARD_GRAVITY, 0.0], [0.0, 0.0]])
_EVERY_S = 0.02  # instants used: smoothing makes nearer ones alike
_MOVED = np.deg2rad(5.0)  # a joint that turns less drags no skin


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Equations of one sensor in one swing."""

    joint: str
    at: Array  # which unknowns
    rows: Float[Array, "r c"]
    y: Float[Array, " r"]
    tilt: Float[Array, "r 4"]

    def add_to(self, normal: Array, right: Array, weight: Array, priors: Priors) -> None:
        """Add to the normal equations, the tilt of this swing eliminated."""
        root = np.repeat(np.sqrt(weight), 3)[:, None] / (priors.noise * priors.swing_share)
        rows, tilt, y = self.rows * root, self.tilt * root, self.y * root[:, 0]
        inner = tilt.T @ tilt + np.eye(4) / priors.tilt_rad**2
        cross = rows.T @ tilt
        share = np.linalg.solve(inner, cross.T)
        normal[np.ix_(self.at, self.at)] += rows.T @ rows - cross @ share
        right[self.at] += rows.T @ y - share.T @ (tilt.T @ y)

    def left(self, x: Array, priors: Priors) -> Array:
        """What is left, (n, 3)."""
        e = self.y - self.rows @ x[self.at]
        inner = self.tilt.T @ self.tilt + np.eye(4) * (priors.noise / priors.tilt_rad) ** 2
        free: Array = e - self.tilt @ np.linalg.solve(inner, self.tilt.T @ e)
        return free.reshape(-1, 3)

    def weights(self, x: Array, priors: Priors) -> Array:
        """Huber's, squared lengths of what is left against what is usual in this swing."""
        size = np.linalg.norm(self.left(x, priors), axis=1)
        usual = max(float(np.median(size)) / 1.538, priors.noise)
        relative = np.maximum(size / (1.538 * usual), 1e-9)
        weight: Array = np.minimum(1.0, _HUBER / relative) * (priors.noise / usual) ** 2
        return weight


def instants(swing: Swing, rate_hz: float) -> slice:
    """Those of a course that stand in the equations of a swing."""
    return slice(swing.window.start, swing.window.stop, max(1, round(_EVERY_S * rate_hz)))


def blocks_of(
    tree: Tree, swing: Swing, index: dict[Key, int], part: slice, told: Swings
) -> list[Block]:
    """Equations of one swing, one block a sensor that it moves.

    Args:
        tree: Who hangs on whom.
        swing: Whose.
        index: Where each unknown vector begins.
        part: Its instants, of the whole course.
        told: What sensors told then, as if their boards stayed on the bone.
    """
    felt = _felt(told)
    ramp = np.linspace(-1.0, 1.0, len(told.gyr))
    tilt = np.concatenate(
        [np.broadcast_to(_TILTED, (len(ramp), 3, 2)), _TILTED * ramp[:, None, None]], axis=2
    ).reshape(-1, 4)
    out = []
    for sensor in tree.below(swing.joint):
        columns: dict[Key, Array] = {}
        for joint in tree.chain(tree.segment[sensor])[1:]:
            assert joint.parent is not None
            base = felt[tree.driver[joint.parent]]
            if ("link", 0, joint.name) in index:  # else it has no length
                columns["link", 0, joint.name] = base.of_point
            above = tree.joint_of[joint.parent].name
            if ("lean", 0, joint.name) in index and above == swing.joint:
                columns["lean", 0, joint.name] = base.of_wander(tree.axes[above].angle, part)
            if joint.name == swing.joint and joint.name in tree.axes:
                axis = tree.axes[joint.name]
                columns["roll", 0, joint.name] = base.of_wander(axis.angle, part)
                if axis.sideways is not None:
                    columns["pass", 0, joint.name] = base.of_wander(axis.sideways, part)
        mine = felt[sensor]
        columns["sensor", sensor, ""] = mine.of_point
        columns["bias", sensor, ""] = mine.turn
        for beside in tree.beside(sensor):
            if np.ptp(tree.axes[beside].angle[0][part]) > _MOVED:
                columns["skin", sensor, beside] = mine.of_wander(tree.axes[beside].angle, part)
        at = np.concatenate([np.arange(index[k], index[k] + 3) for k in columns])
        rows = np.concatenate(list(columns.values()), axis=2)
        y = np.einsum("nij,nj->ni", mine.turn, mine.acc) - _GRAVITY
        out.append(Block(swing.joint, at, rows.reshape(-1, len(at)), y.ravel(), tilt))
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _Felt:
    """Matrices of one sensor in one swing."""

    acc: Float[Array, "n 3"]
    turn: Float[Array, "n 3 3"]
    spin: Float[Array, "n 3 3"]
    gamma: Float[Array, "n 3 3"]
    of_point: Float[Array, "n 3 3"]

    def of_wander(self, turned: tuple[Array, Array, Array], part: slice) -> Array:
        """Acceleration by a place that goes with a joint's angle, per m/rad."""
        angle, rate, more = (x[part, None, None] for x in turned)
        inside = self.gamma * angle + 2.0 * self.spin * rate + np.eye(3) * more
        return np.asarray(self.turn @ inside)


def _felt(told: Swings) -> list[_Felt]:
    """Of every sensor."""
    turn, spin = so3.to_matrix(told.q_world_sensor), skew(told.gyr)
    gamma = skew(told.dgyr) + spin @ spin
    every = (told.acc, turn, spin, gamma, turn @ gamma)
    return [_Felt(*(x[:, s] for x in every)) for s in range(told.gyr.shape[1])]
