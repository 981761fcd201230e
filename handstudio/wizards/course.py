"""A course of calibration steps: one value, made anew by what happens.

``advance(course, event, judge) -> course``. Time is the device's, in the samples; there is no other
clock. What is to be heard, asked of the device and written down stands in ``told`` after each
event. Cutting the samples otherwise changes nothing.
"""

from __future__ import annotations

from dataclasses import replace

from handstudio.wizards.events import (
    Accept,
    Cue,
    Event,
    GoByItself,
    Labelled,
    Leave,
    Lost,
    Next,
    Perform,
    Redo,
    Repeat,
    Samples,
    Skip,
)
from handstudio.wizards.phases import begun_step, onward, to, with_outcome
from handstudio.wizards.sensed import Judge, felt, judged
from handstudio.wizards.state import Course, Outcome, Phase, Standing, begin, usual_s

__all__ = [
    "Accept",
    "Course",
    "Cue",
    "Event",
    "GoByItself",
    "Judge",
    "Labelled",
    "Leave",
    "Lost",
    "Next",
    "Outcome",
    "Perform",
    "Phase",
    "Redo",
    "Repeat",
    "Samples",
    "Skip",
    "Standing",
    "advance",
    "begin",
    "usual_s",
]


def advance(course: Course, event: Event, judge: Judge) -> Course:  # noqa: PLR0911 - a list
    """What becomes of a course when this happens."""
    course = replace(course, told=())
    match event:
        case Samples(samples=samples):
            return felt(course, samples, judge)
        case Lost():
            return _lost(course)
        case Next():
            return _next(course, judge)
        case Repeat():
            return _again(course)
        case Accept():
            return _accepted(course)
        case Skip():
            return _skipped(course)
        case Redo(index=index):
            return _redone(course, index)
        case GoByItself(on=on):
            return replace(course, by_itself=on)
        case Leave():
            return course if course.phase is Phase.OVER else to(course, Phase.INTRO)


def _next(course: Course, judge: Judge) -> Course:
    match course.phase:
        case Phase.INTRO:
            return begun_step(course)
        case Phase.DOING:
            return course if course.live is None else judged(course, judge)
        case Phase.VERDICT:
            good = course.outcome.standing is Standing.GOOD
            return onward(course) if good else begun_step(course)
        case Phase.COUNTDOWN | Phase.RESTING | Phase.AWAY | Phase.OVER:
            return course


def _again(course: Course) -> Course:
    match course.phase:
        case Phase.INTRO | Phase.COUNTDOWN | Phase.RESTING | Phase.DOING | Phase.VERDICT:
            return begun_step(course)
        case Phase.AWAY | Phase.OVER:
            return course


def _accepted(course: Course) -> Course:
    refused = course.phase is Phase.VERDICT and course.outcome.standing is Standing.REFUSED
    if not refused:
        return course
    return onward(with_outcome(course, replace(course.outcome, standing=Standing.ACCEPTED)))


def _skipped(course: Course) -> Course:
    if course.phase is Phase.OVER or not course.step.optional:
        return course
    return onward(with_outcome(course, replace(course.outcome, standing=Standing.SKIPPED)))


def _redone(course: Course, index: int) -> Course:
    if not 0 <= index < len(course.steps):
        return course
    course = to(replace(course, index=index), Phase.INTRO)
    return with_outcome(course, replace(course.outcome, standing=Standing.OPEN))


def _lost(course: Course) -> Course:
    match course.phase:
        case Phase.COUNTDOWN | Phase.RESTING | Phase.DOING:
            return replace(to(course, Phase.AWAY), trouble="away")
        case Phase.INTRO | Phase.VERDICT | Phase.AWAY | Phase.OVER:
            return course
