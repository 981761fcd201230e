"""The sixteen grasps of manufacturing, and what they are tried on.

Classes: M. Cutkosky, IEEE Trans. Robotics and Automation 5 (1989) 269, figure 4, the two heavy
wraps apart; names of T. Feix et al., IEEE Trans. Human-Machine Systems 46 (2016) 66, who leave out
what a hand only pushes. Sizes, and the postures that the search starts from, are ours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from handstudio.hand.skeleton import FINGERS
from handstudio.simulation.graspable import Box, Cylinder, Shape, Sphere
from handstudio.simulation.postures import Posture, finger, thumb

PALM = "palm"


@dataclass(frozen=True, slots=True)
class Contact:
    """Skin that touches: of a phalanx (share of its length, side as `placing.skin`) or the palm."""

    segment: str
    along: float = 0.5
    towards_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class GraspClass:
    """One way of holding something.

    Attributes:
        name: In snake_case.
        feix: In the GRASP taxonomy; empty where that has none.
        shape: Of the thing, from its size [m].
        size_mm: Usual size, and from and to which this class is tried.
        contacts: Skin that touches it.
        habit: Posture that the search starts from [deg].
        axis: Of the thing (its z) in the frame of a right ``hand``.
        across: Its x there, more or less.
        place: Of its middle there: share of hand length, and how many sizes deep under the palm's
            skin; None where it lies between the skin that touches it.
        shift_m: Then, how far from there.
    """

    name: str
    feix: str
    shape: Callable[[float], Shape]
    size_mm: tuple[float, float, float]
    contacts: tuple[Contact, ...]
    habit: Posture
    axis: tuple[float, float, float]
    across: tuple[float, float, float] = (0.0, 1.0, 0.0)
    place: tuple[float, float, float] | None = None
    shift_m: tuple[float, float, float] = (0.0, 0.0, 0.0)


_LONG_M, _DISK_M, _CARD_M = 0.140, 0.020, (0.085, 0.054)

_TIP = 0.65  # of a distal phalanx: the middle of its pad


def _bar(size_m: float) -> Shape:
    return Cylinder(0.5 * size_m, _LONG_M)


def _ball(size_m: float) -> Shape:
    return Sphere(0.5 * size_m)


def _disk(size_m: float) -> Shape:
    return Cylinder(0.5 * size_m, _DISK_M)


def _card(size_m: float) -> Shape:
    return Box((*_CARD_M, size_m))


def _plate(size_m: float) -> Shape:
    return Box((0.140, 0.200, size_m))


def _pads(*fingers: str) -> tuple[Contact, ...]:
    return tuple(Contact(f"{name}_distal", _TIP) for name in fingers)


def _around() -> tuple[Contact, ...]:
    """Five pads about something round: the outer ones with their inner sides."""
    sides = {"thumb": 0.0, "index": -35.0, "middle": -10.0, "ring": 10.0, "little": 35.0}
    return tuple(Contact(f"{name}_distal", _TIP, side) for name, side in sides.items())


def _wrapped(*phalanges: str) -> tuple[Contact, ...]:
    return tuple(Contact(f"{name}_{part}") for name in FINGERS[1:] for part in phalanges)


def _curled(mcp: float, pip: float, spread: float = 0.0) -> dict[str, float]:
    sides = {"index": spread, "middle": 0.0, "ring": 0.6 * spread, "little": spread}
    return {k: v for name in FINGERS[1:] for k, v in finger(name, mcp, pip, sides[name]).items()}


def _precise(*used: str) -> dict[str, float]:
    """These fingertips opposite the thumb, the others out of the way."""
    posture = dict[str, float]()
    for name in FINGERS[1:]:
        posture |= finger(name, 52.0, 35.0) if name in used else finger(name, 35.0, 70.0)
    return posture | thumb(flexion=8.0, abduction=42.0, mcp=12.0, ip=18.0, rotation=8.0)


_ACROSS = (1.0, 0.0, 0.0)
_DOWN = (0.0, 0.0, -1.0)
_ALL = FINGERS

GRASPS = (
    GraspClass(
        "heavy_wrap_large",
        "Large Diameter",
        _bar,
        (80.0, 60.0, 95.0),
        (Contact(PALM), *_wrapped("intermediate", "distal"), *_pads("thumb")),
        _curled(30.0, 50.0, 4.0) | thumb(5.0, 50.0, 10.0, 20.0, 8.0),
        _ACROSS,
        place=(0.0, 0.46, 0.5),
    ),
    GraspClass(
        "heavy_wrap_small",
        "Small Diameter",
        _bar,
        (30.0, 25.0, 40.0),
        (Contact(PALM), *_wrapped("intermediate", "distal")),
        _curled(70.0, 75.0) | thumb(3.0, 16.0, 46.0, 55.0),
        _ACROSS,
        place=(0.0, 0.42, 0.5),
    ),
    GraspClass(
        "medium_wrap",
        "Medium Wrap",
        _bar,
        (50.0, 38.0, 62.0),
        (Contact(PALM), *_wrapped("intermediate", "distal"), *_pads("thumb")),
        _curled(50.0, 65.0) | thumb(10.0, 45.0, 20.0, 30.0, 8.0),
        _ACROSS,
        place=(0.0, 0.44, 0.5),
    ),
    GraspClass(
        "adducted_thumb",
        "Adducted Thumb",
        _bar,
        (30.0, 22.0, 38.0),
        (
            *_wrapped("intermediate", "distal"),
            *_pads("thumb"),
        ),
        _curled(65.0, 80.0) | thumb(5.0, 15.0, 10.0, 10.0),
        (-0.75, 0.65, -0.10),
        place=(0.0, 0.45, 0.8),
    ),
    GraspClass(
        "light_tool",
        "Light Tool",
        _bar,
        (16.0, 10.0, 24.0),
        (*_wrapped("intermediate", "distal"), *_pads("thumb")),
        _curled(65.0, 90.0) | thumb(12.0, 30.0, 25.0, 35.0, 5.0),
        _ACROSS,
        place=(0.0, 0.44, 0.9),
    ),
    GraspClass(
        "thumb_4_finger",
        "Prismatic 4 Finger",
        _bar,
        (12.0, 6.0, 30.0),
        _pads(*_ALL),
        _precise(*FINGERS[1:]),
        _ACROSS,
    ),
    GraspClass(
        "thumb_3_finger",
        "Prismatic 3 Finger",
        _bar,
        (12.0, 6.0, 30.0),
        _pads("thumb", "index", "middle", "ring"),
        _precise("index", "middle", "ring"),
        _ACROSS,
    ),
    GraspClass(
        "thumb_2_finger",
        "Prismatic 2 Finger",
        _bar,
        (12.0, 6.0, 30.0),
        _pads("thumb", "index", "middle"),
        _precise("index", "middle"),
        _ACROSS,
    ),
    GraspClass(
        "thumb_index_finger",
        "Palmar Pinch",
        _bar,
        (8.0, 4.0, 30.0),
        _pads("thumb", "index"),
        _precise("index") | finger("index", 45.0, 45.0) | thumb(8.0, 12.0, 28.0, 25.0, 5.0),
        _ACROSS,
    ),
    GraspClass(
        "power_disk",
        "Power Disk",
        _disk,
        (82.0, 70.0, 95.0),
        (Contact(PALM), *_around()),
        _curled(35.0, 45.0, 10.0) | thumb(-5.0, 35.0, 10.0, 30.0, 5.0),
        (0.0, 0.0, 1.0),
        place=(-0.02, 0.47, 0.12),
    ),
    GraspClass(
        "power_sphere",
        "Power Sphere",
        _ball,
        (75.0, 55.0, 90.0),
        (Contact(PALM), *_around(), Contact("middle_intermediate"), Contact("ring_intermediate")),
        _curled(35.0, 50.0, 10.0) | thumb(0.0, 50.0, 10.0, 20.0, 8.0),
        (0.0, 0.0, 1.0),
        place=(0.0, 0.47, 0.5),
    ),
    GraspClass(
        "precision_disk",
        "Precision Disk",
        _disk,
        (80.0, 55.0, 95.0),
        _around(),
        _curled(40.0, 40.0, 10.0) | thumb(-5.0, 40.0, 5.0, 15.0, 5.0),
        (0.0, 0.0, 1.0),
    ),
    GraspClass(
        "precision_sphere",
        "Precision Sphere",
        _ball,
        (60.0, 40.0, 80.0),
        _around(),
        _curled(45.0, 40.0, 6.0) | thumb(0.0, 45.0, 8.0, 18.0, 8.0),
        (0.0, 0.0, 1.0),
    ),
    GraspClass(
        "tripod",
        "Tripod",
        _ball,
        (30.0, 15.0, 45.0),
        _pads("thumb", "index", "middle"),
        _precise("index", "middle"),
        (0.0, 0.0, 1.0),
    ),
    GraspClass(
        "platform_push",
        "",
        _plate,
        (10.0, 2.0, 40.0),
        (Contact(PALM), *_pads(*FINGERS[1:])),
        _curled(2.0, 6.0, 4.0) | thumb(-10.0, 0.0, 0.0, 5.0),
        (0.0, 0.0, 1.0),
        place=(0.0, 0.60, 0.5),
    ),
    GraspClass(
        "lateral_pinch",
        "Lateral",
        _card,
        (3.0, 0.8, 12.0),
        (*_pads("thumb"), Contact("index_intermediate", 0.6, 80.0)),
        _curled(45.0, 65.0) | thumb(8.0, 15.0, 15.0, 30.0, 5.0),
        (1.0, 0.0, 0.35),
        shift_m=(0.0, 0.025, 0.0),
    ),
)
"""In the order of Cutkosky's figure: power before precision, prismatic before circular."""
