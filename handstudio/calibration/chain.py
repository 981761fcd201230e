"""All joint centres of a hand at once: one linear least squares over all swings and all sensors.

What an accelerometer feels beyond gravity is the sum over the chain from the resting elbow,

    R_s a_s - g = sum_k R_k Gamma_k V_k + R_s Gamma_s u_s,    Gamma = [dw]x + [w]x²

(3.1 for every link): ``V_k`` from a segment's joint to the next one, ``u_s`` from the joint of a
sensor's segment to the sensor, each in the frame of the sensor that drives the segment. It is
linear in all of them. Sensors beyond the neighbours of a joint matter most: skin over the joint
drags and pitches only the boards beside it. Of those the place is let to wander with the joint's
angle, square to its axis. A hinge's place along its own axis is not seen by its own swings
(``Gamma n = 0``); anatomy stands in, as it does, weakly, for all places.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.axes import JointAxis
from handstudio.calibration.swings import Swing, Swings, settled
from handstudio.hand.skeleton import JOINTS, SEGMENTS, Joint, Skeleton
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

Key: TypeAlias = tuple[str, int, str]
"""An unknown vector: ("link", 0, joint), ("sensor", sensor, ""), ("skin", sensor, joint),
("roll", 0, joint), ("pass", 0, joint), ("lean", 0, joint), ("bias", sensor, "")."""


@dataclass(frozen=True, slots=True)
class Priors:
    """How well everything is known before: standard deviations, all but the shares in SI.

    Attributes:
        link_share: Of a link, as a share of its length in mean proportions.
        link_m: And beside that.
        lateral_m: Of a sensor's place across its bone: gloves are cut to lie over the middle.
        along_share: Of its place along the bone, as a share of the bone.
        height_m: Of its height above the bone.
        skin_m_rad: How far skin moves a board for a turn of a joint beside it.
        roll_m_rad: How far a joint's centre wanders with its flexion; the wrist's five times that.
        lean_rad_rad: How a link turns in a board that rocks by nobody knows how much.
        pass_m: How far the two axes of wrist and thumb pass by one another; of others a quarter.
        tilt_rad: Of the attitude in a swing, and of how it drifts.
        acc_bias: Of an accelerometer [m/s²].
        noise: Of one smoothed acceleration, at least [m/s²].
        give: How far a board on skin tilts where it is accelerated [rad per m/s²].
        swing_share: What else differs from swing to swing counts this much more than noise.
    """

    link_share: float = 0.15
    link_m: float = 0.004
    lateral_m: float = 0.003
    along_share: float = 0.25
    height_m: float = 0.01
    skin_m_rad: float = 0.002
    roll_m_rad: float = 0.0003
    lean_rad_rad: float = 0.03
    pass_m: float = 0.004
    tilt_rad: float = float(np.deg2rad(0.1))
    acc_bias: float = 0.005
    noise: float = 0.02
    swing_share: float = 2.0
    give: float = 0.005


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """The solution.

    Attributes:
        index: Where each unknown vector begins.
        x: All unknowns.
        covariance: Of them.
        prior_sd: Standard deviations before.
        residual: RMS of what is left [m/s²], by joint.
        give: How boards tilt where they are accelerated [rad per m/s²], by sensor.
    """

    index: dict[Key, int]
    x: Float[Array, " u"]
    covariance: Float[Array, "u u"]
    prior_sd: Float[Array, " u"]
    residual: dict[str, float]
    give: Float[Array, " s"]

    def link(self, joint: str) -> tuple[Array, Array]:
        """From the centre before to this joint's, in the parent's sensor; and covariance."""
        return self._vector(("link", 0, joint))

    def sensor(self, sensor: int) -> tuple[Array, Array]:
        """From the centre of its segment's joint to a sensor, in its frame; and covariance."""
        return self._vector(("sensor", sensor, ""))

    def _vector(self, key: Key) -> tuple[Array, Array]:
        part = slice(self.index[key], self.index[key] + 3)
        return self.x[part], self.covariance[part, part]


def solved(
    swings: Swings,
    axes: Mapping[str, JointAxis],
    skeleton: Skeleton,
    priors: Priors = Priors(),
) -> Chain:
    """Find all joint centres.

    Args:
        swings: The course, sensors freed of rocking.
        axes: Flexion axes by joint.
        skeleton: Mean proportions of this hand's length.
        priors: How well everything is known before.
    """
    index = _index(_Tree(swings, axes))
    mean, precision = _prior(_Tree(swings, axes), index, skeleton, priors)
    sd = 1.0 / np.sqrt(np.diag(precision))
    groups = _soft_groups(swings)
    give, x, blocks, weights = np.zeros(len(groups)), mean, list[_Block](), list[Array]()
    for _round in range(_ROUNDS):
        blocks = _all_blocks(_Tree(settled(swings, give @ groups), axes), index)
        weights = [block.weights(x, priors) if _round else np.ones(len(block.y) // 3) for block in blocks]
        more = [
            _all_blocks(_Tree(settled(swings, (give + _STEP * unit) @ groups), axes), index)
            for unit in np.eye(len(groups))
        ]
        x, change, covariance = _stepped(blocks, more, x, weights, (mean, precision, give), priors)
        give = give + change
    blocks = _all_blocks(_Tree(settled(swings, give @ groups), axes), index)
    return Chain(index, x, covariance, sd, _residuals(blocks, x, priors), give @ groups)


def _all_blocks(tree: _Tree, index: dict[Key, int]) -> list[_Block]:
    return [block for swing in tree.swings.swings for block in _blocks(tree, swing, index)]


def _soft_groups(swings: Swings) -> Array:
    """Which boards lie on skin alike: those of the forearm, and all others; (group, sensor)."""
    forearm = np.array([place.segment == "forearm" for place in swings.layout.sensors])
    return np.stack([forearm, ~forearm]).astype(float)


def _stepped(
    blocks: list[_Block],
    more: list[list[_Block]],
    x: Array,
    weights: list[Array],
    before: tuple[Array, Array, Array],
    priors: Priors,
) -> tuple[Array, Array, Array]:
    """A step of Gauss and Newton in places and in how boards give; places' covariance."""
    mean, precision, give = before
    count, soft = len(x), len(more)
    normal, right = np.zeros((count + soft, count + soft)), np.zeros(count + soft)
    normal[:count, :count], right[:count] = precision, precision @ (mean - x)
    known = np.eye(soft) / priors.give**2
    normal[count:, count:], right[count:] = known, -known @ give
    for number, (block, weight) in enumerate(zip(blocks, weights, strict=True)):
        e = block.y - block.rows @ x[block.at]
        softer = [others[number] for others in more]
        slopes = [(e - (o.y - o.rows @ x[o.at])) / _STEP for o in softer]
        rows = np.column_stack([block.rows, *slopes])
        at = np.concatenate([block.at, count + np.arange(soft)])
        _Block(block.joint, at, rows, e, block.tilt).add_to(normal, right, weight, priors)
    step = np.linalg.solve(normal, right)
    covariance = np.linalg.inv(normal)[:count, :count]
    return x + step[:count], step[count:], covariance


_ROUNDS = 3
_STEP = 1e-3  # rad per m/s²
_HUBER = 2.5
_GRAVITY = np.array([0.0, 0.0, STANDARD_GRAVITY])
_TILTED = np.array([[0.0, STANDARD_GRAVITY], [-STANDARD_GRAVITY, 0.0], [0.0, 0.0]])
_EVERY_S = 0.02  # instants used: smoothing makes nearer ones alike
_MOVED = np.deg2rad(5.0)  # a joint that turns less drags no skin
_OFF_PLANE_M = 1e-5
_PASSING = ("wrist", "thumb_cmc")
_WHERE_ALONG = {"SN1": 0.70, "SN2": 0.78, "SN3": 0.86, "Tip": 1.0}  # of the segment
_ABOVE_BONE_M = 0.013


class _Tree:
    """Who hangs on whom."""

    def __init__(self, swings: Swings, axes: Mapping[str, JointAxis]) -> None:
        self.swings, self.axes = swings, axes
        self.segment = {s: swings.layout.sensors[s].segment for s in swings.alive}
        self.driver: dict[str, int] = {}
        for sensor in swings.alive:
            self.driver.setdefault(self.segment[sensor], sensor)
        self.joint_of = {joint.child: joint for joint in JOINTS}

    def chain(self, segment: str) -> list[Joint]:
        """Joints from the elbow out to a segment."""
        out: list[Joint] = []
        at: str | None = segment
        while at is not None:
            out.append(self.joint_of[at])
            at = self.joint_of[at].parent
        return out[::-1]

    def below(self, joint: str) -> list[int]:
        """Sensors that a joint moves, whose whole chain carries sensors."""
        return [
            s
            for s, segment in self.segment.items()
            if joint in [j.name for j in self.chain(segment)]
            and all(j.parent is None or j.parent in self.driver for j in self.chain(segment))
        ]

    def beside(self, sensor: int) -> list[str]:
        """Joints whose skin a sensor lies on."""
        segment = self.segment[sensor]
        return [
            j.name for j in JOINTS if segment in (j.parent, j.child) and j.name in self.axes
        ]


def _index(tree: _Tree) -> dict[Key, int]:
    keys: list[Key] = [("link", 0, j.name) for j in JOINTS if j.parent in tree.driver]
    keys += [("sensor", s, "") for s in tree.segment]
    keys += [("skin", s, j) for s in tree.segment for j in tree.beside(s)]
    moving = [j.name for j in JOINTS if j.parent in tree.driver and j.name in tree.axes]
    keys += [("roll", 0, name) for name in moving]
    keys += [("pass", 0, name) for name in moving if tree.axes[name].sideways is not None]
    keys += [("lean", 0, name) for name in moving if name.endswith("_dip")]
    keys += [("bias", s, "") for s in tree.segment]
    return {key: 3 * count for count, key in enumerate(keys)}


def _prior(
    tree: _Tree, index: dict[Key, int], skeleton: Skeleton, priors: Priors
) -> tuple[Array, Array]:
    size = 3 * len(index)
    mean, precision = np.zeros(size), np.zeros((size, size))
    for (kind, sensor, joint), at in index.items():
        part = slice(at, at + 3)
        if kind == "link":
            link = skeleton.t_parent_joint[_number(joint)]
            mean[part] = link
            sd = priors.link_share * np.linalg.norm(link) + priors.link_m
            precision[part, part] = np.eye(3) / sd**2
        elif kind == "sensor":
            far = skeleton.t_far_end[SEGMENTS.index(tree.segment[sensor])]
            name = tree.swings.layout.sensors[sensor].sensor
            mean[part] = _WHERE_ALONG.get(name, 0.5) * far + [0.0, 0.0, _ABOVE_BONE_M]
            along = max(priors.along_share * float(np.linalg.norm(far)), priors.height_m)
            precision[part, part] = np.diag(
                [priors.lateral_m**-2, along**-2, priors.height_m**-2]
            )
        elif kind in ("skin", "roll", "pass", "lean"):
            seen_by = sensor if kind == "skin" else tree.driver[_parent(joint)]
            n = tree.axes[joint].seen_from(tree.swings, seen_by)
            along_n, across = np.outer(n, n), np.eye(3) - np.outer(n, n)
            wide = priors.skin_m_rad if kind == "skin" else priors.roll_m_rad
            if kind == "roll" and joint == "wrist":
                wide *= 5.0
            if kind == "lean":
                wide = priors.lean_rad_rad * float(
                    np.linalg.norm(skeleton.t_parent_joint[_number(joint)])
                )
            if kind == "pass":
                along_n, across = across, along_n
                wide = priors.pass_m * (1.0 if joint in _PASSING else 0.25)
            precision[part, part] = along_n / _OFF_PLANE_M**2 + across / wide**2
        else:
            precision[part, part] = np.eye(3) / priors.acc_bias**2
    return mean, precision


def _parent(joint: str) -> str:
    parent = JOINTS[_number(joint)].parent
    assert parent is not None
    return parent


def _number(joint: str) -> int:
    return [j.name for j in JOINTS].index(joint)


@dataclass(frozen=True, slots=True, eq=False)
class _Block:
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


def _blocks(tree: _Tree, swing: Swing, index: dict[Key, int]) -> list[_Block]:
    step = max(1, round(_EVERY_S * tree.swings.rate_hz))
    part = slice(swing.window.start, swing.window.stop, step)
    felt = {s: _Felt(tree, s, part) for s in tree.segment}
    ramp = np.linspace(-1.0, 1.0, len(range(*part.indices(len(tree.swings.gyr)))))
    tilt = np.concatenate(
        [np.broadcast_to(_TILTED, (len(ramp), 3, 2)), _TILTED * ramp[:, None, None]], axis=2
    ).reshape(-1, 4)
    out = []
    for sensor in tree.below(swing.joint):
        columns: dict[Key, Array] = {}
        for joint in tree.chain(tree.segment[sensor])[1:]:
            assert joint.parent is not None
            base = felt[tree.driver[joint.parent]]
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
                columns["skin", sensor, beside] = mine.of_wander(
                    tree.axes[beside].angle, part
                )
        at = np.concatenate([np.arange(index[k], index[k] + 3) for k in columns])
        rows = np.concatenate(list(columns.values()), axis=2)
        y = np.einsum("nij,nj->ni", mine.turn, mine.acc) - _GRAVITY
        out.append(_Block(swing.joint, at, rows.reshape(-1, len(at)), y.ravel(), tilt))
    return out


class _Felt:
    """Matrices of one sensor in one swing."""

    def __init__(self, tree: _Tree, sensor: int, part: slice) -> None:
        swings = tree.swings
        self.turn = so3.to_matrix(swings.q_world_sensor[part, sensor])
        self.acc, self.gyr = swings.acc[part, sensor], swings.gyr[part, sensor]
        self.spin = skew(self.gyr)
        self.gamma = skew(swings.dgyr[part, sensor]) + self.spin @ self.spin
        self.of_point = self.turn @ self.gamma

    def of_wander(self, turned: tuple[Array, Array, Array], part: slice) -> Array:
        """Acceleration by a place that goes with a joint's angle, per m/rad."""
        angle, rate, more = (x[part, None, None] for x in turned)
        inside = self.gamma * angle + 2.0 * self.spin * rate + np.eye(3) * more
        return np.asarray(self.turn @ inside)


def skew(v: Float[Array, "*b 3"]) -> Float[Array, "*b 3 3"]:
    """Matrices of the cross product: ``skew(a) @ b = a x b``."""
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _residuals(blocks: list[_Block], x: Array, priors: Priors) -> dict[str, float]:
    sums: dict[str, list[float]] = {}
    for block in blocks:
        left = block.left(x, priors)
        sums.setdefault(block.joint, []).append(float(np.mean(left**2)))
    return {joint: float(np.sqrt(np.mean(squares))) for joint, squares in sums.items()}
