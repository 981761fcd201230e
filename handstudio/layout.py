"""The layout: which sensor sits on which segment, and which joints join the segments.

A layout is data. The glove's twenty sensors are one; fewer fingers, a left hand or two sensors on
a hinge are others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import msgspec

from handstudio.errors import LayoutError
from handstudio.hand.skeleton import SEGMENTS, ULNAR, HandType, joints_of

_REMEDY = "Correct the layout and try again; docs/import.md shows a complete one."
_INSTEAD = "Export orientations instead."
_SIDES = ("left", "right", "unknown")


class SensorPlace(msgspec.Struct, frozen=True, omit_defaults=True):
    """A sensor by name and the segment it sits on.

    Attributes:
        sensor: Its name.
        segment: What it sits on.
        second: It does not define its segment while another sensor there can.
    """

    sensor: str
    segment: str
    second: bool = False


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
        return self.drivers_among(range(len(self.sensors)))

    def drivers_among(self, sensors: Sequence[int]) -> dict[str, int]:
        """The same of these sensors alone, given in order."""
        drivers: dict[str, int] = {}
        for index in sorted(sensors, key=lambda index: self.sensors[index].second):
            drivers.setdefault(self.sensors[index].segment, index)
        return drivers

    @property
    def hand_type(self) -> HandType:
        """How the palm is divided, by what its blocks and the two ulnar fingers hang on."""
        parent = {joint.child: joint.parent for joint in self.joints}
        if parent.get(ULNAR) == "forearm":
            return 2
        fingers = {parent.get(f"{finger}_proximal") for finger in ("ring", "little")}
        return 1 if "hand" in fingers and ULNAR not in fingers else 3

    @property
    def instrumented_joints(self) -> tuple[JointPlace, ...]:
        """The joints with a sensor on both sides."""
        drivers = self.drivers
        return tuple(j for j in self.joints if {j.parent, j.child} <= drivers.keys())

    @property
    def is_hand(self) -> bool:
        """Whether the hand views, joint angles by name and positions apply."""
        known = {joint.name for joint in joints_of(self.hand_type)}
        return (
            self.side in ("left", "right")
            and all(joint.name in known for joint in self.joints)
            and {"forearm", "hand"} <= self.drivers.keys() <= set(SEGMENTS)
        )

    @property
    def no_hand(self) -> LayoutError | None:
        """Why there is no hand to show; None where there is one."""
        return None if self.is_hand else _no_hand(self)

    @property
    def missing_for_hand(self) -> str:
        """Why there is no hand to show, as an English sentence; empty where there is one."""
        why = self.no_hand
        return "" if why is None else why.what


def check(layout: Layout) -> None:
    """Raise LayoutError where names repeat, joints form a loop, or a segment hangs in the air."""
    if not layout.sensors:
        raise LayoutError("The layout has no sensors.", _REMEDY)
    if layout.side not in _SIDES:
        raise LayoutError(
            "The side of the layout is {side!r}.",
            'Write "left", "right" or "unknown".',
            side=layout.side,
        )
    _refuse_repeats(layout)
    joined = {s for joint in layout.joints for s in (joint.parent, joint.child)}
    for place in layout.sensors:
        if layout.joints and place.segment not in joined:
            raise LayoutError(
                "{sensor} sits on {segment}, which no joint joins to the rest.",
                _REMEDY,
                sensor=place.sensor,
                segment=place.segment,
            )
    for joint in layout.joints:
        if joint.axes not in (1, 2, 3):
            raise LayoutError(
                "Joint {joint} has {axes} axes, not 1, 2 or 3.",
                _REMEDY,
                joint=joint.name,
                axes=joint.axes,
            )
    _refuse_loops(layout)


def _refuse_repeats(layout: Layout) -> None:
    sensors = layout.names
    joints = tuple(joint.name for joint in layout.joints)
    for name, times in _repeated(sensors):
        raise LayoutError("Sensor {name} appears {times} times.", _REMEDY, name=name, times=times)
    for name, times in _repeated(joints):
        raise LayoutError("Joint {name} appears {times} times.", _REMEDY, name=name, times=times)
    for name, times in _repeated(sensors + joints):
        raise LayoutError(
            "Sensor or joint {name} appears {times} times.", _REMEDY, name=name, times=times
        )
    for name, times in _repeated(tuple(joint.child for joint in layout.joints)):
        raise LayoutError(
            "Child segment {name} appears {times} times.", _REMEDY, name=name, times=times
        )


def _repeated(names: tuple[str, ...]) -> Iterator[tuple[str, int]]:
    return ((name, names.count(name)) for name in names if names.count(name) > 1)


def _no_hand(layout: Layout) -> LayoutError:
    if layout.side not in ("left", "right"):
        return LayoutError("The layout does not say which hand: no hand is shown.", _INSTEAD)
    match [name for name in ("forearm", "hand") if name not in layout.drivers]:
        case ["forearm"]:
            return LayoutError("No sensor on forearm: no hand is shown.", _INSTEAD)
        case ["hand"]:
            return LayoutError("No sensor on hand: no hand is shown.", _INSTEAD)
        case [_, _]:
            return LayoutError("No sensor on forearm and hand: no hand is shown.", _INSTEAD)
    return LayoutError(
        "The layout names segments or joints that are not a hand's: no hand is shown.", _INSTEAD
    )


def _refuse_loops(layout: Layout) -> None:
    parent_of = {joint.child: joint.parent for joint in layout.joints}
    for start in parent_of:
        segment, steps = start, 0
        while segment in parent_of:
            segment, steps = parent_of[segment], steps + 1
            if steps > len(parent_of):
                raise LayoutError(
                    "The joints around {segment} form a loop, not a tree.", _REMEDY, segment=start
                )


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


def glove(
    side: str = "right",
    sensors: Sequence[str] | None = None,
    hand_type: HandType | None = None,
) -> Layout:
    """The layout of the glove.

    Args:
        side: Which hand.
        sensors: Names, in order; all twenty unless given.
        hand_type: How the palm is divided. Unless given it is 3, and 1 for a glove that has no
            sensor on the ulnar block: nothing tells how that lies then.

    Raises:
        LayoutError: a name is not one of the glove's, or the type needs a sensor that is not there.
    """
    names = [f"SN{n}" for n in range(1, 21)] if sensors is None else list(sensors)
    unknown = [name for name in names if name not in _GLOVE]
    if unknown:
        raise LayoutError("The glove has no sensor {sensors}.", _REMEDY, sensors=", ".join(unknown))
    divided = any(_GLOVE[name] == ULNAR for name in names)
    if hand_type not in (None, 1) and not divided:
        raise LayoutError(
            "A hand of type {hand_type} needs a sensor on {segment}.",
            "Choose hand type 1.",
            hand_type=hand_type,
            segment=ULNAR,
        )
    divided = divided and hand_type != 1
    joints = tuple(
        JointPlace(joint.name, joint.parent, joint.child, joint.axes)
        for joint in joints_of(hand_type or (3 if divided else 1))
        if joint.parent is not None
    )
    return Layout(side, tuple(_place(name, divided) for name in names), joints)


def with_hand_type(layout: Layout, hand_type: HandType) -> Layout:
    """A glove's layout with the palm divided otherwise.

    Raises:
        LayoutError: it has a tree of its own, or no sensor that the type needs.
    """
    if layout.hand_type == hand_type:
        return layout
    if not _is_gloves(layout):
        raise LayoutError(
            "This layout has a tree of its own: its hand type is {own}, not {wanted}.",
            "Write the joints of the other type into layout.toml; docs/import.md shows how.",
            own=layout.hand_type,
            wanted=hand_type,
        )
    return glove(layout.side, layout.names, hand_type)


def divisible(layout: Layout) -> bool:
    """Whether its palm can be divided in all three ways: a glove's, with an ulnar sensor."""
    return _is_gloves(layout) and any(_GLOVE[name] == ULNAR for name in layout.names)


def _is_gloves(layout: Layout) -> bool:
    names = layout.names
    known = bool(names) and set(names) <= _GLOVE.keys()
    return known and layout == glove(layout.side, names, layout.hand_type)


def _place(name: str, divided: bool) -> SensorPlace:
    segment = _GLOVE[name]
    if segment == ULNAR and not divided:  # one block, and SN11 stands for it
        return SensorPlace(name, "hand", second=True)
    return SensorPlace(name, segment)
