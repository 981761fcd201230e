"""From one phase of a course to another, and from step to step."""

from __future__ import annotations

from dataclasses import replace

from handstudio.wizards.events import Cue, Perform, Told
from handstudio.wizards.state import Course, Outcome, Phase
from handstudio.wizards.window import Window, begun


def onward(course: Course) -> Course:
    """To the next step that needs something, else to the first that does, else it is over."""
    open_ones = [i for i, each in enumerate(course.outcomes) if not each.standing.settled]
    later = [i for i in open_ones if i > course.index]
    if not open_ones:
        return to(course, Phase.OVER)
    return to(replace(course, index=(later or open_ones)[0]), Phase.INTRO)


def begun_step(course: Course) -> Course:
    """The step begins: with the count, but where there is nothing to get ready for."""
    if course.step.kind == "fit":
        return doing(course)
    return to(course, Phase.COUNTDOWN)


def doing(course: Course) -> Course:
    """The step is done from the next instant on."""
    course = replace(asked(to(course, Phase.DOING)), done=begun(course.rate_hz))
    return tell(course, Cue.START)


def asked(course: Course) -> Course:
    """Whoever wears the glove is asked to perform, where the device can ask."""
    motions = course.step.perform or ("static" if course.step.kind == "fit" else "")
    return tell(course, Perform(motions)) if course.performing and motions else course


def to(course: Course, phase: Phase) -> Course:
    """Another phase, from the next instant on; nothing of the one before is kept."""
    course = replace(
        course,
        phase=phase,
        since_us=None,
        rest=Window(),
        done=Window(),
        live=None,
        moved=False,
        calm_us=None,
        trouble="",
    )
    return tell(course, Cue.TICK) if phase is Phase.COUNTDOWN else course


def tell(course: Course, *told: Told) -> Course:
    """The same, with more to tell."""
    return replace(course, told=(*course.told, *told))


def with_outcome(course: Course, outcome: Outcome) -> Course:
    """The same, with this outcome of the step that is on."""
    outcomes = list(course.outcomes)
    outcomes[course.index] = outcome
    return replace(course, outcomes=tuple(outcomes))
