"""Steps of a calibration in words: what to do, what was measured, what to do about it. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable

from app.words import _
from handstudio.calibration.course import Step
from handstudio.calibration.verdict import Reading


def course_name(name: str) -> str:
    """What a course is called."""
    known = {
        "hand": _("Hand"),
        "check": _("Check"),
        "quick_start": _("Quick start"),
        "sensors": _("Sensors"),
        "noise": _("Noise"),
    }
    return known.get(name, name.replace("_", " ").capitalize())


def course_purpose(name: str) -> str:
    """What a course is for, in a sentence."""
    return {
        "hand": _("Joint centres, axes and lengths of this hand, and how the glove sits on it."),
        "check": _("After putting the glove on again: does the calibration still hold?"),
        "quick_start": _("Places the sensors and aligns their headings; before every take."),
        "sensors": _("Bias, scale and axes of the sensors; once per device, and seldom again."),
        "noise": _("How noisy the sensors are; the glove lies still for ten minutes or more."),
    }.get(name, "")


def title_of(step: Step) -> str:
    """A step in two or three words."""
    fixed = {
        "fit": _("Fit of the glove"),
        "rest": _("Rest"),
        "turn": _("Lift the arm"),
        "pose": _("Flat hand"),
        "grasp": _("Open and close"),
        "tumble": _("All directions"),
        "noise": _("Long rest"),
        "tryout": _("Try it out"),
    }
    if step.kind in fixed:
        return fixed[step.kind]
    return f"{joint_name(step.joint)}: {_turns().get(step.turn, step.turn)}"


def joint_name(joint: str) -> str:
    """A joint, a segment or a sensor as people call it."""
    first, _sep, rest = joint.partition("_")
    parts = {
        "elbow": _("Elbow"),
        "wrist": _("Wrist"),
        "ulnar": _("Edge of the palm"),
        "forearm": _("Forearm"),
        "hand": _("Hand"),
        "thumb": _("Thumb"),
        "index": _("Index"),
        "middle": _("Middle"),
        "ring": _("Ring"),
        "little": _("Little"),
    }
    if joint in ("hand_ulnar", "wrist_ulnar"):
        return parts["ulnar"]
    joints = {
        "mcp": _("MCP"),
        "pip": _("PIP"),
        "dip": _("DIP"),
        "cmc": _("CMC"),
        "ip": _("IP"),
        "metacarpal": _("metacarpal"),
        "proximal": _("proximal"),
        "intermediate": _("middle phalanx"),
        "distal": _("distal"),
    }
    short = "" if first == "ulnar" else joints.get(rest, rest)
    return " ".join(filter(None, [parts.get(first, first), short]))


def sentence_of(step: Step) -> str:
    """What to do, in one sentence to whoever wears the glove."""
    fixed = {
        "fit": _("Put the glove on and lay the hand flat on the table, palm down."),
        "rest": _("Lay arm and hand flat on the table and keep still."),
        "turn": _("Hand and fingers stiff: lift the forearm at the elbow, and lay it back."),
        "pose": _("Lay the hand flat on the table, fingers straight, and keep still."),
        "grasp": _("Open the hand wide, make a fist, and again."),
        "tumble": _("Lay it down in one direction after the other, two seconds still in each."),
        "noise": _("Lay the glove on something solid and leave it alone."),
        "tryout": _("Touch the thumb to every fingertip, then make a fist."),
    }
    return fixed[step.kind] if step.kind in fixed else _swing_sentence(step)


def _swing_sentence(step: Step) -> str:
    said = {
        "elbow:flexion": _("Keep the elbow in its place; raise and lower the forearm."),
        "elbow:rotation": _("Forearm upright: turn it about the upper arm, to both sides."),
        "wrist:flexion": _("Keep the forearm still; bend and stretch the wrist."),
        "wrist:deviation": _("Keep the forearm still; move the hand from side to side."),
        "ulnar_cmc:flexion": _("Fold the edge of the palm towards the thumb, and open it."),
        "thumb_cmc:flexion": _("Swing the whole thumb across the palm, and back."),
        "thumb_cmc:abduction": _("Lift the whole thumb off the palm, and bring it back."),
        "thumb_mcp:flexion": _("Bend and stretch the thumb at its MCP joint."),
        "thumb_mcp:abduction": _("Rock the thumb from side to side at its MCP joint."),
        "thumb_ip:flexion": _("Bend and stretch the tip of the thumb."),
    }
    if step.name in said:
        return said[step.name]
    finger, _sep, joint = step.joint.partition("_")
    fingers = {
        "index": _("index finger"),
        "middle": _("middle finger"),
        "ring": _("ring finger"),
        "little": _("little finger"),
    }
    sentences = {
        ("mcp", "flexion"): _("Bend and stretch the {finger} at the knuckle (MCP)."),
        ("mcp", "abduction"): _("Move the {finger} from side to side at the knuckle (MCP)."),
        ("pip", "flexion"): _("Bend and stretch the {finger} at its middle joint (PIP)."),
        ("dip", "flexion"): _(
            "Hold the {finger} with the other hand; bend and stretch its last joint (DIP)."
        ),
    }
    sentence = sentences.get((joint, step.turn), _("Swing {joint} to and fro."))
    return sentence.format(finger=fingers.get(finger, finger), joint=joint_name(step.joint))


def cost_of(step: Step) -> str:  # noqa: PLR0911 - a list
    """What it costs to skip a step, or to use one that was refused."""
    match step.kind:
        case "fit":
            return _("Sensors that do not answer, or sit elsewhere, spoil every step after this.")
        case "rest" | "turn":
            return _("Headings of the sensors are less sure: all angles may be off by degrees.")
        case "swing":
            return _("Place and axis of this joint then lean on average proportions.")
        case "pose":
            return _("The zero of all angles is less sure.")
        case "grasp":
            return _("The check then says less of how fingers bend.")
        case "tumble" | "noise":
            return _("The sensors stay as they were known before.")
        case "tryout":
            return _("Nothing is computed from it; it only shows whether the rest was good.")


# --- readings -------------------------------------------------------------------------------------


def label_of(reading: Reading) -> str:
    """What a figure is of."""
    if reading.what == "time" and reading.about == "static":
        return _("Rest before")
    return {
        "answering": _("Answering"),
        "upright": _("Attitude"),
        "stillness": _("Stillness"),
        "range": _("Range"),
        "second_axis": _("Second axis"),
        "pace": _("Pace"),
        "others": _("Other joints"),
        "time": _("Time"),
        "turn": _("Lifted by"),
        "together": _("Stiffness"),
        "directions": _("Directions"),
        "residual": _("Residual"),
        "against": _("Against before"),
    }[reading.what]


def figure_of(value: float, unit: str) -> str:  # noqa: PLR0911 - a list
    """A figure with its unit, as far as its digits mean something."""
    if math.isnan(value):
        return "–"
    match unit:
        case "deg":
            return f"{value:.1f}°" if value < 15.0 else f"{value:.0f}°"
        case "deg/s":
            return f"{value:.1f} °/s"
        case "1/s":
            return f"{value:.1f} /s"
        case "s":
            return f"{value:.1f} s" if value < 60.0 else f"{value / 60.0:.0f} min"
        case "":
            return f"{value:.0f}"
    return f"{value:.0f} {unit}" if value >= 10.0 else f"{value:.1f} {unit}"


def failing_of(reading: Reading, joint: str = "") -> str:
    """What is not as it should be, by how much, and what to do; ``joint`` is the step's."""
    value, limit = (figure_of(each, reading.unit) for each in (reading.value, reading.limit))
    figures = (
        _("{value}, {limit} wanted") if reading.at_least else _("{value}, at most {limit}")
    ).format(value=value, limit=limit)
    said, remedy = _said_of(reading), _remedy_of(reading)
    if reading.what == "others" and joint and reading.about == joint:
        said, remedy = _("It bent along by"), _("move it from side to side only.")
    if reading.what == "range" and reading.about:
        said = _("{about} bent by").format(about=joint_name(reading.about))
        remedy = _("open the hand wide and make a whole fist.")
    return _("{what} {figures}: {remedy}").format(what=said, figures=figures, remedy=remedy)


def _said_of(reading: Reading) -> str:
    about = joint_name(reading.about) if reading.about else ""
    said: dict[str, Callable[[], str]] = {
        "answering": lambda: _("{about} answers").format(about=about or _("A sensor")),
        "upright": lambda: _("{about} lies off by").format(about=about or _("A sensor")),
        "stillness": lambda: _("{about} still moved").format(about=about or _("The hand")),
        "range": lambda: _("Swung by"),
        "second_axis": lambda: _("Second axis covered"),
        "pace": lambda: _("Too slow:") if reading.at_least else _("Too fast:"),
        "others": lambda: _("{about} moved along by").format(about=about or _("Another joint")),
        "time": lambda: _("Rested") if reading.about == "static" else _("Lasted"),
        "turn": lambda: _("Lifted by"),
        "together": lambda: _("{about} gave by").format(about=about or _("A joint")),
        "directions": lambda: _("Directions:"),
        "residual": lambda: _("{about} does not fit by").format(about=about).strip(),
        "against": lambda: _("{about} has moved by").format(about=about).strip(),
    }
    return said[reading.what]()


def _remedy_of(reading: Reading) -> str:
    if reading.what == "time" and reading.about == "static":
        return _("keep still until the high tone.")
    if reading.what == "pace" and not reading.at_least:
        return _("swing more slowly.")
    return {
        "answering": _("check its plug, then repeat."),
        "upright": _("check that it sits on its place, then repeat."),
        "stillness": _("keep still until the high tone."),
        "range": _("swing further."),
        "second_axis": _("repeat the sideways swing."),
        "pace": _("swing faster, as the pale hand does."),
        "others": _("move only the joint that is asked for."),
        "time": _("go on until the low tone."),
        "turn": _("lift the arm further."),
        "together": _("keep hand and fingers stiff."),
        "directions": _("lay it down in other directions too."),
        "residual": _("repeat this step."),
        "against": _("calibrate again."),
    }[reading.what]


def _turns() -> dict[str, str]:
    return {
        "flexion": _("flexion"),
        "abduction": _("abduction"),
        "deviation": _("deviation"),
        "rotation": _("rotation"),
    }
