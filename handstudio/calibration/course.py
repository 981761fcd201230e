"""What a calibration asks a person to do, step by step; names are the labels of a take."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from handstudio.hand.skeleton import FINGERS
from handstudio.layout import Layout

Kind: TypeAlias = Literal[
    "fit", "rest", "turn", "swing", "pose", "grasp", "tumble", "noise", "tryout"
]
"""fit: the glove sits and every sensor answers; rest: nothing moves; turn: the whole rig is turned
about a level axis; swing: one joint to and fro; pose: the hand lies flat; grasp: it
opens and closes; tumble: the board lies still in many directions; noise: nothing moves for long;
tryout: a look at the result."""


class Step(msgspec.Struct, frozen=True):
    """One step of a course.

    Attributes:
        name: Of the step; also the label of the take it leaves behind.
        kind: What is asked for.
        joint: Which joint swings, else empty.
        turn: About which axis it swings: "flexion", "abduction", "deviation", "rotation", or empty.
        rest_s: How long everything rests before, labelled ``static``.
        least_s: The shortest it may take: it stops by itself when there is enough.
        most_s: When it stops in any case.
        optional: Whether it may be skipped and the rest still gives a calibration.
        perform: What a virtual glove is asked to perform; empty: nothing.
    """

    name: str
    kind: Kind
    joint: str = ""
    turn: str = ""
    rest_s: float = 0.0
    least_s: float = 2.0
    most_s: float = 10.0
    optional: bool = False
    perform: str = ""


def _swing(joint: str, turn: str, optional: bool = False) -> Step:
    name = f"{joint}:{turn}"
    return Step(name, "swing", joint, turn, 2.0, 5.0, 15.0, optional, name)


def _of_finger(finger: str) -> tuple[Step, ...]:
    mcp, pip, dip = (f"{finger}_{joint}" for joint in ("mcp", "pip", "dip"))
    return (
        _swing(mcp, "flexion"),
        _swing(mcp, "abduction"),
        _swing(pip, "flexion"),
        _swing(dip, "flexion"),
    )


FIT = Step("fit", "fit", least_s=2.0, most_s=60.0)
REST = Step("static", "rest", least_s=2.0, most_s=6.0, perform="static")
TURN = Step("heading_rotation", "turn", least_s=1.5, most_s=6.0, perform="heading_rotation")
FLAT = Step("flat_hand", "pose", least_s=2.0, most_s=8.0, perform="flat_hand")
GRASP = Step("open_close", "grasp", least_s=5.0, most_s=12.0, perform="open_close")
TRYOUT = Step("tryout", "tryout", least_s=5.0, most_s=60.0, optional=True, perform="tryout")
TUMBLE = Step("tumble", "tumble", least_s=30.0, most_s=180.0, perform="tumble")
NOISE = Step("rest", "noise", least_s=600.0, most_s=7200.0, perform="rest:3600")

SWINGS: tuple[Step, ...] = (
    _swing("elbow", "flexion"),
    _swing("elbow", "rotation", optional=True),
    _swing("wrist", "flexion"),
    _swing("wrist", "deviation"),
    _swing("ulnar_cmc", "flexion", optional=True),
    _swing("thumb_cmc", "flexion"),
    _swing("thumb_cmc", "abduction"),
    _swing("thumb_mcp", "flexion"),
    _swing("thumb_mcp", "abduction"),
    _swing("thumb_ip", "flexion"),
    *(step for finger in FINGERS[1:] for step in _of_finger(finger)),
)
"""Every joint, from the elbow out, in the order of a course."""

QUICK_START: tuple[Step, ...] = (REST, TURN, REST)
"""What every take begins with."""

HAND: tuple[Step, ...] = (FIT, *QUICK_START, *SWINGS, FLAT, TRYOUT)
"""The course that calibrates a subject."""

CHECK: tuple[Step, ...] = (*QUICK_START, FLAT, GRASP)
"""Whether yesterday's calibration still holds, the glove having been put on again."""

COURSES: dict[str, tuple[Step, ...]] = {
    "hand": HAND,
    "check": CHECK,
    "quick_start": QUICK_START,
    "sensors": (FIT, TUMBLE),
    "noise": (FIT, NOISE),
}
"""Courses by name."""


def course(name: str, layout: Layout) -> tuple[Step, ...]:
    """The steps of a course that this layout has sensors for."""
    there = {joint.name for joint in layout.instrumented_joints} | {"elbow"}
    return tuple(step for step in COURSES[name] if not step.joint or step.joint in there)
