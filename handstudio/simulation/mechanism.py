"""How a subject's joints turn: axes that need not meet, be square, or stay where they are.

Each joint is three turns in a row, flexion, deviation and rotation, each about an axis of its own
through a point of its own, both fixed in the frame the turn before left behind. With flexion the
joint's centre also wanders, and a little deviation and rotation come along, as they do where one
surface rolls on another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.angles import DEVIATION, FLEXION, ROTATION
from handstudio.hand.skeleton import PARENTS, SEGMENTS, Skeleton
from handstudio.simulation.moving import Moving, along, picked, planes_first, turning, vectors_last
from handstudio.simulation.trajectory import JointMotion

SQUARE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""Axes of flexion, deviation and rotation of an ideal joint, in its rest frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Mechanism:
    """Joints by index, in their rest frames: the child's frame at the flat hand.

    Attributes:
        axes: Unit axes of the three turns.
        points: A point of each axis [m].
        rolling: How far the centre wanders with flexion [m/rad].
        conjunct: Deviation and rotation that come with flexion: per rad, and per rad² [1/rad].
    """

    axes: Float[Array, "k 3 3"]
    points: Float[Array, "k 3 3"]
    rolling: Float[Array, "k 3"]
    conjunct: Float[Array, "k 2 2"]

    @property
    def is_fixed(self) -> bool:
        """Whether all axes stay where they are."""
        return not (self.rolling.any() or self.conjunct.any())


def ideal_mechanism() -> Mechanism:
    """Square axes that meet in the joint's centre."""
    k = len(SEGMENTS)
    zero = np.zeros((k, 3))
    return Mechanism(np.tile(SQUARE, (k, 1, 1)), np.zeros((k, 3, 3)), zero, np.zeros((k, 2, 2)))


def joints_moving(mechanism: Mechanism, joints: JointMotion) -> Moving:
    """Every segment in its joint's rest frame, (n, k)."""
    moving = [
        turning(mechanism.axes[:, turn], mechanism.points[:, turn], *driven)
        for turn, driven in enumerate(_driven(mechanism, joints))
    ]
    turned = moving[FLEXION].then(moving[DEVIATION]).then(moving[ROTATION])
    flexion = (x[..., FLEXION] for x in (joints.turns, joints.rates, joints.accelerations))
    t, v, a = (along(mechanism.rolling, x) for x in flexion)
    return turned.slid(t, v, a)


def hand_moving(
    skeleton: Skeleton, mechanism: Mechanism, joints: JointMotion, q_world_start: Float[Array, "4"]
) -> Moving:
    """Every segment in the world, (n, k): down the tree, a generation at once."""
    own = joints_moving(mechanism, joints).seen_from(
        skeleton.q_parent_rest, skeleton.t_parent_joint
    )
    n, k = own.q.shape[:2]
    out = Moving(*(vectors_last(np.empty((size, n, k))) for size in (4, 3, 3, 3, 3, 3)))
    for children, parents in GENERATIONS:
        if parents == [-1]:
            zero, (t, v, a) = np.zeros((n, 1, 3)), joints.elbow
            places = [x[:, None] + np.zeros((n, 1, 3)) for x in (t, v, a)]
            base = Moving(
                np.tile(q_world_start, (n, 1, 1)), places[0], zero, places[1], zero, places[2]
            )
        else:
            base = picked(out, parents)
        placed = base.then(picked(own, children))
        for name in Moving.__dataclass_fields__:
            getattr(out, name)[:, children] = getattr(placed, name)
    return out


def joint_turned(mechanism: Mechanism, turns: Float[Array, "*n k 3"]) -> tuple[Array, Array]:
    """Attitude and place [m] of every segment in its joint's rest frame: for solving postures."""
    still = JointMotion(turns, *(np.zeros_like(turns),) * 2, (np.zeros((1, 3)),) * 3)
    moving = joints_moving(mechanism, still)
    return moving.q, moving.t


def _driven(mechanism: Mechanism, joints: JointMotion) -> list[tuple[Array, Array, Array]]:
    """Angle, rate and acceleration of each of the three turns, conjunct ones added."""
    motion = (joints.turns, joints.rates, joints.accelerations)
    planes = [np.ascontiguousarray(planes_first(s)) for s in motion]
    x, v, a = (s[FLEXION] for s in planes)
    out = []
    for turn in (FLEXION, DEVIATION, ROTATION):
        own = tuple(s[turn] for s in planes)
        if turn == FLEXION or not mechanism.conjunct.any():
            out.append((own[0], own[1], own[2]))
            continue
        linear, square = mechanism.conjunct[:, turn - 1].T
        slope = linear + 2.0 * square * x
        out.append(
            (
                own[0] + (linear + square * x) * x,
                own[1] + slope * v,
                own[2] + slope * a + 2.0 * square * v**2,
            )
        )
    return out


def _generations() -> list[tuple[list[int], list[int]]]:
    """Children and their parents, all whose parents are already placed at once."""
    depth: list[int] = []
    for parent in PARENTS:
        depth.append(0 if parent < 0 else depth[parent] + 1)
    levels = [[c for c, d in enumerate(depth) if d == level] for level in range(max(depth) + 1)]
    return [(children, [PARENTS[child] for child in children]) for children in levels]


GENERATIONS = _generations()
"""Children and their parents, a depth of the tree each, the root first."""
