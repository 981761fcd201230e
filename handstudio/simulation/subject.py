"""Virtual people: a hand each, drawn from a population, known exactly.

A number is a person; the same number is the same person, on any machine. Right and left hand of
one person mirror each other.

What is drawn, and from where. Lengths: hand length of adults after ANSUR II (U.S. Army, 2012: men
193, women 181 mm, standard deviations about 10), its shares after Buchholz et al. 1992, as
`hand.skeleton`. The figures of how people differ beside their size, and of how joints depart from
ideal hinges, are ours: that flexion axes are oblique, that the two axes of wrist and thumb CMC pass
each other by some millimetres (A. Hollister et al., J. Orthop. Res. 10 (1992) 454, for the thumb)
and that finger joints roll is known, how much in a population is not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.flesh import half_depths
from handstudio.hand.skeleton import (
    ADULT_HAND_LENGTH_M,
    FINGERS,
    JOINTS,
    PARENTS,
    SEGMENTS,
    HandSide,
    Skeleton,
    nominal_skeleton,
)
from handstudio.maths import so3
from handstudio.simulation.mechanism import SQUARE, Mechanism, ideal_mechanism
from handstudio.simulation.postures import DIP_PER_PIP

DEVELOPMENT = range(1, 21)
"""Subjects that parameters may be chosen on."""

REPORTING = range(101, 121)
"""Subjects that figures are reported on, and nothing is chosen on."""

_HAND_LENGTH_M = {"man": (0.193, 0.010), "woman": (0.181, 0.010)}
_SHARE_SD = 0.04  # of a segment's length in the hand's
_PLACE_SD = 0.012  # of a joint's place across the palm, in hand lengths
_OBLIQUE_SD_DEG = 2.5  # of a flexion axis against the bone
_SQUARE_SD_DEG = 3.0  # of the second axis against the first
_PASSING_M = {
    "wrist": 0.004,
    "thumb_cmc": 0.005,
    "thumb_mcp": 0.002,
}  # between two axes; sd a third
_PASSING_MCP_M = 0.001
_ROLLING_M = {"mcp": 0.0010, "pip": 0.0008, "dip": 0.0006, "ip": 0.0008}  # per rad; sd a half
_CONJUNCT_SD = 0.03  # rad of deviation or rotation per rad of flexion, in finger joints
_COUPLING_SD = 0.08
_LIMIT_SD = 0.07  # of a range of motion

# Turns [deg] by joint: flexion from, to; deviation from, to (ulnar and, for the thumb, to the palm
# positive). The normal active ranges of hand/CONVENTIONS.md; ours where those are silent.
_RANGE = {
    "elbow": ((-10, 130), (-80, 80)),
    "wrist": ((-70, 80), (-20, 30)),
    "ulnar_cmc": ((-3, 20), (0, 0)),
    "thumb_cmc": ((-20, 30), (-5, 60)),
    "thumb_mcp": ((-5, 55), (-10, 15)),
    "thumb_ip": ((-20, 80), (0, 0)),
    "mcp": ((-35, 90), (-20, 20)),
    "pip": ((0, 105), (0, 0)),
    "dip": ((-5, 80), (0, 0)),
}


@dataclass(frozen=True, slots=True, eq=False)
class Subject:
    """A person's hand, exactly.

    Attributes:
        number: Which person; 0 is the ideal one: mean proportions, square axes that meet.
        skeleton: Joint centres and segment frames at the flat hand; x of a frame is the functional
            flexion axis of its joint, and the link lies in its plane x, y.
        mechanism: How the joints turn.
        dip_per_pip: How the last joint of index to little finger follows the one before.
        range_of_motion: Flexion and deviation [rad] of every joint, from and to, clinical signs.
        half_depth_m: From the middle of each segment's bone to the skin of the palm side.
    """

    number: int
    hand_length_m: float
    skeleton: Skeleton
    mechanism: Mechanism
    dip_per_pip: Float[Array, "4"]
    range_of_motion: Float[Array, "k 2 2"]
    half_depth_m: Float[Array, " k"]

    @property
    def side(self) -> HandSide:
        """Which hand."""
        return self.skeleton.side


def ideal_subject(side: HandSide = "right", hand_length_m: float = ADULT_HAND_LENGTH_M) -> Subject:
    """Mean proportions, square axes that meet and stay."""
    return Subject(
        0,
        hand_length_m,
        nominal_skeleton(side, hand_length_m),
        ideal_mechanism(),
        np.full(4, DIP_PER_PIP),
        _ranges(),
        half_depths(hand_length_m),
    )


def subject(number: int, side: HandSide = "right") -> Subject:
    """The person of this number; 0: `ideal_subject`."""
    if number == 0:
        return ideal_subject(side)
    rng = np.random.default_rng(np.random.SeedSequence(number, spawn_key=(_PEOPLE,)))
    mean, sd = _HAND_LENGTH_M[rng.choice(["man", "woman"])]
    length = float(rng.normal(mean, sd))
    ideal = ideal_subject("right", length)
    skeleton = _functional(_varied(ideal.skeleton, length, rng), rng)
    someone = replace(
        ideal,
        number=number,
        skeleton=skeleton,
        mechanism=_mechanism(rng),
        dip_per_pip=rng.normal(DIP_PER_PIP, _COUPLING_SD, 4),
        range_of_motion=ideal.range_of_motion * rng.normal(1.0, _LIMIT_SD, (len(JOINTS), 1, 1)),
        half_depth_m=ideal.half_depth_m * rng.normal(1.0, _SHARE_SD, len(SEGMENTS)),
    )
    return someone if side == "right" else mirrored(someone)


def with_fixed_axes(someone: Subject) -> Subject:
    """The same person with joints whose axes stay where they are."""
    k = len(JOINTS)
    still = replace(someone.mechanism, rolling=np.zeros((k, 3)), conjunct=np.zeros((k, 2, 2)))
    return replace(someone, mechanism=still)


def mirrored(someone: Subject) -> Subject:
    """The person's other hand."""
    flip, turn = np.array([-1.0, 1.0, 1.0]), np.array([1.0, 1.0, -1.0, -1.0])
    skeleton, mechanism = someone.skeleton, someone.mechanism
    # an axis is mirrored as a rotation is; turns about z and y count the other way on a left hand
    axes = mechanism.axes * [1.0, -1.0, -1.0]
    axes[:, 1:] *= -1.0
    return replace(
        someone,
        skeleton=Skeleton(
            "left" if skeleton.side == "right" else "right",
            skeleton.t_parent_joint * flip,
            skeleton.q_parent_rest * turn,
            skeleton.t_distal_tip * flip,
        ),
        mechanism=Mechanism(
            axes,
            mechanism.points * flip,
            mechanism.rolling * flip,
            -mechanism.conjunct,
        ),
    )


_PEOPLE = 7  # which of a seed's streams


def _varied(skeleton: Skeleton, length: float, rng: np.random.Generator) -> Skeleton:
    """Other proportions: links longer or shorter, joints elsewhere across the palm."""
    joint = skeleton.t_parent_joint * rng.normal(1.0, _SHARE_SD, (len(JOINTS), 1))
    palm = [i for i, parent in enumerate(PARENTS) if parent >= 0 and SEGMENTS[parent] in _PALM]
    joint[palm] += _PLACE_SD * length * rng.normal(size=(len(palm), 3)) * [1.0, 0.5, 0.5]
    tips = skeleton.t_distal_tip * rng.normal(1.0, _SHARE_SD, (len(FINGERS), 1))
    return Skeleton(skeleton.side, joint, skeleton.q_parent_rest, tips)


_PALM = ("hand", "hand_ulnar")


def _functional(skeleton: Skeleton, rng: np.random.Generator) -> Skeleton:
    """The same hand, frames laid by flexion axes that are not quite square to the bones (5.1).

    The bones stay where they are; what turns is how their frames lie in them.
    """
    tilt = np.deg2rad(_OBLIQUE_SD_DEG) * rng.normal(size=(len(JOINTS), 2))
    axis = np.stack([np.ones(len(JOINTS)), np.tan(tilt[:, 0]), np.tan(tilt[:, 1])], axis=-1)
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    z = np.cross(axis, skeleton.t_far_end)
    z /= np.linalg.norm(z, axis=-1, keepdims=True)
    q_bone_segment = so3.from_matrix(np.stack([axis, np.cross(z, axis), z], axis=-1))
    # the root's parent is the world: its frame is not turned
    q_bone_parent = np.where(
        np.array(PARENTS)[:, None] < 0, so3.IDENTITY, q_bone_segment[list(PARENTS)]
    )
    q_parent_bone = so3.conjugate(q_bone_parent)
    rest = so3.multiply(so3.multiply(q_parent_bone, skeleton.q_parent_rest), q_bone_segment)
    rest[0] = so3.IDENTITY  # what the forearm's angles are relative to is its own frame
    distal = [SEGMENTS.index(f"{name}_distal") for name in FINGERS]
    return Skeleton(
        skeleton.side,
        so3.rotate(q_parent_bone, skeleton.t_parent_joint),
        rest,
        so3.rotate(so3.conjugate(q_bone_segment[distal]), skeleton.t_distal_tip),
    )


def _mechanism(rng: np.random.Generator) -> Mechanism:
    k = len(JOINTS)
    axes = np.tile(SQUARE, (k, 1, 1))
    # the first axis is x by the definition of the frame; the others are not quite square to it
    axes[:, 1:] += np.deg2rad(_SQUARE_SD_DEG) * rng.normal(size=(k, 2, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    points, rolling, conjunct = np.zeros((k, 3, 3)), np.zeros((k, 3)), np.zeros((k, 2, 2))
    for index, joint in enumerate(JOINTS):
        kind = joint.name.rpartition("_")[2]
        passing = _PASSING_M.get(joint.name, _PASSING_MCP_M if kind == "mcp" else 0.0)
        # the second axis passes distal to the first, as the metacarpal's does
        points[index, 1, 1] = passing * rng.normal(1.0, 1.0 / 3.0)
        wander = _ROLLING_M.get(kind, 0.0) * rng.normal(1.0, 0.5)
        towards = np.deg2rad(rng.normal(-60.0, 20.0))  # to the palm, and a little distal
        rolling[index, 1:] = wander * np.array([np.cos(towards), np.sin(towards)])
        if kind in ("pip", "dip", "ip"):
            conjunct[index] = _CONJUNCT_SD * rng.normal(size=(2, 2)) * [1.0, 0.3]
    return Mechanism(axes, points, rolling, conjunct)


def _ranges() -> Array:
    kinds = [_RANGE.get(j.name) or _RANGE[j.name.rpartition("_")[2]] for j in JOINTS]
    ranges: Array = np.deg2rad(np.array(kinds, dtype=float))
    return ranges
