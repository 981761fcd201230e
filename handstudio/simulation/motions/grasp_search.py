"""How a hand holds a thing: posture and place of the thing, searched for together.

Skin that takes part lies on the surface and faces it; nothing goes deeper into the thing, or into
another finger, than flesh gives way; joints stay in range, the last ones follow the ones before,
and what is left is as near to habit as it can be.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.hand.angles import joint_index
from handstudio.hand.skeleton import FINGERS, SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.graspable import HeldObject, Shape
from handstudio.simulation.motions.grasp_classes import PALM, GraspClass
from handstudio.simulation.placing import Placed, Placer, limits, outwards, placer, skin
from handstudio.simulation.postures import channels
from handstudio.simulation.solving import solved
from handstudio.simulation.subject import Subject

TOUCHING_M = 0.0003
"""Skin this near to a surface touches it."""

YIELDS_M = 0.0015
"""Flesh gives way this much at most."""

_EXACT_M = ((2e-3, 1e-4), (2e-4, 1e-4), (2e-5, 1e-6))  # and by which share a step must better it
_ATTEMPTS = 5  # from other starts
_MEANT_DEPTH_M, _DEPTH_M = 0.0007, 0.0002
_FINGERS_APART_M = 0.0030  # less than both their half depths: they are soft, and oval
_SLIDES = 0.25  # of a phalanx, either way from where skin is meant to touch
_FACING = 0.4
_HABIT_DEG, _COUPLED_DEG = 14.0, 6.0
_PLACE_M, _TILT_DEG = 0.010, 12.0

_JOINTS = (
    ("ulnar_cmc", 1),
    ("thumb_cmc", 3),
    ("thumb_mcp", 2),
    ("thumb_ip", 1),
    *(
        (f"{f}_{joint}", n)
        for f in FINGERS[1:]
        for joint, n in (("mcp", 2), ("pip", 1), ("dip", 1))
    ),
)
_THUMB_TURNS = 7  # and the palm's, which come first
_OPENED = 0.4
_PHALANGES = tuple(
    f"{finger}_{part}"
    for finger in FINGERS
    for part in ("proximal", "intermediate", "distal")
    if f"{finger}_{part}" in SEGMENTS
)
_ALONG = (0.25, 0.6, 0.95)  # where phalanges are looked at


@dataclass(frozen=True, slots=True, eq=False)
class Grasp:
    """A hand that holds something.

    Attributes:
        kind: Which way.
        posture: Of the hand; the forearm is at its start.
        held: What it holds.
        contacts: Segments that touch it, and the points of their skin that do, in their frames [m].
    """

    kind: GraspClass
    posture: Float[Array, " c"]
    held: HeldObject
    contacts: tuple[list[int], Float[Array, "p 3"]]


def grasped(subject: Subject, kind: GraspClass, size_m: float, rng: np.random.Generator) -> Grasp:
    """How this person holds a thing of this size, never twice quite the same.

    Raises:
        SetupError: this hand cannot.
    """
    least, most = (x[_active()] for x in limits(subject))
    slides, free = np.full(len(kind.contacts), _SLIDES), np.full(6, np.inf)
    least, most = np.concatenate([least, -slides, -free]), np.concatenate([most, slides, free])
    for _ in range(_ATTEMPTS):
        search = _search(subject, kind, kind.shape(size_m), size_m, rng)
        found = search.opened()
        for exact_m, within in _EXACT_M:
            search = replace(search, exact_m=exact_m)
            found = solved(search.residuals, found, least, most, within=within, tries=50)
        gap, depth = search.judged(found)
        if gap < TOUCHING_M and depth < YIELDS_M:
            return search.grasp(found)
    raise SetupError(
        "This hand cannot hold {size:g} mm by {name}.",
        "Choose another size, such as {usual:g} mm.",
        size=1e3 * size_m,
        name=kind.name,
        usual=kind.size_mm[0],
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Skin:
    """Skin that touches: segments, points of it, ways out of it, and along the whole segment."""

    segments: list[int]
    points: Float[Array, "p 3"]
    out: Float[Array, "p 3"]
    along: Float[Array, "p 3"]


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """Unknown are turns, where along its phalanx skin touches, and how the thing is turned and
    shifted from where it is meant.
    """

    place: Placer
    kind: GraspClass
    shape: Shape
    active: list[int]
    habit: Float[Array, " c"]
    attitude: Float[Array, "3 3"]  # of the thing in the hand, as it is meant
    middle: Float[Array, "3"]
    skin: _Skin
    flesh: tuple[list[int], Float[Array, "b 3"], Float[Array, " b"]]  # bones and half depths
    apart: Float[Array, "b b"]  # of bones of different digits
    coupling: Float[Array, "4 x"]
    exact_m: float = _EXACT_M[0][0]

    def start(self) -> Array:
        """Habit."""
        return np.append(self.habit[self.active], np.zeros(len(self.skin.segments) + 6))

    def opened(self) -> Array:
        """Habit with straighter fingers about what lies in the palm, or they start behind it."""
        start = self.start()
        if self.kind.place is not None:
            start[_THUMB_TURNS : len(self.active)] *= _OPENED
        return start

    def postures(self, x: Array) -> Array:
        """Unknowns as postures."""
        out = np.tile(self.habit, (len(x), 1))
        out[:, self.active] = x[:, : len(self.active)]
        return out

    def seen(self, x: Array, placed: Placed, points: Array) -> Array:
        """Points in the frame of the thing."""
        hand = SEGMENTS.index("hand")
        in_hand = (points - placed.place[:, hand, None]) @ placed.attitude[:, hand]
        turned = so3.to_matrix(so3.exp(x[:, -6:-3])) @ self.attitude
        seen: Array = (in_hand - self.middle - x[:, None, -3:]) @ turned
        return seen

    def residuals(self, x: Array) -> Array:
        """In units of what each may be off."""
        placed = self.place.placed(self.postures(x))
        segments, c = self.skin.segments, len(self.active)
        at = placed.points(segments, self.touching(x))
        gap = self.shape.distance(self.seen(x, placed, at))
        # skin that faces the thing comes as much nearer as it goes out
        ahead = at + 0.002 * placed.directions(segments, self.skin.out)
        facing = (gap - self.shape.distance(self.seen(x, placed, ahead))) / 0.002 - 1.0
        bones, depth = self.buried(x, placed)
        between = np.linalg.norm(bones[:, :, None] - bones[:, None], axis=-1)
        close = np.maximum(self.apart - between, 0.0)[:, self.apart > 0.0]
        away = x - self.start()
        parts = [
            gap / self.exact_m,
            facing / _FACING,
            np.maximum(depth - _MEANT_DEPTH_M, 0.0) / max(_DEPTH_M, 0.2 * self.exact_m),
            close / 0.001,
            away[:, :c] / np.deg2rad(_HABIT_DEG),
            away[:, c:-6] / _SLIDES,
            away[:, -6:-3] / np.deg2rad(_TILT_DEG),
            away[:, -3:] / _PLACE_M,
            away @ self.coupling.T,
        ]
        return np.concatenate(parts, axis=1)

    def touching(self, x: Array) -> Array:
        """Points of skin that touch, in their segments' frames."""
        slid = x[:, len(self.active) : -6, None] * self.skin.along
        points: Array = self.skin.points + slid
        return points

    def buried(self, x: Array, placed: Placed) -> tuple[Array, Array]:
        """Points of bones, and how deep the thing is in the flesh around them [m]."""
        segments, offsets, half = self.flesh
        bones = placed.points(segments, offsets)
        return bones, half - self.shape.distance(self.seen(x, placed, bones))

    def judged(self, x: Array) -> tuple[float, float]:
        """How far the skin is from the surface, and how deep the thing in the flesh [m]."""
        placed = self.place.placed(self.postures(x[None]))
        gap = self.shape.distance(
            self.seen(x[None], placed, placed.points(self.skin.segments, self.touching(x[None])))
        )
        return float(np.abs(gap).max()), float(self.buried(x[None], placed)[1].max())

    def grasp(self, x: Array) -> Grasp:
        """What was found."""
        turned = so3.to_matrix(so3.exp(x[-6:-3])) @ self.attitude
        held = HeldObject(self.kind.name, self.shape, so3.from_matrix(turned), self.middle + x[-3:])
        return Grasp(
            self.kind,
            self.postures(x[None])[0],
            held,
            (self.skin.segments, self.touching(x[None])[0]),
        )


def _active() -> list[int]:
    return [3 * joint_index(name) + turn for name, turns in _JOINTS for turn in range(turns)]


def _search(
    subject: Subject, kind: GraspClass, shape: Shape, size_m: float, rng: np.random.Generator
) -> _Search:
    place = placer(subject)
    active = _active()
    habit = channels(kind.habit, subject.side)
    habit[active] += np.deg2rad(2.5) * rng.standard_normal(len(active))
    touching = _touching(subject, kind)
    flesh = _flesh(subject)
    middle = _middle(place, kind, habit, size_m, touching) + 0.002 * rng.standard_normal(3)
    attitude = _attitude(kind, subject.side == "left")
    attitude = so3.to_matrix(so3.exp(np.deg2rad(3.0) * rng.standard_normal(3))) @ attitude
    apart, coupling = _apart(flesh), _coupling(subject, active, len(kind.contacts) + 6)
    return _Search(
        place, kind, shape, active, habit, attitude, middle, touching, flesh, apart, coupling
    )


def _touching(subject: Subject, kind: GraspClass) -> _Skin:
    segments, points, out = list[int](), list[Array](), list[Array]()
    for contact in kind.contacts:
        palm = contact.segment == PALM
        segments.append(SEGMENTS.index("hand" if palm else contact.segment))
        points.append(
            _palm(subject)
            if palm
            else skin(subject, contact.segment, contact.along, contact.towards_deg)
        )
        out.append(outwards(subject, contact.towards_deg))
    far = subject.skeleton.t_far_end[segments]
    return _Skin(segments, np.array(points), np.array(out), far)


def _palm(subject: Subject) -> Array:
    """Skin of the palm, below the heads of index and middle metacarpal."""
    heads = [SEGMENTS.index(f"{finger}_proximal") for finger in ("index", "middle")]
    bone = 0.85 * subject.skeleton.t_parent_joint[heads].mean(axis=0)
    below: Array = bone + subject.half_depth_m[SEGMENTS.index("hand")] * outwards(subject)
    return below


def _flesh(subject: Subject) -> tuple[list[int], Array, Array]:
    """Points of bones with the flesh around them: phalanges, thumb, palm."""
    segments, points = list[int](), list[Array]()
    far = subject.skeleton.t_far_end
    for name in (*_PHALANGES, "thumb_metacarpal"):
        index = SEGMENTS.index(name)
        segments += [index] * len(_ALONG)
        points += [along * far[index] for along in _ALONG]
    half = [subject.half_depth_m[index] for index in segments]
    for finger in FINGERS[1:]:
        child = SEGMENTS.index(f"{finger}_proximal")
        parent = SEGMENTS.index("hand_ulnar" if finger in ("ring", "little") else "hand")
        for along in (0.5, 0.75):
            segments.append(parent)
            points.append(along * subject.skeleton.t_parent_joint[child])
            half.append(subject.half_depth_m[parent])
    return segments, np.array(points), np.array(half)


def _apart(flesh: tuple[list[int], Array, Array]) -> Array:
    """How far bones of different digits have to be apart at least [m]; 0 where it is all the same.

    Each pair once; of neighbouring fingers, whose roots are joined, phalanges of the same row.
    """
    segments, _, half = flesh
    digit = np.array([_digit(SEGMENTS[index]) for index in segments])
    row = np.array([SEGMENTS[index].rpartition("_")[2] for index in segments])
    first, second = np.meshgrid(np.arange(len(half)), np.arange(len(half)), indexing="ij")
    asked: Bool[Array, "b b"] = (digit[first] < digit[second]) & (digit[first] >= 0)
    thumb = (digit[first] == 0) & (row[first] != "metacarpal") & (row[second] != "proximal")
    alike = (digit[second] - digit[first] == 1) & (row[first] == row[second])
    alike &= (digit[first] > 0) & (row[first] != "proximal")
    least = half[first] + half[second] - _FINGERS_APART_M
    return np.where(asked & (thumb | alike), least, 0.0)


def _digit(segment: str) -> int:
    name = segment.partition("_")[0]
    return FINGERS.index(name) if name in FINGERS else -1


def _coupling(subject: Subject, active: list[int], others: int) -> Array:
    """What last joints do by themselves is taken for strain."""
    rows = np.zeros((4, len(active) + others))
    for row, finger, ratio in zip(rows, FINGERS[1:], subject.dip_per_pip, strict=True):
        row[active.index(3 * joint_index(f"{finger}_dip"))] = 1.0
        row[active.index(3 * joint_index(f"{finger}_pip"))] = -ratio
    coupling: Array = rows / np.deg2rad(_COUPLED_DEG)
    return coupling


def _middle(
    place: Placer,
    kind: GraspClass,
    habit: Array,
    size_m: float,
    touching: _Skin,
) -> Array:
    """Of the thing, in the hand, where it is meant to be."""
    subject = place.subject
    placed = place.placed(habit[None])
    mirror = np.array([1.0 if subject.side == "right" else -1.0, 1.0, 1.0])
    if kind.place is None:  # between thumb and fingers
        skin_now = placed.points(touching.segments, touching.points)[0]
        hand = SEGMENTS.index("hand")
        thumb, others = skin_now[:1], skin_now[1:]
        between = 0.5 * (thumb.mean(axis=0) + others.mean(axis=0))
        middle: Array = (between - placed.place[0, hand]) @ placed.attitude[0, hand]
        middle += np.multiply(kind.shift_m, mirror)
        return middle
    x, y, depth = kind.place
    below = subject.half_depth_m[SEGMENTS.index("hand")] + depth * size_m
    length = subject.hand_length_m
    meant: Array = mirror * np.array([x * length, y * length, -below])
    return meant


def _attitude(kind: GraspClass, left: bool) -> Array:
    """Of the thing in the hand, as it is meant to be."""
    z, x = np.array(kind.axis), np.array(kind.across)
    if left:
        z, x = z * [-1.0, 1.0, 1.0], x * [-1.0, 1.0, 1.0]
    z = z / np.linalg.norm(z)
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)
