"""How large a held thing is: the sphere or cylinder that touches the fingers all at once.

A finger is a bone with flesh around it; where a thing touches it, the bone's line passes the
surface at the flesh's thickness, wherever along the bone and round it that is. So the thing's
radius and place are those that make all these distances right, in the sense of least squares.
That flesh gives way where it is pressed is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.flesh import half_depths
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import FINGERS, SEGMENTS, Skeleton
from handstudio.maths import so3

Form: TypeAlias = Literal["sphere", "cylinder"]

_TILT_SD, _EXACT_M = np.deg2rad(12.0), 0.001  # of a bar across the palm; of a distance
_INSTANTS = 15  # of a hold that are looked at
_OUT_M = (0.0, 0.015, 0.03)  # below the middle of the bones: where the search starts
_ALONG, _ACROSS = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 1.0])
_LARGEST_M = 0.080  # radius: more is a wall, not a thing in a hand

_PADS = tuple(f"{finger}_distal" for finger in FINGERS)
_WRAPPED = tuple(f"{f}_{part}" for f in FINGERS[1:] for part in ("intermediate", "distal"))

_PALM = "hand"  # as a bone: from the wrist to between the heads of index and middle metacarpal

TOUCHING: dict[str, tuple[Form, tuple[str, ...]]] = {
    "heavy_wrap_large": ("cylinder", (_PALM, *_WRAPPED, "thumb_distal")),
    "heavy_wrap_small": ("cylinder", (_PALM, *_WRAPPED)),
    "medium_wrap": ("cylinder", (_PALM, *_WRAPPED, "thumb_distal")),
    "power_sphere": ("sphere", (_PALM, *_PADS, "middle_intermediate", "ring_intermediate")),
    "precision_sphere": ("sphere", _PADS),
}
"""What a class of grasps holds, and the segments that touch it. Of other classes too few touch, or
too much of one kind, to tell a size."""

_HEADS = [SEGMENTS.index("index_proximal"), SEGMENTS.index("middle_proximal")]


@dataclass(frozen=True, slots=True, eq=False)
class ObjectSize:
    """What a hand holds [m], and where, in the frame of the segment ``hand``.

    Attributes:
        form: Its shape.
        diameter_m: Median over the hold.
        sd_m: Over the hold.
        residual_m: Root mean square of what is left of the distances.
        t_hand_middle: Of the sphere, or of the part of the bar that is held.
        axis: Along the bar, a unit vector; of a sphere it says nothing.
    """

    form: Form
    diameter_m: float
    sd_m: float
    residual_m: float
    t_hand_middle: Float[Array, "3"]
    axis: Float[Array, "3"]


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A thing that touches bones at one instant [m], in the frame these are in.

    Attributes:
        radius_m: Of it.
        residual_m: Root mean square of what is left of the distances.
        middle: Its middle; of a bar, where the bones are.
        axis: Along a bar, a unit vector.
        solution: What the search found, to begin another one from.
    """

    radius_m: float
    residual_m: float
    middle: Float[Array, "3"]
    axis: Float[Array, "3"]
    solution: Float[Array, " u"]


@dataclass(frozen=True, slots=True, eq=False)
class Bones:
    """Bones that touch: both ends [m], and the flesh around them [m]."""

    start: Float[Array, "p 3"]
    end: Float[Array, "p 3"]
    flesh: Float[Array, " p"]


def object_size(
    name: str, skeleton: Skeleton, hand_length_m: float, pose: Pose
) -> ObjectSize | None:
    """Of what is held in a grasp of this class; None where that does not tell, or nothing fits.

    Args:
        name: Of the class.
        skeleton: Of the hand.
        hand_length_m: Says how thick its flesh is.
        pose: During the hold.
    """
    if name not in TOUCHING:
        return None
    form, segments = TOUCHING[name]
    index = [SEGMENTS.index(segment) for segment in segments]
    flesh = half_depths(hand_length_m)[index]
    ends = skeleton.t_far_end[index]
    if _PALM in segments:
        ends[segments.index(_PALM)] = skeleton.t_parent_joint[_HEADS].mean(axis=0)
    hand, count = SEGMENTS.index("hand"), len(pose.q_world_segment)
    fit = sphere_held if form == "sphere" else cylinder_held
    found = list[Fitted]()
    for at in np.unique(np.linspace(0, count - 1, _INSTANTS).astype(int)):
        q, start = pose.q_world_segment[at], pose.t_world_joint[at, index]
        # in the hand: where the forearm goes says nothing
        back = so3.conjugate(q[hand])
        start = so3.rotate(back, start - pose.t_world_joint[at, hand])
        way = so3.rotate(so3.multiply(back, q[index]), ends)
        bones = Bones(start, start + way, flesh)
        found.append(fit(bones, found[-1].solution if found else None))
    radius = np.array([one.radius_m for one in found])
    diameter = 2.0 * float(np.median(radius))
    if not 0.0 < diameter < 2.0 * _LARGEST_M:
        return None
    axis = np.mean([one.axis for one in found], axis=0)
    return ObjectSize(
        form,
        diameter,
        2.0 * float(np.std(radius)),
        float(np.median([one.residual_m for one in found])),
        np.median([one.middle for one in found], axis=0),
        axis / np.linalg.norm(axis),
    )


def sphere_held(bones: Bones, near: Float[Array, "4"] | None = None) -> Fitted:
    """The sphere in a hand, palm towards -z; ``near``: looked for from this solution only."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - takes a second to load

    def gaps(x: Array) -> Array:
        off: Array = _to_bone(x[:3], bones) - bones.flesh - x[3]
        return off

    starts = [np.append(middle, 0.03) for middle in _middles(bones)] if near is None else [near]
    best = min((least_squares(gaps, start) for start in starts), key=lambda fit: float(fit.cost))
    residual = float(np.sqrt(np.mean(best.fun**2)))
    return Fitted(float(best.x[3]), residual, best.x[:3], _ALONG, best.x)


def cylinder_held(bones: Bones, near: Float[Array, "5"] | None = None) -> Fitted:
    """The bar across the palm (along x, more or less); ``near`` as for a sphere."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - takes a second to load

    middle = bones.start.mean(axis=0)

    def gaps(x: Array) -> Array:
        # seen along the bar
        tilt = so3.conjugate(_tilt(x))
        start = so3.rotate(tilt, bones.start - middle) * _ACROSS
        end = so3.rotate(tilt, bones.end - middle) * _ACROSS
        place = np.array([0.0, x[0], x[1]])
        off: Array = _to_bone(place, Bones(start, end, bones.flesh)) - bones.flesh - x[4]
        return off

    def residuals(x: Array) -> Array:
        return np.concatenate([gaps(x) / _EXACT_M, x[2:4] / _TILT_SD])

    places = [(at - middle)[1:] for at in _middles(bones)]
    starts = [np.array([*place, 0.0, 0.0, 0.03]) for place in places] if near is None else [near]
    fits = (least_squares(residuals, start) for start in starts)
    best = min(fits, key=lambda fit: float(fit.cost)).x
    residual = float(np.sqrt(np.mean(gaps(best) ** 2)))
    held = middle + so3.rotate(_tilt(best), np.array([0.0, best[0], best[1]]))
    return Fitted(float(best[4]), residual, held, so3.rotate(_tilt(best), _ALONG), best)


def _tilt(x: Array) -> Array:
    """Of a bar, from along x."""
    return so3.exp(np.array([0.0, x[2], x[3]]))


def _middles(bones: Bones) -> list[Array]:
    """Where to look for the thing: between the bones, and towards where the palm faces."""
    middle = 0.5 * (bones.start + bones.end).mean(axis=0)
    return [middle - [0.0, 0.0, out] for out in _OUT_M]


def _to_bone(point: Array, bones: Bones) -> Array:
    """From a point to the nearest of each bone."""
    way = bones.end - bones.start
    share = np.sum((point - bones.start) * way, axis=-1) / np.sum(way**2, axis=-1)
    nearest = bones.start + np.clip(share, 0.0, 1.0)[:, None] * way
    distance: Array = np.linalg.norm(point - nearest, axis=-1)
    return distance
