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

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.axes import JointAxis
from handstudio.calibration.chain_rows import Block, blocks_of, instants
from handstudio.calibration.chain_tree import (
    USUAL,
    Key,
    Priors,
    Tree,
    index_of,
    parent_of,
    prior_of,
)
from handstudio.calibration.swings import Pushed, Swing, Swings, pushed, settled
from handstudio.hand.skeleton import JOINTS, Skeleton
from handstudio.maths import so3


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """The solution.

    Attributes:
        index: Where each unknown vector begins.
        x: All unknowns.
        covariance: Of them.
        prior_sd: Standard deviations before.
        residual: RMS of what is left [m/s²], by joint.
    """

    index: dict[Key, int]
    x: Float[Array, " u"]
    covariance: Float[Array, "u u"]
    prior_sd: Float[Array, " u"]
    residual: dict[str, float]

    def link(self, joint: str) -> tuple[Array, Array]:
        """From the centre before to this joint's, in the parent's sensor; and covariance."""
        if joint == _HINGE and ("link", 0, joint) not in self.index:
            return np.zeros(3), np.zeros((3, 3))  # both blocks of the palm begin at the wrist
        return self._vector(("link", 0, joint))

    def sensor(self, sensor: int) -> tuple[Array, Array]:
        """From the centre of its segment's joint to a sensor, in its frame; and covariance."""
        return self._vector(("sensor", sensor, ""))

    def lean(self, joint: str) -> Array | None:
        """How the link to a joint leans in its parent's sensor as the joint before turns [m/rad].

        None where it was not let to.
        """
        key: Key = ("lean", 0, joint)
        return self._vector(key)[0] if key in self.index else None

    def _vector(self, key: Key) -> tuple[Array, Array]:
        part = slice(self.index[key], self.index[key] + 3)
        return self.x[part], self.covariance[part, part]


def solved(
    swings: Swings,
    axes: Mapping[str, JointAxis],
    skeleton: Skeleton,
    priors: Priors = USUAL,
) -> Chain:
    """Find all joint centres.

    Args:
        swings: The course, sensors freed of rocking.
        axes: Flexion axes by joint.
        skeleton: Mean proportions of this hand's length.
        priors: How well everything is known before.
    """
    tree = Tree(swings, axes)
    index = index_of(tree)
    mean, precision = prior_of(tree, index, skeleton, priors)
    sd = 1.0 / np.sqrt(np.diag(precision))
    by, soft, x, weights = pushed(swings), np.zeros(len(_STEPS)), mean, list[Array]()
    for count in range(_ROUNDS):
        blocks = _all_blocks(tree, index, by, soft)
        weights = [
            block.weights(x, priors) if count else np.ones(len(block.y) // 3) for block in blocks
        ]
        more = [_all_blocks(tree, index, by, soft + step) for step in np.diag(_STEPS)]
        x, change, covariance = _stepped(
            blocks, more, x, weights, before=(mean, precision, soft), priors=priors
        )
        soft = soft + change
    residual = _residuals(_all_blocks(tree, index, by, soft), x, priors)
    x = _between_axes(Tree(_settled(swings, by, soft), axes), index, x)
    covariance = covariance + priors.model_m**2 * np.eye(len(x))
    return Chain(index, x, covariance, sd, residual)


def _between_axes(tree: Tree, index: dict[Key, int], x: Array) -> Array:
    """Move the centre of a joint whose axes pass by one another to where it moves least.

    What was solved for lies on the first axis; the second passes where a swing about it leaves a
    point at rest. The more a joint turns about an axis, the nearer to that lies its mean centre.
    """
    x = x.copy()
    for kind, _, name in list(index):
        if kind != "pass":
            continue
        axis, parent = tree.axes[name], tree.driver[parent_of(name)]
        if axis.across is None or axis.sideways is None:
            continue
        at = index["pass", 0, name]
        wander = so3.rotate(tree.swings.q_flat(parent), x[at : at + 3])
        swings = tree.swings
        flexed = _spread(axis.angle[0], swings.of_joint(name, flexion=True))
        swung = _spread(axis.sideways[0], swings.of_joint(name, flexion=False))
        shift = -np.cross(wander, axis.across) * swung / (flexed + swung)
        _add(x, index, ("link", 0, name), so3.rotate(so3.conjugate(swings.q_flat(parent)), shift))
        beginning = tree.begin_at(name)
        for sensor, segment in tree.segment.items():
            if segment in beginning:
                seen = so3.rotate(so3.conjugate(swings.q_flat(sensor)), shift)
                _add(x, index, ("sensor", sensor, ""), -seen)
        for other in JOINTS:
            driver = tree.driver.get(other.parent or "")
            if other.parent in beginning and driver is not None:
                seen = so3.rotate(so3.conjugate(swings.q_flat(driver)), shift)
                _add(x, index, ("link", 0, other.name), -seen)
    return x


def _spread(angle: Array, swings: list[Swing]) -> float:
    return float(sum(np.var(angle[swing.moving]) for swing in swings))


def _add(x: Array, index: dict[Key, int], key: Key, what: Array) -> None:
    if key in index:
        x[index[key] : index[key] + 3] += what


def _all_blocks(tree: Tree, index: dict[Key, int], by: Pushed, soft: Array) -> list[Block]:
    blocks = list[Block]()
    for swing in tree.swings.swings:
        part = instants(swing, tree.swings.rate_hz)
        felt = _settled(tree.swings.at(part), by.at(part), soft)
        blocks += blocks_of(tree, swing, index, part, felt)
    return blocks


def _settled(swings: Swings, by: Pushed, soft: Array) -> Swings:
    """As if boards stayed on the bone.

    ``soft``: how they tilt where they are accelerated [rad per m/s²], those of the forearm, all
    others; and how far they stay behind [m per m/s²].
    """
    forearm = np.array([place.segment == "forearm" for place in swings.layout.sensors])
    tilting, lagging = (np.where(forearm, there, else_) for there, else_ in soft.reshape(2, 2))
    return settled(swings, by, tilting, lagging)


def _stepped(
    blocks: list[Block],
    more: list[list[Block]],
    x: Array,
    weights: list[Array],
    *,
    before: tuple[Array, Array, Array],
    priors: Priors,
) -> tuple[Array, Array, Array]:
    """A step of Gauss and Newton in places and in how soft boards lie; places' covariance."""
    mean, precision, soft = before
    count, size = len(x), len(x) + len(soft)
    normal, right = np.zeros((size, size)), np.zeros(size)
    normal[:count, :count], right[:count] = precision, precision @ (mean - x)
    known = np.repeat([priors.tilting, priors.lagging], 2) ** -2.0
    normal[count:, count:], right[count:] = np.diag(known), -known * soft
    for number, (block, weight) in enumerate(zip(blocks, weights, strict=True)):
        e = block.y - block.rows @ x[block.at]
        softer = [others[number] for others in more]
        steps = zip(softer, _STEPS, strict=True)
        slopes = [(e - (o.y - o.rows @ x[o.at])) / step for o, step in steps]
        rows = np.column_stack([block.rows, *slopes])
        at = np.concatenate([block.at, np.arange(count, size)])
        Block(block.joint, at, rows, e, block.tilt).add_to(normal, right, weight, priors)
    step = np.linalg.solve(normal, right)
    covariance = np.linalg.inv(normal)[:count, :count]
    return x + step[:count], step[count:], covariance


def _residuals(blocks: list[Block], x: Array, priors: Priors) -> dict[str, float]:
    sums: dict[str, list[float]] = {}
    for block in blocks:
        left = block.left(x, priors)
        sums.setdefault(block.joint, []).append(float(np.mean(left**2)))
    return {joint: float(np.sqrt(np.mean(squares))) for joint, squares in sums.items()}


_HINGE = "ulnar_cmc"
_ROUNDS = 3
_STEPS = np.array([1e-3, 1e-3, 1e-5, 1e-5])  # of what is soft, to see its slopes
