"""A pen in a hand: three fingertips hold it, so where they are it is.

The pen rests on three points of skin, of thumb, index and middle finger, without slipping: as a
rigid body its place follows from theirs alone, and whoever knows the true segments knows the pen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.hand.angles import joint_index
from handstudio.hand.skeleton import SEGMENTS, HandSide
from handstudio.maths import so3
from handstudio.simulation.placing import Placed, Placer, limits, outwards, placer, skin
from handstudio.simulation.postures import channels
from handstudio.simulation.solving import solved
from handstudio.simulation.subject import Subject

HOLDING = ("thumb_distal", "index_distal", "middle_distal")
TOUCHING_M = 0.0002
"""A tip no higher than this writes."""

_RADIUS_M, _LENGTH_M = 0.0045, 0.140
# Shares of the phalanx and side of the finger that the pen rests on, and how far from its tip: the
# dynamic tripod, in which the middle finger lies below with its radial side (after J. Ziviani,
# Am. J. Occup. Ther. 37 (1983) 778); figures ours.
_ALONG = (0.62, 0.66, 0.72)
_TOWARDS_DEG = (0.0, 0.0, 50.0)
_FROM_TIP_M = (0.033, 0.030, 0.025)
# Towards the end of the pen, of a right hand: over the index's base, to the elbow. Ours.
_LEANING = np.array([0.30, -0.50, 0.81])

_HABIT = {
    "elbow_flexion": 1.0,
    "forearm_pronation": -38.0,
    "wrist_flexion": -26.0,
    "wrist_deviation_ulnar": -2.0,
    "thumb_cmc_flexion": 8.0,
    "thumb_cmc_abduction": 28.0,
    "thumb_cmc_rotation": 8.0,
    "thumb_mcp_flexion": 28.0,
    "thumb_ip_flexion": 40.0,
    "index_mcp_flexion": 48.0,
    "index_pip_flexion": 60.0,
    "index_dip_flexion": 20.0,
    "middle_mcp_flexion": 50.0,
    "middle_pip_flexion": 65.0,
    "middle_dip_flexion": 28.0,
    "ring_mcp_flexion": 60.0,
    "ring_pip_flexion": 80.0,
    "ring_dip_flexion": 45.0,
    "little_mcp_flexion": 55.0,
    "little_pip_flexion": 85.0,
    "little_dip_flexion": 50.0,
}

# What could sink into the desk; of the palm's thickness there is less on the outer side.
_OVER_DESK = (
    *(f"little_{phalanx}" for phalanx in ("proximal", "intermediate", "distal")),
    *(f"ring_{phalanx}" for phalanx in ("intermediate", "distal")),
)

WRITING_JOINTS = (
    ("elbow", 3),
    ("wrist", 2),
    ("thumb_cmc", 3),
    ("thumb_mcp", 2),
    ("thumb_ip", 1),
    ("index_mcp", 2),
    ("index_pip", 1),
    ("index_dip", 1),
    ("middle_mcp", 2),
    ("middle_pip", 1),
    ("middle_dip", 1),
)
"""Joints that move as somebody writes, and how many of their turns."""

_CURLED = tuple((f"{f}_{joint}", 1) for f in ("ring", "little") for joint in ("mcp", "pip", "dip"))


def writing_channels() -> list[int]:
    """Channels of `WRITING_JOINTS`."""
    return _channels(WRITING_JOINTS)


def _channels(joints: tuple[tuple[str, int], ...]) -> list[int]:
    return [3 * joint_index(name) + turn for name, turns in joints for turn in range(turns)]


@dataclass(frozen=True, slots=True, eq=False)
class HeldPen:
    """How a person holds a pen.

    Attributes:
        posture: Pen on the paper, in the middle of a line.
        pads: Points of skin that hold it, in the frames of the distal segments of thumb, index
            and middle finger [m].
        contacts: The same points in the pen's frame: origin in its tip, z along it to its end.
        place: Of the tip then, in the forearm's frame at the start [m].
        attitude: Of the pen then, there, as a matrix.
        radius_m: Of the barrel.
        length_m: From the tip.
        desk_m: Height of the desk against the elbow.
    """

    posture: Float[Array, " c"]
    pads: Float[Array, "3 3"]
    contacts: Float[Array, "3 3"]
    place: Float[Array, "3"]
    attitude: Float[Array, "3 3"]
    radius_m: float
    length_m: float
    desk_m: float

    def pose(
        self, q_world_segment: Float[Array, "n k 4"], t_world_joint: Float[Array, "n k 3"]
    ) -> tuple[Float[Array, "n 4"], Float[Array, "n 3"]]:
        """Attitude of the pen and place of its tip in the world [m].

        The rigid placement nearest to the three points of skin, in the sense of least squares
        (W. Kabsch, Acta Cryst. A 32 (1976) 922).
        """
        pads = self.skin(q_world_segment, t_world_joint)
        middle, own = pads.mean(axis=1), self.contacts.mean(axis=0)
        spread = np.swapaxes(pads - middle[:, None], 1, 2) @ (self.contacts - own)
        u, _, vt = np.linalg.svd(spread)
        u[:, :, 2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))[:, None]
        attitude = u @ vt
        return so3.from_matrix(attitude), middle - attitude @ own

    def skin(
        self, q_world_segment: Float[Array, "n k 4"], t_world_joint: Float[Array, "n k 3"]
    ) -> Float[Array, "n 3 3"]:
        """Places in the world of the three points of skin that hold it [m]."""
        holding = [SEGMENTS.index(name) for name in HOLDING]
        turned = so3.rotate(q_world_segment[:, holding], self.pads)
        return t_world_joint[:, holding] + turned

    def writes(self, t_world_pen: Float[Array, "n 3"]) -> Bool[Array, " n"]:
        """Whether a tip there touches the paper; False where it is unknown (NaN)."""
        down: Array = t_world_pen[:, 2] - self.desk_m < TOUCHING_M
        return down


@lru_cache(maxsize=16)
def held_pen(subject: Subject) -> HeldPen:
    """How this person holds a pen: always the same way, the hand's outer side on the desk."""
    place, active = placer(subject), _channels(WRITING_JOINTS + _CURLED)
    habit = channels(_HABIT, subject.side)
    desk_m = -float(subject.half_depth_m[0])  # the elbow rests on it
    least, most = (x[active] for x in limits(subject))
    spare = np.minimum(_SPARE, 0.25 * (most - least))
    least, most = np.append(least + spare, [-np.inf] * 6), np.append(most - spare, [np.inf] * 6)
    grip = _Grip(place, active, habit, desk_m)
    found = grip.start()
    for exact_m in _EXACT_M:
        grip = replace(grip, exact_m=exact_m)
        found = solved(grip.residuals, found, least, most)
    return grip.held(found)


# How exactly skin and pen meet: demanding all at once leads astray, or takes long.
_EXACT_M = (1e-3, 1e-4, 2e-5)
_SPARE = np.deg2rad(8.0)  # what a grip leaves of a range of motion, to write with


@dataclass(frozen=True, slots=True, eq=False)
class _Grip:
    """The search for a grip: unknown are turns, the pen's rotation vector and its tip."""

    place: Placer
    active: list[int]
    habit: Array
    desk_m: float
    exact_m: float = _EXACT_M[0]

    @property
    def side(self) -> HandSide:
        return self.place.subject.side

    def start(self) -> Array:
        """Near what is looked for."""
        placed = self.place.placed(self.habit[None])
        pads = placed.points(*self.pads())[0]
        z = self.leaning()
        tip = pads.mean(axis=0) - 0.030 * z
        x = np.cross([0.0, 1.0, 0.0], z)
        x /= np.linalg.norm(x)
        attitude = np.stack([x, np.cross(z, x), z], axis=-1)
        return np.concatenate([self.habit[self.active], so3.log(so3.from_matrix(attitude)), tip])

    def pads(self) -> tuple[list[int], Array]:
        """Points of skin that hold the pen."""
        subject = self.place.subject
        sides = zip(HOLDING, _ALONG, _TOWARDS_DEG, strict=True)
        return [SEGMENTS.index(name) for name in HOLDING], np.stack(
            [skin(subject, name, along, towards) for name, along, towards in sides]
        )

    def leaning(self) -> Array:
        """Direction of the pen that is aimed at."""
        z = _LEANING * ([1.0, 1.0, 1.0] if self.side == "right" else [-1.0, 1.0, 1.0])
        unit: Array = z / np.linalg.norm(z)
        return unit

    def postures(self, x: Array) -> Array:
        """Unknowns as postures."""
        out = np.tile(self.habit, (len(x), 1))
        out[:, self.active] = x[:, : len(self.active)]
        return out

    def residuals(self, x: Array) -> Array:
        """In units of what each may be off."""
        subject, c = self.place.subject, len(self.active)
        placed = self.place.placed(self.postures(x))
        tip, axis = x[:, -3:], so3.rotate(so3.exp(x[:, c:-3]), np.array([0.0, 0.0, 1.0]))
        segments, offsets = self.pads()
        pads = placed.points(segments, offsets)
        out = placed.directions(segments, np.stack([outwards(subject, t) for t in _TOWARDS_DEG]))
        along, across = _about(pads - tip[:, None], axis[:, None])
        distance = np.linalg.norm(across, axis=-1, keepdims=True)
        around = across / distance
        base = SEGMENTS.index("index_proximal")
        knuckle = placed.points(
            [base, base], np.outer([0.1, 0.8], subject.skeleton.t_far_end[base])
        )
        resting = np.linalg.norm(_about(knuckle - tip[:, None], axis[:, None])[1], axis=-1)
        near = resting.min(axis=1, keepdims=True) - subject.half_depth_m[base] - _RADIUS_M
        parts = [
            (distance[..., 0] - _RADIUS_M) / self.exact_m,
            (along - _FROM_TIP_M) / 0.003,
            (out + around).reshape(len(x), -1) / 0.3,
            around.sum(axis=1) / 0.4,
            near / 0.003,
            (axis - self.leaning()) / 0.15,
            (tip[:, 2:] - self.desk_m) / self.exact_m,
            self.resting(placed) / 0.002,
            (x[:, :c] - self.habit[self.active]) / np.deg2rad(12.0),
            # which way the pen is turned about itself says nothing
            0.01 * x[:, c:-3],
        ]
        return np.concatenate(parts, axis=1)

    def resting(self, placed: Placed) -> Array:
        """What is wrong with how the hand rests: its outer side on the desk, nothing in it [m]."""
        subject = self.place.subject
        segments = [SEGMENTS.index(name) for name in _OVER_DESK]
        ends = np.concatenate([np.zeros((len(segments), 3)), subject.skeleton.t_far_end[segments]])
        height = placed.points(segments * 2, ends)[..., 2] - self.desk_m
        above = height - np.tile(subject.half_depth_m[segments], 2)
        return np.concatenate([np.minimum(above, 0.0), above.min(axis=1, keepdims=True)], axis=1)

    def held(self, x: Array) -> HeldPen:
        """What was found."""
        posture, c = self.postures(x[None])[0], len(self.active)
        placed = self.place.placed(posture[None])
        attitude, tip = so3.to_matrix(so3.exp(x[c:-3])), x[-3:]
        segments, pads = self.pads()
        contacts = (placed.points(segments, pads)[0] - tip) @ attitude
        return HeldPen(
            posture, pads, contacts, tip, attitude, _RADIUS_M, _LENGTH_M, desk_m=self.desk_m
        )


def _about(points: Array, axis: Array) -> tuple[Array, Array]:
    """How far along an axis points are, and their places across it."""
    along = np.sum(points * axis, axis=-1)
    return along, points - along[..., None] * axis
