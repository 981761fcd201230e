"""Where postures put a hand, and how its points move with every channel: for solving postures.

Everything is in the frame that the forearm has at the start, the elbow's place the origin: x to
the right, y along the forearm, z up. Where the elbow goes is left out. Many postures at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand import flesh
from handstudio.hand.angles import DEVIATION, FLEXION, ROTATION, joint_index
from handstudio.hand.skeleton import JOINTS, PARENTS, SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.mechanism import GENERATIONS
from handstudio.simulation.moving import cross
from handstudio.simulation.subject import Subject
from handstudio.simulation.trajectory import CHANNELS

TURNS = CHANNELS - 3
"""Channels that turn joints; those of the elbow's place come after them."""

_PRONATED, _SUPINATED = np.deg2rad([10.0, -165.0])  # from palm down; CONVENTIONS.md, zero there
_THUMB_ROTATION = np.deg2rad(20.0)  # either way; what the CMC adds of itself, ours


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A hand in some postures.

    Attributes:
        attitude: Of every segment, as matrices.
        place: Of every segment's joint [m].
        turning: Angular velocity of whatever hangs on a joint, per rate of a channel.
        sliding: Velocity that its extension at the origin has then [m].
    """

    attitude: Float[Array, "n k 3 3"]
    place: Float[Array, "n k 3"]
    turning: Float[Array, "n d 3"]
    sliding: Float[Array, "n d 3"]

    def points(
        self, segments: list[int], offsets: Float[Array, "*#m p 3"]
    ) -> Float[Array, "n p 3"]:
        """Points fixed in segments."""
        turned: Array = (self.attitude[:, segments] @ offsets[..., None])[..., 0]
        return self.place[:, segments] + turned

    def directions(
        self, segments: list[int], vectors: Float[Array, "p 3"]
    ) -> Float[Array, "n p 3"]:
        """Directions fixed in segments."""
        turned: Array = (self.attitude[:, segments] @ vectors[..., None])[..., 0]
        return turned

    def slopes(
        self, points: Float[Array, "n p 3"], segments: list[int], channels: list[int]
    ) -> Float[Array, "n p 3 c"]:
        """How such points move with channels [m/rad]."""
        omega, v = self.turning[:, None, channels], self.sliding[:, None, channels]
        moved = cross(omega, points[:, :, None]) + v
        carried = _CARRIES[np.ix_(segments, channels)]
        return np.moveaxis(np.where(carried[..., None], moved, 0.0), -1, -2)


@dataclass(frozen=True, slots=True, eq=False)
class Placer:
    """Places one subject's hand; see `placer`."""

    subject: Subject
    rest: Float[Array, "k 3 3"]
    axes: Float[Array, "k 3 3"]
    skew: Float[Array, "k 3 3 3"]

    def placed(self, postures: Float[Array, "n c"]) -> Placed:
        """The hand in these postures."""
        mechanism, joints = self.subject.mechanism, self.subject.skeleton.t_parent_joint
        turns = postures[:, :TURNS].reshape(len(postures), len(JOINTS), 3)
        attitude, place, axes, centres = self._joints(turns)
        rest = np.empty_like(attitude)
        rest_place, out, out_place = np.empty_like(place), np.empty_like(attitude), place.copy()
        for children, parents in GENERATIONS:
            if parents == [-1]:
                rest[:, children], rest_place[:, children] = np.eye(3), 0.0
            else:
                rest[:, children] = out[:, parents] @ self.rest[children]
                arm = (out[:, parents] @ joints[children][..., None])[..., 0]
                rest_place[:, children] = out_place[:, parents] + arm
            out[:, children] = rest[:, children] @ attitude[:, children]
            arm = (rest[:, children] @ place[:, children, :, None])[..., 0]
            out_place[:, children] = rest_place[:, children] + arm
        turning = np.einsum("nkij,nktj->nkti", rest, axes)
        through = rest_place[:, :, None] + np.einsum("nkij,nktj->nkti", rest, centres)
        sliding = cross(through, turning)
        # with flexion the two others come along, and the centre wanders
        slope = _conjunct_slope(mechanism.conjunct, turns[..., FLEXION])
        turning[:, :, 0] += np.einsum("nkt,nkti->nki", slope, turning[:, :, 1:])
        sliding[:, :, 0] += np.einsum("nkt,nkti->nki", slope, sliding[:, :, 1:])
        sliding[:, :, 0] += np.einsum("nkij,kj->nki", rest, mechanism.rolling)
        flat = (len(postures), TURNS, 3)
        return Placed(out, out_place, turning.reshape(flat), sliding.reshape(flat))

    def _joints(self, turns: Array) -> tuple[Array, Array, Array, Array]:
        """Every segment, and axes and their points of its joint, in the joint's rest frame."""
        mechanism = self.subject.mechanism
        flexion = turns[..., FLEXION, None]
        driven = turns.copy()
        linear, square = np.moveaxis(mechanism.conjunct, -1, 0)
        driven[..., 1:] += (linear + square * flexion) * flexion
        sine, cosine = np.sin(driven)[..., None, None], np.cos(driven)[..., None, None]
        turn = np.eye(3) + sine * self.skew + (1.0 - cosine) * (self.skew @ self.skew)
        attitude = np.broadcast_to(np.eye(3), (*turns.shape[:2], 3, 3))
        place = flexion * mechanism.rolling
        axes, centres = np.empty_like(turns[..., None] * np.ones(3)), np.empty((*turns.shape, 3))
        for i in (FLEXION, DEVIATION, ROTATION):
            point = mechanism.points[:, i, :, None]
            axes[:, :, i] = (attitude @ self.axes[:, i, :, None])[..., 0]
            centres[:, :, i] = place + (attitude @ point)[..., 0]
            attitude = attitude @ turn[:, :, i]
            place = centres[:, :, i] - (attitude @ point)[..., 0]
        return attitude, place, axes, centres


def placer(subject: Subject) -> Placer:
    """What places this subject's hand."""
    axes = subject.mechanism.axes
    x, y, z = np.moveaxis(axes, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    skew = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    return Placer(subject, so3.to_matrix(subject.skeleton.q_parent_rest), axes, skew)


def skin(
    subject: Subject, segment: str, along: float, towards_deg: float = 0.0
) -> Float[Array, "3"]:
    """A point of the skin in its segment's frame [m].

    Args:
        subject: Whose.
        segment: By name.
        along: Share of the way from the joint to the far end.
        towards_deg: From the palm side round to the radial side.
    """
    index = SEGMENTS.index(segment)
    out = outwards(subject, towards_deg)
    place: Array = along * subject.skeleton.t_far_end[index] + subject.half_depth_m[index] * out
    return place


def outwards(subject: Subject, towards_deg: float = 0.0) -> Float[Array, "3"]:
    """Out of the skin there, in the segment's frame."""
    return flesh.outwards(subject.side, towards_deg)


def limits(subject: Subject) -> tuple[Float[Array, " c"], Float[Array, " c"]]:
    """What every channel can reach: range of motion, and what else a hand does not do."""
    least, most = np.zeros(CHANNELS), np.zeros(CHANNELS)
    least[TURNS:], most[TURNS:] = -np.inf, np.inf
    mirrored = 1.0 if subject.side == "right" else -1.0
    for k, joint in enumerate(JOINTS):
        flexion = 1.0 if joint.name == "elbow" else -1.0
        deviation = mirrored * (1.0 if joint.name.startswith("thumb") else -1.0)
        for turn, sign in ((FLEXION, flexion), (DEVIATION, deviation)):
            ends = sign * subject.range_of_motion[k, turn]
            least[3 * k + turn], most[3 * k + turn] = ends.min(), ends.max()
    forearm = -mirrored * np.array([_PRONATED, _SUPINATED])
    least[ROTATION], most[ROTATION] = forearm.min(), forearm.max()
    thumb = 3 * joint_index("thumb_cmc") + ROTATION
    least[thumb], most[thumb] = -_THUMB_ROTATION, _THUMB_ROTATION
    return least, most


def _conjunct_slope(conjunct: Array, flexion: Array) -> Array:
    linear, square = np.moveaxis(conjunct, -1, 0)
    slope: Array = linear + 2.0 * square * flexion[..., None]
    return slope


def _carries() -> Array:
    """Whether a segment (row) hangs on the joint of a channel."""
    carries = np.zeros((len(SEGMENTS), len(JOINTS)), dtype=bool)
    for segment in range(len(SEGMENTS)):
        above = segment
        while above >= 0:
            carries[segment, above] = True
            above = PARENTS[above]
    return np.repeat(carries, 3, axis=1)


_CARRIES = _carries()
