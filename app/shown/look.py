"""How the hand is looked at: from where, and what of it is shown. Pure; knows no viser."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Float

from app.shown.bones import hand_length
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import SEGMENTS, Skeleton
from handstudio.kinematics import segment_attitudes
from handstudio.maths import so3
from handstudio.pipeline import Motion
from handstudio.setup import Setup


class View(Enum):
    """Where the picture is taken from."""

    DESK = "desk"  # from behind and above, as one sees one's own hand on a desk
    PALM = "palm"
    BACK = "back"
    THUMB = "thumb"
    FOLLOW = "follow"  # the back of the hand, kept in sight while it moves


LASTING = (View.DESK, View.FOLLOW)
"""Views that suit whatever the hand does next, and so are kept from one start to the next."""

COURSE_NEAR = (-0.14, -0.16, 0.52), (-0.12, 0.24, -0.02)
COURSE_FAR = (-0.13, -0.55, 0.55), (-0.13, 0.12, -0.02)
"""Where from and where to while a course is on: room for the hand that shows it, and below for the
sheet; farther away where whole arms move."""

DESK_PLACE = (-0.15, -0.03, 0.46)
DESK_TARGET = (0.0, 0.31, 0.0)

FIELD_RAD = float(np.deg2rad(75.0))
"""Of the camera from the bottom of the picture to its top: viser's own."""

ABOVE_SHEET = 0.05
"""By how much of the picture's height the hand stands above the middle while a take is open."""

_AWAY = np.pi / 2  # y of the picture

_DISTANCE = 1.8  # from the hand's middle, in hand lengths: the whole hand, with some air


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """Where the camera is, what it looks at, which way is up in the picture."""

    place: Float[Array, "3"]
    target: Float[Array, "3"]
    up: Float[Array, "3"]


def course_camera(side: str, *, near: bool) -> Camera:
    """The camera while a course is on: both hands above the sheet."""
    place, target = map(np.array, COURSE_NEAR if near else COURSE_FAR)
    mirror = np.array([-1.0 if side == "left" else 1.0, 1.0, 1.0])
    return Camera(place * mirror, target * mirror, np.array([0.0, 0.0, 1.0]))


def camera_for(view: View, skeleton: Skeleton | None, pose: Pose | None) -> Camera:
    """The camera of a view for the hand as it is now, its pose in the world that is drawn.

    Without a hand every view is that of the desk.
    """
    if view is View.DESK or skeleton is None or pose is None:
        return Camera(np.array(DESK_PLACE), np.array(DESK_TARGET), np.array([0.0, 0.0, 1.0]))
    hand = SEGMENTS.index("hand")
    ulnar, along, dorsal = so3.to_matrix(pose.q_world_segment[hand]).T
    radial = -ulnar if skeleton.side == "right" else ulnar
    size = hand_length(skeleton)
    target = pose.t_world_joint[hand] + 0.45 * size * along
    towards = {
        View.PALM: -dorsal,
        View.BACK: dorsal,
        View.THUMB: radial,
        View.FOLLOW: between(dorsal, -along, 0.35),
    }[view]
    return Camera(target + _DISTANCE * size * towards, target, along)


def lowered(camera: Camera, share: float) -> Camera:
    """Moved down by a share of the picture's height: what it looks at then stands higher in it."""
    towards = camera.target - camera.place
    distance = float(np.linalg.norm(towards))
    upright = camera.up - towards * float(camera.up @ towards) / distance**2
    height = 2.0 * distance * np.tan(FIELD_RAD / 2)
    down = -share * height * upright / np.linalg.norm(upright)
    return Camera(camera.place + down, camera.target + down, camera.up)


def between(a: Array, b: Array, share: float) -> Array:
    """A direction between two, nearer to the first the smaller the share."""
    mixed = (1.0 - share) * a + share * b
    out: Array = mixed / np.linalg.norm(mixed)
    return out


def facing(setup: Setup, motion: Motion) -> float:
    """The turn about the vertical that lets the forearm point away from the viewer [rad]."""
    if not setup.layout.is_hand:
        return 0.0
    q_world_forearm = segment_attitudes(setup, motion.q_world_sensor)[0, 0]
    along = so3.rotate(q_world_forearm, np.array([0.0, 1.0, 0.0]))
    return _AWAY - float(np.arctan2(along[1], along[0]))
