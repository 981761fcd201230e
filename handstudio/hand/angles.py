"""Joint angles with clinical names and signs (CONVENTIONS.md), from the attitudes of segments.

One rotation a joint, ``q_rest_child``: the child in its parent, after the child's attitude at the
flat hand is taken out. It is split into intrinsic flexion, deviation and rotation about x, z and y
in this order; flexion is minus the turn about x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.skeleton import FINGERS, JOINTS, PARENTS, SEGMENTS, HandSide, Skeleton
from handstudio.maths import so3

FLEXION, DEVIATION, ROTATION = 0, 1, 2
ROOT_ANGLES = ("elbow_flexion", "forearm_pronation")
"""Angles relative to the start, the upper arm assumed still: no sensor is on it."""


@dataclass(frozen=True, slots=True)
class Angle:
    """One named angle: which joint, which of its three turns, and its clinical sign."""

    name: str
    joint: str
    turn: int
    sign_right: float
    sign_left: float


def decompose(q_rest_child: Float[Array, "*n 4"]) -> Float[Array, "*n 3"]:
    """Turns [rad] about x, z and y, intrinsic in this order: ``q = Rx(a) Rz(b) Ry(c)``.

    b lies in [-pi/2, pi/2]; where \\|b\\| is pi/2, a and c are not separately determined, and some
    pair that composes to the rotation is given.
    """
    m = so3.to_matrix(q_rest_child)
    a = np.arctan2(m[..., 2, 1], m[..., 1, 1])
    b = np.arctan2(-m[..., 0, 1], np.hypot(m[..., 1, 1], m[..., 2, 1]))
    # the last row of what is left, Rz(b) Ry(c), once a is taken off: (-sin c, 0, cos c)
    left = np.cos(a)[..., None] * m[..., 2, :] - np.sin(a)[..., None] * m[..., 1, :]
    c = np.arctan2(-left[..., 0], left[..., 2])
    return np.stack([a, b, c], axis=-1)


def compose(turns: Float[Array, "*n 3"]) -> Float[Array, "*n 4"]:
    """The rotation whose turns about x, z and y these are; inverse of `decompose`."""
    x, y, z = np.eye(3)
    flexed = so3.from_axis_angle(x, turns[..., 0])
    deviated = so3.from_axis_angle(z, turns[..., 1])
    rotated = so3.from_axis_angle(y, turns[..., 2])
    return so3.multiply(so3.multiply(flexed, deviated), rotated)


@cache
def hand_angles() -> tuple[Angle, ...]:
    """Every angle of the hand, root first, then thumb to little finger."""
    both = (
        Angle("elbow_flexion", "elbow", FLEXION, +1.0, +1.0),
        Angle("forearm_pronation", "elbow", ROTATION, -1.0, +1.0),
        Angle("wrist_flexion", "wrist", FLEXION, -1.0, -1.0),
        Angle("wrist_deviation_ulnar", "wrist", DEVIATION, -1.0, +1.0),
        Angle("ulnar_cmc_flexion", "ulnar_cmc", FLEXION, -1.0, -1.0),
        Angle("thumb_cmc_flexion", "thumb_cmc", FLEXION, -1.0, -1.0),
        Angle("thumb_cmc_abduction", "thumb_cmc", DEVIATION, +1.0, -1.0),
        Angle("thumb_cmc_rotation", "thumb_cmc", ROTATION, -1.0, +1.0),
        Angle("thumb_mcp_flexion", "thumb_mcp", FLEXION, -1.0, -1.0),
        Angle("thumb_ip_flexion", "thumb_ip", FLEXION, -1.0, -1.0),
    )
    return both + tuple(angle for finger in FINGERS[1:] for angle in _finger_angles(finger))


def _finger_angles(finger: str) -> tuple[Angle, ...]:
    # abduction leads away from the middle finger; the middle finger's own is radial positive
    away = +1.0 if finger in ("index", "middle") else -1.0
    return (
        Angle(f"{finger}_mcp_flexion", f"{finger}_mcp", FLEXION, -1.0, -1.0),
        Angle(f"{finger}_mcp_abduction", f"{finger}_mcp", DEVIATION, away, -away),
        Angle(f"{finger}_mcp_deviation_ulnar", f"{finger}_mcp", DEVIATION, -1.0, +1.0),
        Angle(f"{finger}_pip_flexion", f"{finger}_pip", FLEXION, -1.0, -1.0),
        Angle(f"{finger}_dip_flexion", f"{finger}_dip", FLEXION, -1.0, -1.0),
    )


def joint_turns(
    skeleton: Skeleton,
    q_world_segment: Float[Array, "n k 4"],
    q_world_start: Float[Array, "n 4"],
) -> Float[Array, "n k 3"]:
    """Turns about x, z, y [rad] of every joint; the elbow's are relative to ``q_world_start``."""
    parents = list(PARENTS)
    q_world_parent = q_world_segment[:, parents, :].copy()
    q_world_parent[:, 0] = q_world_start
    q_world_rest = so3.multiply(q_world_parent, skeleton.q_parent_rest)
    return decompose(so3.multiply(so3.conjugate(q_world_rest), q_world_segment))


def joint_angles(
    skeleton: Skeleton,
    q_world_segment: Float[Array, "n k 4"],
    q_world_start: Float[Array, "n 4"],
    angles: Sequence[Angle] | None = None,
) -> Float[Array, "n a"]:
    """Named angles [rad], columns in the order of ``angles`` (all of them unless given).

    ``q_world_start`` is the forearm's attitude that elbow and forearm angles start from; NaN
    where there was none yet gives NaN for those two.
    """
    turns = joint_turns(skeleton, q_world_segment, q_world_start)
    columns = [
        sign_of(angle, skeleton.side) * turns[:, joint_index(angle.joint), angle.turn]
        for angle in (hand_angles() if angles is None else angles)
    ]
    return np.stack(columns, axis=-1)


def sign_of(angle: Angle, side: HandSide) -> float:
    """Clinical sign of an angle on this side."""
    return angle.sign_right if side == "right" else angle.sign_left


def joint_index(name: str) -> int:
    """Index of a joint, and of the segment distal to it."""
    return _JOINT_INDEX[name]


_JOINT_INDEX = {joint.name: index for index, joint in enumerate(JOINTS)}
assert tuple(_JOINT_INDEX.values()) == tuple(range(len(SEGMENTS)))
