"""The placed hand: joints and fingertips in the world, from the attitudes of the segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.skeleton import DISTALS, PARENTS, SEGMENTS, Skeleton
from handstudio.maths import so3


@dataclass(frozen=True, slots=True)
class Pose:
    """A hand placed in the world, z up [m]; leading axes are time.

    The elbow is the origin: its place cannot be observed with inertial sensors alone.
    """

    q_world_segment: Float[Array, "*n k 4"]
    t_world_joint: Float[Array, "*n k 3"]
    t_world_tip: Float[Array, "*n 5 3"]


def posed(skeleton: Skeleton, q_world_segment: Float[Array, "*n k 4"]) -> Pose:
    """Place a skeleton: a point at the end of a chain is the sum of its turned links (2.14)."""
    t_world_joint = np.empty((*q_world_segment.shape[:-1], 3))
    t_world_joint[..., 0, :] = skeleton.t_parent_joint[0]
    links = so3.rotate(q_world_segment[..., list(PARENTS), :], skeleton.t_parent_joint)
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            t_world_joint[..., child, :] = t_world_joint[..., parent, :] + links[..., child, :]
    distal = [SEGMENTS.index(name) for name in DISTALS]
    tips = so3.rotate(q_world_segment[..., distal, :], skeleton.t_distal_tip)
    return Pose(q_world_segment, t_world_joint, t_world_joint[..., distal, :] + tips)


def moved(pose: Pose, q_room_world: Float[Array, "n 4"], t_room_elbow: Float[Array, "n 3"]) -> Pose:
    """The same hand in a room whose place is known: everything of the result is in that frame."""
    q_all = q_room_world[:, None]
    return Pose(
        so3.multiply(q_all, pose.q_world_segment),
        so3.rotate(q_all, pose.t_world_joint) + t_room_elbow[:, None],
        so3.rotate(q_all, pose.t_world_tip) + t_room_elbow[:, None],
    )


def bone_ends(pose: Pose) -> tuple[Float[Array, "*n b 3"], Float[Array, "*n b 3"]]:
    """Both ends of every drawn bone: parent joint to joint, then distal joints to tips."""
    inner = [child for child, parent in enumerate(PARENTS) if parent >= 0]
    parents = [PARENTS[child] for child in inner]
    distal = [SEGMENTS.index(name) for name in DISTALS]
    joint = pose.t_world_joint
    starts = np.concatenate([joint[..., parents, :], joint[..., distal, :]], axis=-2)
    ends = np.concatenate([joint[..., inner, :], pose.t_world_tip], axis=-2)
    return starts, ends
