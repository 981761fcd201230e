"""The bones that carry a hand's surface: where each begins and ends in the frame of its segment.

Segments are bones but for the two blocks of the palm, which hold a metacarpal for every finger.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import DISTALS, FINGERS, PARENTS, SEGMENTS, Skeleton
from handstudio.maths import so3

MOST_BONES = 4
"""That carry one point of the surface."""


@dataclass(frozen=True, slots=True)
class Bone:
    """A bone by the segment it is fixed to and the digit it leads to; the forearm leads to none."""

    segment: str
    finger: str


def _bones() -> tuple[Bone, ...]:
    bones = [Bone("forearm", "")]
    for finger in FINGERS:
        first = SEGMENTS.index(f"{finger}_proximal")
        bones.append(Bone(SEGMENTS[PARENTS[first]], finger))  # metacarpal
        bones += [Bone(s, finger) for s in SEGMENTS[first:] if s in _phalanges(finger)]
    return tuple(bones)


def _phalanges(finger: str) -> tuple[str, ...]:
    return tuple(f"{finger}_{kind}" for kind in ("proximal", "intermediate", "distal"))


BONES = _bones()
SEGMENT_OF_BONE = tuple(SEGMENTS.index(bone.segment) for bone in BONES)


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """Both ends of every bone in the frame of its segment [m], and how large the hand is.

    Attributes:
        start: Where bones begin, (bone, 3).
        end: Where they end, (bone, 3).
        size_m: Hand length, which tells how thick they are wrapped.
    """

    start: Float[Array, "b 3"]
    end: Float[Array, "b 3"]
    size_m: float

    @property
    def length_m(self) -> Float[Array, " b"]:
        """Of every bone [m]."""
        lengths: Array = np.linalg.norm(self.end - self.start, axis=-1)
        return lengths

    def ends(self, pose: Pose) -> tuple[Float[Array, "b 3"], Float[Array, "b 3"]]:
        """Both ends in the world, for a single pose [m]."""
        at = list(SEGMENT_OF_BONE)
        q, place = pose.q_world_segment[at], pose.t_world_joint[at]
        return place + so3.rotate(q, self.start), place + so3.rotate(q, self.end)


def rig_of(skeleton: Skeleton) -> Rig:
    """The bones of a hand; every one begins in the joint of its segment."""
    joint = dict(zip(SEGMENTS, skeleton.t_parent_joint, strict=True))
    tips = dict(zip(DISTALS, skeleton.t_distal_tip, strict=True))
    ends = [tips[b.segment] if b.segment in tips else joint[_next(b)] for b in BONES]
    return Rig(np.zeros((len(BONES), 3)), np.array(ends), hand_length(skeleton))


def hand_length(skeleton: Skeleton) -> float:
    """From the wrist to the middle fingertip, fingers straight [m]."""
    inner = sum(
        float(np.linalg.norm(skeleton.t_parent_joint[SEGMENTS.index(name)]))
        for name in _phalanges("middle")
    )
    return inner + float(np.linalg.norm(skeleton.t_distal_tip[FINGERS.index("middle")]))


def _next(bone: Bone) -> str:
    """The segment that a bone leads to."""
    if not bone.finger:
        return "hand"
    if not bone.segment.startswith(bone.finger) or bone.segment.endswith("metacarpal"):
        return f"{bone.finger}_proximal"
    later = SEGMENTS[SEGMENTS.index(bone.segment) + 1 :]
    return next(name for name in later if name.startswith(f"{bone.finger}_"))
