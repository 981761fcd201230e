"""The layout: which sensor sits on which segment, and which joints join the segments.

A layout is data. The glove's twenty sensors are one; fewer fingers, a left hand or two sensors on
a hinge are others.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from handstudio.errors import LayoutError
from handstudio.hand.skeleton import JOINTS, SEGMENTS

_REMEDY = "Correct the layout and try again; docs/import.md shows a complete one."
_SIDES = ("left", "right", "unknown")


class SensorPlace(msgspec.Struct, frozen=True):
    """A sensor by name and the segment it sits on."""

    sensor: str
    segment: str


class JointPlace(msgspec.Struct, frozen=True):
    """A joint by name, the segments it joins and the number of axes it turns about."""

    name: str
    parent: str
    child: str
    axes: int


class Layout(msgspec.Struct, frozen=True):
    """Sensors in the order of every array's sensor axis, and the tree of joints."""

    side: str  # "left", "right" or "unknown"
    sensors: tuple[SensorPlace, ...]
    joints: tuple[JointPlace, ...]

    def __post_init__(self) -> None:
        check(self)

    @property
    def names(self) -> tuple[str, ...]:
        """Sensor names in order."""
        return tuple(place.sensor for place in self.sensors)

    @property
    def drivers(self) -> dict[str, int]:
        """The sensor that defines each instrumented segment: the first one listed on it."""
        drivers: dict[str, int] = {}
        for index, place in enumerate(self.sensors):
            drivers.setdefault(place.segment, index)
        return drivers

    @property
    def instrumented_joints(self) -> tuple[JointPlace, ...]:
        """The joints with a sensor on both sides."""
        drivers = self.drivers
        return tuple(j for j in self.joints if {j.parent, j.child} <= drivers.keys())

    @property
    def is_hand(self) -> bool:
        """Whether the hand views, joint angles by name and positions apply."""
        known = {joint.name for joint in JOINTS}
        return (
            self.side in ("left", "right")
            and all(joint.name in known for joint in self.joints)
            and {"forearm", "hand"} <= self.drivers.keys() <= set(SEGMENTS)
        )

    @property
    def missing_for_hand(self) -> str:
        """Why there is no hand to show, as a sentence; empty where there is one."""
        if self.is_hand:
            return ""
        if self.side not in ("left", "right"):
            return "The layout does not say which hand: no hand is shown."
        lacking = [name for name in ("forearm", "hand") if name not in self.drivers]
        if lacking:
            return f"No sensor on {' and '.join(lacking)}: no hand is shown."
        return "The layout names segments or joints that are not a hand's: no hand is shown."


def check(layout: Layout) -> None:
    """Raise LayoutError where names repeat, joints form a loop, or a segment hangs in the air."""
    if not layout.sensors:
        raise LayoutError("The layout has no sensors.", _REMEDY)
    if layout.side not in _SIDES:
        raise LayoutError(
            f"The side of the layout is {layout.side!r}.", 'Write "left", "right" or "unknown".'
        )
    _refuse_repeats("Sensor", layout.names)
    _refuse_repeats("Joint", [joint.name for joint in layout.joints])
    _refuse_repeats("Sensor or joint", [*layout.names, *(joint.name for joint in layout.joints)])
    _refuse_repeats("Child segment", [joint.child for joint in layout.joints])
    joined = {s for joint in layout.joints for s in (joint.parent, joint.child)}
    for place in layout.sensors:
        if layout.joints and place.segment not in joined:
            raise LayoutError(
                f"{place.sensor} sits on {place.segment}, which no joint joins to the rest.",
                _REMEDY,
            )
    for joint in layout.joints:
        if joint.axes not in (1, 2, 3):
            raise LayoutError(f"Joint {joint.name} has {joint.axes} axes, not 1, 2 or 3.", _REMEDY)
    _refuse_loops(layout)


def _refuse_repeats(what: str, names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise LayoutError(f"{what} {name} appears {names.count(name)} times.", _REMEDY)


def _refuse_loops(layout: Layout) -> None:
    parent_of = {joint.child: joint.parent for joint in layout.joints}
    for start in parent_of:
        segment, steps = start, 0
        while segment in parent_of:
            segment, steps = parent_of[segment], steps + 1
            if steps > len(parent_of):
                raise LayoutError(f"The joints around {start} form a loop, not a tree.", _REMEDY)


_GLOVE = {
    **dict.fromkeys(("SN1", "SN2", "SN3"), "forearm"),
    "SN4": "hand_ulnar",
    "SN5": "little_proximal",
    "SN6": "little_intermediate",
    "SN7": "little_distal",
    "SN8": "ring_proximal",
    "SN9": "ring_intermediate",
    "SN10": "ring_distal",
    "SN11": "hand",
    "SN12": "middle_proximal",
    "SN13": "middle_intermediate",
    "SN14": "middle_distal",
    "SN15": "index_proximal",
    "SN16": "index_intermediate",
    "SN17": "index_distal",
    "SN18": "thumb_metacarpal",
    "SN19": "thumb_proximal",
    "SN20": "thumb_distal",
    # the extra sensor of calibration; taped to the index unless a layout says otherwise
    "Tip": "index_distal",
}


def glove(side: str = "right", sensors: Sequence[str] | None = None) -> Layout:
    """The layout of the glove: all twenty sensors, or those named, in the order given.

    Raises:
        LayoutError: a name is not one of the glove's.
    """
    names = [f"SN{n}" for n in range(1, 21)] if sensors is None else list(sensors)
    unknown = [name for name in names if name not in _GLOVE]
    if unknown:
        raise LayoutError(f"The glove has no sensor {', '.join(unknown)}.", _REMEDY)
    joints = tuple(
        JointPlace(joint.name, joint.parent, joint.child, joint.axes)
        for joint in JOINTS
        if joint.parent is not None
    )
    return Layout(side, tuple(SensorPlace(name, _GLOVE[name]) for name in names), joints)
