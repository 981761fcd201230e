"""A course that was left, as text: it goes on later, also on another day and in another take."""

from __future__ import annotations

from dataclasses import replace

import msgspec

from handstudio.calibration.course import Step
from handstudio.calibration.verdict import Verdict
from handstudio.errors import CalibrationError
from handstudio.wizards.state import Course, Outcome, Phase, Standing

FORMAT = 1

OF_EVERY_TAKE = ("fit", "rest", "turn")
"""Kinds of steps that every take needs for itself."""


class _Step(msgspec.Struct):
    name: str
    standing: Standing
    verdict: Verdict | None


class _Saved(msgspec.Struct):
    course: str
    steps: tuple[_Step, ...]
    format: int = FORMAT


def pack(course: Course) -> bytes:
    """What of a course is worth keeping: what its steps were seen to be. JSON."""
    steps = tuple(
        _Step(step.name, outcome.standing, outcome.verdict)
        for step, outcome in zip(course.steps, course.outcomes, strict=True)
    )
    return msgspec.json.format(msgspec.json.encode(_Saved(course.name, steps)))


def resumed(course: Course, saved: bytes, name: str) -> Course:
    """A course just begun, as it was left: at its first step without a good verdict.

    Args:
        course: As `begin` gives it.
        saved: Of `pack`.
        name: What an error calls the text.

    Raises:
        CalibrationError: it is no course, is damaged, or of another kind or a newer version.
    """
    try:
        kept = msgspec.json.decode(saved, type=_Saved)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise _unreadable(name, error) from error
    if kept.format > FORMAT or kept.course != course.name:
        raise _unreadable(name, f"{kept.course}, format {kept.format}")
    outcomes = _outcomes(course.steps, kept.steps)
    open_ones = [i for i, each in enumerate(outcomes) if not each.standing.settled]
    if not open_ones:
        return replace(course, outcomes=outcomes, phase=Phase.OVER)
    return replace(course, outcomes=outcomes, index=open_ones[0])


def _outcomes(steps: tuple[Step, ...], kept: tuple[_Step, ...]) -> tuple[Outcome, ...]:
    """Of each step by its name; of a name that comes twice the first is the first."""
    waiting = list(kept)
    outcomes = []
    for step in steps:
        found = next((each for each in waiting if each.name == step.name), None)
        if found is not None:
            waiting.remove(found)
        again = found is None or step.kind in OF_EVERY_TAKE or not found.standing.settled
        outcomes.append(
            Outcome() if again or found is None else Outcome(found.standing, found.verdict)
        )
    return tuple(outcomes)


def _unreadable(name: str, reason: object) -> CalibrationError:
    return CalibrationError(
        "{name}: not a course of calibration that can be gone on with ({reason}).",
        "Begin the course anew; what was recorded is kept.",
        name=name,
        reason=reason,
    )
