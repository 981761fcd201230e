"""The skeleton: rigid segments, the joints that join them, and how long they are.

A segment's frame has its origin in its proximal joint; at the flat hand x is the flexion axis
(extension positive), y runs along the bone towards the fingertip, z is dorsal. Every segment has
exactly one proximal joint, so segment and joint share an index; segment 0 is the forearm and its
joint the elbow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Literal, TypeAlias

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3

HandSide: TypeAlias = Literal["left", "right"]

HandType: TypeAlias = Literal[1, 2, 3]
"""How the palm is divided: 1, one rigid block; 2, two blocks that both begin at the wrist; 3, a
radial block from the wrist and an ulnar one hinged to it at the ulnar CMC."""

FINGERS = ("thumb", "index", "middle", "ring", "little")

ADULT_HAND_LENGTH_M = 0.187
"""Midway between the means of adult men and women, 193 and 181 mm (ANSUR II, 2012)."""

_FOREARM_PER_HAND = 0.146 / 0.108  # shares of body height, Drillis and Contini 1966

# Lengths as a share of hand length: Buchholz, Armstrong and Goldstein, Ergonomics 35 (1992) 261.
# The metacarpal figures of the fingers run from the wrist centre to the MCP centre.
_METACARPAL = {"thumb": 0.251, "index": 0.463, "middle": 0.446, "ring": 0.421, "little": 0.414}
_PROXIMAL = {"thumb": 0.196, "index": 0.245, "middle": 0.266, "ring": 0.244, "little": 0.204}
_INTERMEDIATE = {"index": 0.143, "middle": 0.170, "ring": 0.165, "little": 0.117}
_DISTAL = {"thumb": 0.158, "index": 0.097, "middle": 0.108, "ring": 0.107, "little": 0.093}

# Not in that source, and ours until a calibration measures them: how the metacarpals splay [deg,
# ulnar positive], the dorsal arch of the MCP row, the two CMC centres (shares of hand length,
# right hand) and the thumb's direction at the flat hand.
_SPLAY = {"index": -14.0, "middle": 0.0, "ring": 13.0, "little": 27.0}
_ARCH = {"index": 0.0, "middle": 0.012, "ring": 0.004, "little": -0.02}
_ULNAR_CMC = np.array([0.07, 0.16, 0.0])
_THUMB_CMC = np.array([-0.10, 0.11, -0.05])
_THUMB_RADIAL_DEG, _THUMB_PALMAR_DEG, _THUMB_PRONATION_DEG = 40.0, 20.0, 60.0


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint by name: what it joins and about how many axes it turns."""

    name: str
    parent: str | None  # None: the root, whose parent is the world
    child: str
    axes: int


def _hand_joints() -> tuple[Joint, ...]:
    joints = [
        Joint("elbow", None, "forearm", 2),
        Joint("wrist", "forearm", "hand", 2),
        Joint("ulnar_cmc", "hand", "hand_ulnar", 1),
        Joint("thumb_cmc", "hand", "thumb_metacarpal", 2),
        Joint("thumb_mcp", "thumb_metacarpal", "thumb_proximal", 2),
        Joint("thumb_ip", "thumb_proximal", "thumb_distal", 1),
    ]
    for finger in FINGERS[1:]:
        base = "hand_ulnar" if finger in ("ring", "little") else "hand"
        joints += [
            Joint(f"{finger}_mcp", base, f"{finger}_proximal", 2),
            Joint(f"{finger}_pip", f"{finger}_proximal", f"{finger}_intermediate", 1),
            Joint(f"{finger}_dip", f"{finger}_intermediate", f"{finger}_distal", 1),
        ]
    return tuple(joints)


JOINTS = _hand_joints()
"""Of a hand of type 3, in the order of the segments. In types 1 and 2 the ulnar block begins at the
wrist, so that the same tree serves: the link to it has no length, and it turns with the radial
block (1) or as its own sensor tells (2)."""

ULNAR = "hand_ulnar"
WRIST_ULNAR = Joint("wrist_ulnar", "forearm", ULNAR, 2)
"""What turns the ulnar block of a hand of type 2: the wrist as that block sees it."""

SEGMENTS = tuple(joint.child for joint in JOINTS)
PARENTS = tuple(-1 if j.parent is None else SEGMENTS.index(j.parent) for j in JOINTS)
DISTALS = tuple(f"{finger}_distal" for finger in FINGERS)


@cache
def joints_of(hand_type: HandType) -> tuple[Joint, ...]:
    """The joints that sensors of such a hand lie on both sides of, from the root out."""
    match hand_type:
        case 1:
            whole = (j for j in JOINTS if j.child != ULNAR)
            return tuple(replace(j, parent="hand") if j.parent == ULNAR else j for j in whole)
        case 2:
            return tuple(WRIST_ULNAR if j.child == ULNAR else j for j in JOINTS)
        case 3:
            return JOINTS


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """Where every joint sits in its parent segment, at which rest attitude, and the fingertips.

    Attributes:
        side: Which hand.
        t_parent_joint: Joint centres in the parent segment's frame [m], (segment, 3); the root's
            is its place in the world.
        q_parent_rest: Attitude of each segment in its parent at the flat hand, (segment, 4).
        t_distal_tip: Fingertips in the frames of the distal segments [m], (finger, 3).
    """

    side: HandSide
    t_parent_joint: Float[Array, "k 3"]
    q_parent_rest: Float[Array, "k 4"]
    t_distal_tip: Float[Array, "5 3"]

    @property
    def t_far_end(self) -> Float[Array, "k 3"]:
        """The farthest joint or tip that each segment carries, in its frame [m]."""
        ends = np.zeros((len(SEGMENTS), 3))
        for child, parent in enumerate(PARENTS):
            joint = self.t_parent_joint[child]
            if parent >= 0 and np.linalg.norm(joint) > np.linalg.norm(ends[parent]):
                ends[parent] = joint
        for tip, segment in zip(self.t_distal_tip, DISTALS, strict=True):
            ends[SEGMENTS.index(segment)] = tip
        return ends

    @property
    def length_m(self) -> Float[Array, " k"]:
        """Length of each segment [m]: from its joint to its far end."""
        lengths: Array = np.linalg.norm(self.t_far_end, axis=-1)
        return lengths


@cache
def nominal_skeleton(
    side: HandSide, hand_length_m: float = ADULT_HAND_LENGTH_M, hand_type: HandType = 3
) -> Skeleton:
    """A hand of mean adult proportions.

    Args:
        side: Which hand; the left is the right mirrored.
        hand_length_m: Wrist crease to the tip of the middle finger [m].
        hand_type: How the palm is divided; at the flat hand every type looks alike.
    """
    ulnar_block = _ULNAR_CMC if hand_type == 3 else np.zeros(3)
    places = {**_palm_places(), ULNAR: ulnar_block, **_finger_places(ulnar_block)}
    joint = np.array([places[name] for name in SEGMENTS]) * hand_length_m
    rest = np.tile(so3.IDENTITY, (len(SEGMENTS), 1))
    rest[SEGMENTS.index("thumb_metacarpal")] = _thumb_rest()
    tips = np.array([[0.0, _DISTAL[finger], 0.0] for finger in FINGERS]) * hand_length_m
    if side == "left":
        joint, rest = joint * [-1.0, 1.0, 1.0], rest * [1.0, 1.0, -1.0, -1.0]
    for array in (joint, rest, tips):
        array.setflags(write=False)  # the value is shared by everyone who asks
    return Skeleton(side, joint, rest, tips)


def _palm_places() -> dict[str, Array]:
    return {
        "forearm": np.zeros(3),
        "hand": np.array([0.0, _FOREARM_PER_HAND, 0.0]),
        "thumb_metacarpal": _THUMB_CMC,
        "thumb_proximal": np.array([0.0, _METACARPAL["thumb"], 0.0]),
        "thumb_distal": np.array([0.0, _PROXIMAL["thumb"], 0.0]),
    }


def _finger_places(ulnar_block: Array) -> dict[str, Array]:
    places = {}
    for finger in FINGERS[1:]:
        splay = np.deg2rad(_SPLAY[finger])
        mcp = _METACARPAL[finger] * np.array([np.sin(splay), np.cos(splay), 0.0])
        mcp[2] = _ARCH[finger]
        ulnar = finger in ("ring", "little")
        places[f"{finger}_proximal"] = mcp - ulnar_block if ulnar else mcp
        places[f"{finger}_intermediate"] = np.array([0.0, _PROXIMAL[finger], 0.0])
        places[f"{finger}_distal"] = np.array([0.0, _INTERMEDIATE[finger], 0.0])
    return places


def _thumb_rest() -> Array:
    x, y, z = np.eye(3)
    radial = so3.from_axis_angle(z, np.deg2rad(_THUMB_RADIAL_DEG))
    palmar = so3.from_axis_angle(x, np.deg2rad(-_THUMB_PALMAR_DEG))
    pronation = so3.from_axis_angle(y, np.deg2rad(-_THUMB_PRONATION_DEG))
    return so3.multiply(so3.multiply(radial, palmar), pronation)
