"""What the model of a hand rests on, step by step, in words. Pure."""

from __future__ import annotations

import html
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from app.state import State
from app.views.answers import day_of
from app.words import _
from handstudio.calibration.subject import SubjectCalibration
from handstudio.device.orders import Phase
from handstudio.pipeline import Doubt

Stand: TypeAlias = Literal["done", "now", "open"]


@dataclass(frozen=True, slots=True)
class Step:
    """One thing the model rests on: what, where it stands, and what to do."""

    title: str
    stand: Stand
    figure: str
    advice: str = ""


def steps_of(state: State) -> tuple[Step, ...]:
    """The steps in the order in which they are taken."""
    return (_device(state), _rest(state), _hand(state), _sensors(state), _zero(state))


def as_html(steps: tuple[Step, ...]) -> str:
    """The steps as the page shows them."""
    return "".join(_row(step) for step in steps)


def _device(state: State) -> Step:
    title = _("Device")
    newest = state.newest
    if newest.phase is Phase.STREAMING and newest.setup is not None:
        sensors = _("{count} sensors").format(count=len(newest.setup.layout.sensors))
        return Step(title, "done", sensors)
    return Step(title, "now", _("none"), _("Connect one under Device."))


def _rest(state: State) -> Step:
    title = _("Rest")
    newest = state.newest
    if newest.setup is None or newest.motion is None or newest.phase is not Phase.STREAMING:
        return Step(title, "open", "", _("Half a second with the hand still places the sensors."))
    unplaced = (newest.motion.doubt[0] & np.uint8(Doubt.UNPLACED)) != 0
    count = len(unplaced)
    figure = _("{placed} of {count} sensors placed").format(
        placed=count - int(unplaced.sum()), count=count
    )
    if not unplaced.any():
        return Step(title, "done", figure)
    names = [newest.setup.layout.names[i] for i in np.flatnonzero(unplaced)]
    waiting = ", ".join(names) if len(names) <= 6 else ""
    advice = _("Lay the hand down and hold it still for half a second.")
    return Step(title, "now", figure, " ".join(filter(None, [advice, waiting])))


def _hand(state: State) -> Step:
    title = _("Hand length")
    subject = state.subject
    if subject is not None and subject.hand_length_mm is not None:
        return Step(title, "done", f"{subject.code}: {subject.hand_length_mm:.0f} mm")
    advice = _("Measure from the wrist crease to the tip of the middle finger; half a minute.")
    figure = _("{mm:.0f} mm, an average").format(mm=state.hand_length_mm)
    return Step(title, "now" if state.newest.setup is not None else "open", figure, advice)


def _zero(state: State) -> Step:
    title, used = _("Joints and zero"), state.in_use.subject
    if used is not None:
        other = _other_glove(state, used)
        return Step(title, "now" if other else "done", _made(state, used), other)
    if state.in_use.none:
        return Step(title, "open", _("nominal, as asked: there is a calibration"))
    return Step(
        title,
        "open",
        _("nominal: no calibration"),
        _(
            "Joint centres and axes are those of an average hand, and sensors count as mounted "
            "along their segments: angles carry the mounting's tilt as an offset."
        ),
    )


def _sensors(state: State) -> Step:
    title, used = _("Sensors"), state.in_use.sensors
    if used is None:
        advice = _("As they were shipped: scales may be off by some per cent.")
        return Step(title, "open", _("no calibration"), advice)
    words = _("calibrated {made}, {age}").format(
        made=day_of(used.made_utc), age=_age(state, used.made_utc)
    )
    return Step(title, "done", words)


def _made(state: State, used: SubjectCalibration) -> str:
    """Which one it is: when it was made, how old that is, from which take and on which glove."""
    takes = ", ".join(Path(name).stem for name, _sha in used.takes) or used.mirrored_from or "–"
    return _("calibrated {made}, {age}, from {take}, glove {glove}").format(
        made=day_of(used.made_utc),
        age=_age(state, used.made_utc),
        take=takes,
        glove=used.device or "–",
    )


def _other_glove(state: State, used: SubjectCalibration) -> str:
    setup = state.newest.setup
    serial = setup.device.serial_number if setup is not None and setup.device is not None else ""
    if not serial or not used.device or serial == used.device:
        return ""
    return _("This is the glove {serial}: its sensors sit otherwise; calibrate with it.").format(
        serial=serial
    )


def _age(state: State, made_utc: str) -> str:
    """How old it was when it was read."""
    now = state.in_use.now
    try:
        made = datetime.fromisoformat(made_utc)
    except ValueError:
        made = None
    if now is None or made is None or made.tzinfo is None:
        return _("of unknown age")
    days = (now.date() - made.date()).days
    return _("today") if days <= 0 else _("{days} d old").format(days=days)


_SIGNS = {"done": ("✓", "#12b886"), "now": ("●", "#f5a524"), "open": ("○", "currentColor")}


def _row(step: Step) -> str:
    sign, colour = _SIGNS[step.stand]
    advice = f'<div style="opacity:.75">{html.escape(step.advice)}</div>' if step.advice else ""
    return (
        '<div style="display:flex;gap:.6em;padding:.45em .75em;font-size:.82rem;line-height:1.4">'
        f'<span style="color:{colour};font-weight:700;width:1em">{sign}</span>'
        f"<div><b>{html.escape(step.title)}</b> {html.escape(step.figure)}{advice}</div></div>"
    )
