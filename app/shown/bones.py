"""The bones that are drawn: which mesh, fixed to which segment, how long, how thick."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float

from app import colours
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import DISTALS, FINGERS, PARENTS, SEGMENTS, ULNAR, Skeleton
from handstudio.maths import so3

# half widths of the ends as a share of hand length (drawn, not measured)
_PHALANX = {"thumb": 0.042, "index": 0.036, "middle": 0.037, "ring": 0.035, "little": 0.031}
_TAPER = {"proximal": 1.0, "intermediate": 0.88, "distal": 0.78, "metacarpal": 1.05}
_FOREARM_WIDTH = 1.15  # of the mesh's two bones side by side, in hand lengths


@dataclass(frozen=True, slots=True, eq=False)
class BoneSet:
    """Bones that share a mesh, as constants in the frames of their segments."""

    mesh: str
    segment: tuple[int, ...]
    t_segment_bone: Float[Array, "b 3"]
    q_segment_bone: Float[Array, "b 4"]
    scale: Float[Array, "b 3"]
    colour: tuple[tuple[int, int, int], ...]

    def placed(self, pose: Pose) -> tuple[Float[Array, "b 4"], Float[Array, "b 3"]]:
        """Attitude and place of every bone for a single pose."""
        at = list(self.segment)
        q = pose.q_world_segment[at]
        place = pose.t_world_joint[at] + so3.rotate(q, self.t_segment_bone)
        return so3.multiply(q, self.q_segment_bone), place


@dataclass(frozen=True, slots=True)
class _Bone:
    mesh: str
    segment: str
    start: Array
    end: Array
    half_width: float


def bone_sets(skeleton: Skeleton) -> tuple[BoneSet, ...]:
    """All bones of a hand, by mesh."""
    bones = [*_forearm(skeleton), *_palm(skeleton), *_digits(skeleton)]
    meshes = sorted({bone.mesh for bone in bones})
    return tuple(_set(mesh, [bone for bone in bones if bone.mesh == mesh]) for mesh in meshes)


def _set(mesh: str, bones: list[_Bone]) -> BoneSet:
    lengths = np.array([np.linalg.norm(bone.end - bone.start) for bone in bones])
    unit = _HALF_WIDTH_OF_MESH[mesh]
    widths = np.array([bone.half_width for bone in bones]) / unit
    return BoneSet(
        mesh,
        tuple(SEGMENTS.index(bone.segment) for bone in bones),
        np.stack([bone.start for bone in bones]),
        np.stack([_along(bone.end - bone.start) for bone in bones]),
        np.stack([widths, lengths, widths], axis=-1),
        tuple(colours.of_part(bone.segment) for bone in bones),
    )


_HALF_WIDTH_OF_MESH = {"phalanx": 0.12, "metacarpal": 0.10, "forearm": 0.11}


def _forearm(skeleton: Skeleton) -> list[_Bone]:
    length = skeleton.t_parent_joint[SEGMENTS.index("hand")]
    width = _FOREARM_WIDTH * 0.11 * hand_length(skeleton)
    return [_Bone("forearm", "forearm", np.zeros(3), length, width)]


def _palm(skeleton: Skeleton) -> list[_Bone]:
    bones = []
    hand = hand_length(skeleton)
    for finger in FINGERS[1:]:
        mcp = SEGMENTS.index(f"{finger}_proximal")
        block = SEGMENTS[PARENTS[mcp]]
        end = skeleton.t_parent_joint[mcp]
        hinged = skeleton.t_parent_joint[SEGMENTS.index(block)].any() and block == ULNAR
        start = end * ([0.2, 0.02, 0.0] if hinged else [0.42, 0.12, 0.3])
        bones.append(_Bone("metacarpal", block, start, end, _PHALANX[finger] * hand))
    return bones


def _digits(skeleton: Skeleton) -> list[_Bone]:
    bones = []
    hand = hand_length(skeleton)
    tips = dict(zip(DISTALS, skeleton.t_distal_tip, strict=True))
    for index, segment in enumerate(SEGMENTS):
        finger, _, kind = segment.partition("_")
        if finger not in FINGERS:
            continue
        children = [child for child, parent in enumerate(PARENTS) if parent == index]
        end = skeleton.t_parent_joint[children[0]] if children else tips[segment]
        mesh = "metacarpal" if kind == "metacarpal" else "phalanx"
        width = _PHALANX[finger] * _TAPER[kind] * hand
        bones.append(_Bone(mesh, segment, np.zeros(3), end, width))
    return bones


def hand_length(skeleton: Skeleton) -> float:
    """From the wrist to the middle fingertip, fingers straight [m]."""
    chain = ("middle_proximal", "middle_intermediate", "middle_distal")
    inner = sum(
        float(np.linalg.norm(skeleton.t_parent_joint[SEGMENTS.index(name)])) for name in chain
    )
    return inner + float(np.linalg.norm(skeleton.t_distal_tip[FINGERS.index("middle")]))


def _along(direction: Array) -> Array:
    """Attitude whose y points along a direction, with the least turn."""
    y = direction / np.linalg.norm(direction)
    axis = np.cross([0.0, 1.0, 0.0], y)
    sine, cosine = np.linalg.norm(axis), y[1]
    if sine < 1e-9:
        return so3.IDENTITY.copy()
    return so3.from_axis_angle(axis / sine, float(np.arctan2(sine, cosine)))


@cache
def joint_radii() -> Float[Array, " k"]:
    """Radius of the ball drawn at every joint, as a share of hand length."""
    radii = []
    for segment in SEGMENTS:
        finger, _, kind = segment.partition("_")
        radii.append(_PHALANX[finger] * _TAPER[kind] if finger in FINGERS else 0.05)
    return np.array(radii)
