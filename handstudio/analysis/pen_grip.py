"""How a pen is held: three fingertips touch it, and it moves as what touches them all.

The thesis lets the pen follow the mean motion of the distal segments of thumb, index and middle
finger (5.3.5). That misses how it rolls between them: a pen turns 10 to 15 degrees on each of
these segments within a character. Here every fingertip touches it in one point of skin, so that
three points, fixed each in its own segment, are fixed to one another too. Where on the segments
they are is found from that alone: the distances between them must stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.hand.flesh import half_depths, outwards
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import FINGERS, SEGMENTS, Skeleton
from handstudio.maths import so3

HOLDING = ("thumb", "index", "middle")
"""Fingers that hold a pen: the tripod."""

# Where these touch before anything is fitted: share of the distal segment, and the side (from the
# palm round to the thumb's side): the middle finger lies below, with its side. Ours.
_ALONG, _TOWARDS_DEG = (0.65, 0.65, 0.65), (0.0, 0.0, 45.0)
_PAD_SD_M = 0.003  # how far off that is, errors of links and attitudes included
_RIGID_SD_M, _COUNTED = 0.0005, 50.0  # of a distance between them; instants that tell as one fit
_FITTED = 300  # instants at most

_NEAR_M = 0.040  # between the points of two fingers on one pen, at most
_STEADY_M, _STEADY_S = 0.008, 0.5  # how much that changes within so long
_SHORTEST_S = 2.0
_SIDES = ((0, 1), (1, 2), (0, 2))


@dataclass(frozen=True, slots=True, eq=False)
class PenHand:
    """What of a hand tells of a pen in it, over a stretch of time; from the elbow [m].

    Attributes:
        time_s: Rising.
        attitude: Of the distal segments of `HOLDING`, as matrices.
        place: Of their joints.
        knuckle: Where a pen leans on the index finger's base.
        pads: Points of skin of the distal segments that hold it, in these, as usual.
    """

    time_s: Float[Array, " n"]
    attitude: Float[Array, "n 3 3 3"]
    place: Float[Array, "n 3 3"]
    knuckle: Float[Array, "n 3"]
    pads: Float[Array, "3 3"]

    def part(self, which: Bool[Array, " n"] | slice) -> PenHand:
        """Some instants of it."""
        return PenHand(
            self.time_s[which],
            self.attitude[which],
            self.place[which],
            self.knuckle[which],
            self.pads,
        )

    def points(self, pads: Float[Array, "3 3"]) -> Float[Array, "n 3 3"]:
        """Points fixed in the distal segments."""
        out: Array = self.place + (self.attitude @ pads[..., None])[..., 0]
        return out


@dataclass(frozen=True, slots=True, eq=False)
class PenMotion:
    """A pen as a rigid body, but for where its tip is.

    Attributes:
        attitude: As matrices; the axes are those of its three contacts.
        middle: Of its three contacts, from the elbow [m].
        leans: Its direction as the index finger's base tells it, towards the tip, in its own frame.
        rigid_sd_m: How much the distances of the three contacts still vary.
    """

    attitude: Float[Array, "n 3 3"]
    middle: Float[Array, "n 3"]
    leans: Float[Array, "3"]
    rigid_sd_m: float


def pen_hand(
    skeleton: Skeleton, hand_length_m: float, time_s: Float[Array, " n"], pose: Pose
) -> PenHand:
    """What `held` and `pen_motion` need of a placed hand."""
    depth, elbow = half_depths(hand_length_m), pose.t_world_joint[:, :1]
    distal = [SEGMENTS.index(f"{finger}_distal") for finger in HOLDING]
    tips = skeleton.t_distal_tip[[FINGERS.index(finger) for finger in HOLDING]]
    out = np.array([outwards(skeleton.side, towards) for towards in _TOWARDS_DEG])
    base = SEGMENTS.index("index_proximal")
    beside = 0.5 * skeleton.t_far_end[base] + depth[base] * outwards(skeleton.side, 75.0)
    knuckle = pose.t_world_joint[:, base] + so3.rotate(pose.q_world_segment[:, base], beside)
    return PenHand(
        time_s,
        so3.to_matrix(pose.q_world_segment[:, distal]),
        pose.t_world_joint[:, distal] - elbow,
        knuckle - elbow[:, 0],
        np.array(_ALONG)[:, None] * tips + depth[distal, None] * out,
    )


def held(hand: PenHand) -> list[tuple[int, int]]:
    """Stretches in which the three could hold a pen: near one another, and steadily so.

    Each as its first instant and the one after its last.
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # noqa: PLC0415

    if len(hand.time_s) < 2:
        return []
    step_s = float(np.median(np.diff(hand.time_s)))
    side = _sides(hand.points(hand.pads))
    wide = 1 + 2 * round(0.5 * _STEADY_S / step_s)
    change = maximum_filter1d(side, wide, axis=0) - minimum_filter1d(side, wide, axis=0)
    steady = (change < _STEADY_M).all(axis=1) & (side < _NEAR_M).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], steady, [False]]).astype(int)))
    stretches = edges.reshape(-1, 2).tolist()
    return [(a, b) for a, b in stretches if (b - a) * step_s >= _SHORTEST_S]


def pen_motion(hand: PenHand) -> PenMotion:
    """How the pen moves that is held throughout."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - takes a second to load

    few = hand.part(slice(None, None, max(1, len(hand.time_s) // _FITTED)))
    count = len(few.time_s)
    scale = 1.0 / (_RIGID_SD_M * max(1.0, count / _COUNTED) ** 0.5)

    def residuals(x: Array) -> Array:
        side = _sides(few.points(hand.pads + x.reshape(3, 3)))
        return np.concatenate([scale * (side - np.median(side, axis=0)).ravel(), x / _PAD_SD_M])

    moved = least_squares(residuals, np.zeros(9), loss="soft_l1").x
    points = hand.points(hand.pads + moved.reshape(3, 3))
    attitude, middle = placements(points, _shape(points))
    towards = middle - hand.knuckle
    towards = (np.swapaxes(attitude, 1, 2) @ towards[..., None])[..., 0].mean(axis=0)
    leans = towards / np.linalg.norm(towards)
    return PenMotion(attitude, middle, leans, float(np.std(_sides(points), axis=0).max()))


def placements(
    points: Float[Array, "n p 3"], own: Float[Array, "p 3"]
) -> tuple[Float[Array, "n 3 3"], Float[Array, "n 3"]]:
    """The rigid placement of a body nearest to where its points are, attitude and middle.

    ``own`` are its points about their middle. Least squares (W. Kabsch, Acta Cryst. A 32 (1976)
    922).
    """
    middle = points.mean(axis=1)
    spread = np.swapaxes(points - middle[:, None], 1, 2) @ own
    u, _, vt = np.linalg.svd(spread)
    u[:, :, 2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))[:, None]
    return u @ vt, middle


def _shape(points: Array) -> Array:
    """Mean shape of points that hardly move against one another, about their middle."""
    own = points[len(points) // 2] - points[len(points) // 2].mean(axis=0)
    for _ in range(3):
        attitude, middle = placements(points, own)
        own = ((points - middle[:, None]) @ attitude).mean(axis=0)
    return np.asarray(own)


def _sides(points: Array) -> Array:
    ends = [points[:, i] - points[:, j] for i, j in _SIDES]
    return np.stack([np.linalg.norm(end, axis=-1) for end in ends], axis=-1)
