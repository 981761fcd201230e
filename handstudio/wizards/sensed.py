"""What becomes of a course as the device sends samples.

Phases and looks begin at instants, so that cutting the samples otherwise changes nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np

from handstudio.calibration.course import Step
from handstudio.calibration.verdict import Verdict
from handstudio.layout import Layout
from handstudio.samples import ImuSamples
from handstudio.wizards.events import Cue, Labelled
from handstudio.wizards.phases import asked, begun_step, doing, onward, tell, to, with_outcome
from handstudio.wizards.state import COUNT_S, SHOWN_S, Course, Outcome, Phase, Standing
from handstudio.wizards.window import added, begun, compact, last

LOOK_S = 0.25
"""Between two looks at what was done so far."""

READ_S = 2.5
"""How long a step is shown before the count where the course goes on by itself."""

RESTED = 0.75
"""Of the rest that is asked for, so much has to be still: the count before it was rest too."""

REST_MORE_S = 3.0
"""So much longer than is asked for it is waited for stillness."""

SETTLE_S = 6.0
"""A wearer who performs begins to move within this; until then a rest is that of before."""

GAP_S = 0.25
"""A hole longer than this in what a step holds has the step begun anew."""

_TRIED_S = 15.0  # a wearer who performs has shown all of a try-out by then
_MARGIN_S = 0.05  # kept beyond what is judged: instants do not fall on its edge
_STILL = ("rest", "pose", "fit")  # kinds of which the newest stretch counts, not the first


@runtime_checkable
class Judge(Protocol):
    """Sees what a step is, and whether there is enough of it."""

    def observe(
        self, step: Step, rest: ImuSamples | None, done: ImuSamples, layout: Layout
    ) -> Verdict:
        """What the step was seen to be so far."""

    def enough(self, verdict: Verdict, step: Step, seconds: float) -> bool:
        """Whether it can stop."""


def felt(course: Course, samples: ImuSamples, judge: Judge) -> Course:
    """Take in a run, piece by piece: phases and looks begin at instants, not at runs."""
    while len(samples):
        course = _over_a_gap(course, int(samples.time_us[0]))
        if course.since_us is None:
            course = _from(course, int(samples.time_us[0]))
        at = int(np.searchsorted(samples.time_us, course.due_us))  # the first one not before it
        piece, samples = samples[: at + 1], samples[at + 1 :]
        course = _taken(course, piece)
        if course.now_us is not None and course.now_us >= course.due_us:
            course = _looked(course, judge)
    return course


def judged(course: Course, judge: Judge) -> Course:
    """The step is done: what was it?"""
    step, done = course.step, course.done.samples
    if done is None:
        return course
    verdict = judge.observe(step, course.rest.samples, done, course.layout)
    good = verdict.ok or (step.kind == "tryout" and not verdict.failing)
    label = Labelled(step.name, int(done.time_us[0]), int(done.time_us[-1]))
    course = with_outcome(course, Outcome(Standing.GOOD if good else Standing.REFUSED, verdict))
    course = tell(to(course, Phase.VERDICT), label, Cue.STOP)
    return course if good else tell(course, Cue.REFUSED)


def _over_a_gap(course: Course, next_us: int) -> Course:
    if course.phase is Phase.AWAY:
        return replace(to(course, Phase.INTRO), trouble="away")
    if course.now_us is None or 0 < next_us - course.now_us <= GAP_S * 1e6:
        return course
    match course.phase:
        case Phase.RESTING | Phase.DOING:
            return replace(to(course, Phase.COUNTDOWN), trouble="gap")
        case Phase.COUNTDOWN | Phase.INTRO | Phase.VERDICT | Phase.OVER:
            return replace(course, since_us=None)


def _from(course: Course, now_us: int) -> Course:
    """The phase begins with this instant."""
    every_us = _every_us(course)
    return replace(course, since_us=now_us, due_us=now_us + every_us)


def _every_us(course: Course) -> int:
    if course.phase is Phase.COUNTDOWN:
        return 1_000_000
    return round(max(LOOK_S, 0.01 * course.phase_s) * 1e6)  # of much, a look takes longer too


def _taken(course: Course, piece: ImuSamples) -> Course:
    course = replace(course, now_us=int(piece.time_us[-1]))
    match course.phase:
        case Phase.RESTING:
            return replace(course, rest=added(course.rest, piece))
        case Phase.DOING:
            return replace(course, done=added(course.done, piece))
        case Phase.INTRO | Phase.COUNTDOWN | Phase.VERDICT | Phase.AWAY | Phase.OVER:
            return course


def _looked(course: Course, judge: Judge) -> Course:
    """It is time to look."""
    course = replace(course, due_us=course.due_us + _every_us(course))
    match course.phase:
        case Phase.INTRO:
            ready = course.performing or (course.trouble == "" and course.phase_s >= READ_S)
            return begun_step(course) if course.by_itself and ready else course
        case Phase.COUNTDOWN:
            return _counted(course)
        case Phase.RESTING:
            return _resting(course, judge)
        case Phase.DOING:
            return _look_at_it(course, judge)
        case Phase.VERDICT:
            good = course.outcome.standing is Standing.GOOD
            goes = good and course.by_itself and course.phase_s >= SHOWN_S
            return onward(course) if goes else course
        case Phase.AWAY | Phase.OVER:
            return course


def _counted(course: Course) -> Course:
    if course.phase_s < COUNT_S - 1e-6:
        return tell(course, Cue.TICK)
    if course.step.rest_s > 0.0:
        course = asked(to(course, Phase.RESTING))
        return replace(course, rest=begun(course.rate_hz), moved=not course.performing)
    return doing(course)


def _resting(course: Course, judge: Judge) -> Course:
    """It goes on when all was still for long enough, or at last in any case: the verdict tells.

    What is just still enough may have come to rest only then, so one more look is taken, and the
    calmer of both rests counts.
    """
    step, long_s = course.step, RESTED * course.step.rest_s + _MARGIN_S
    course = replace(course, rest=last(course.rest, long_s + 2.0 * LOOK_S))
    newest = last(course.rest, long_s).samples
    if newest is None:
        return course
    live = _rest_of(course, newest, judge)
    course = replace(course, live=live)
    if course.calm_us is not None:
        return _calmer(course, newest, long_s, judge)
    full = course.rest.seconds >= long_s - _MARGIN_S
    moved = course.moved or (full and not live.ok) or course.phase_s >= SETTLE_S
    late = course.phase_s >= step.rest_s + REST_MORE_S
    calm_us = course.now_us if moved and full and (live.ok or late) else None
    return replace(course, moved=moved, calm_us=calm_us)


def _rest_of(course: Course, rest: ImuSamples, judge: Judge) -> Verdict:
    """Of a step that was not begun only the rest before it says anything."""
    verdict = judge.observe(course.step, rest, rest[:0], course.layout)
    said = [r for r in verdict.readings if r.what == "stillness" or r.about == "static"]
    return Verdict(verdict.step, tuple(said))


def _calmer(course: Course, newest: ImuSamples, long_s: float, judge: Judge) -> Course:
    """Of the rest now and the one at the look before."""
    whole = course.rest.samples
    if whole is None or course.calm_us is None:
        return course
    until = int(np.searchsorted(whole.time_us, course.calm_us, side="right"))
    since_us = course.calm_us - round(long_s * 1e6)
    before = whole[int(np.searchsorted(whole.time_us, since_us)) : until]
    pair = [_share(_rest_of(course, rest, judge)) for rest in (before, newest)]
    return _rested(course, before, whole[until:]) if pair[0] <= pair[1] else _rested(course, newest)


def _share(verdict: Verdict) -> float:
    """How much of what is allowed there was; what could not be had is more than anything."""
    shares = [reading.share for reading in verdict.readings if not reading.at_least]
    return max((float("inf") if np.isnan(s) else s for s in shares), default=float("inf"))


def _rested(course: Course, rest: ImuSamples, after: ImuSamples | None = None) -> Course:
    label = Labelled("static", int(rest.time_us[0]), int(rest.time_us[-1]))
    held, done = (begun(course.rate_hz) for _ in range(2))
    # what was kept is thinned already
    held = replace(held, kept=len(rest), pieces=(rest,))
    if after is not None and len(after):
        done = replace(done, kept=len(after), pieces=(after,))
    course = replace(to(tell(course, label), Phase.DOING), rest=held, done=done)
    return tell(course, Cue.START)


def _look_at_it(course: Course, judge: Judge) -> Course:
    step, newest = course.step, course.step.kind in _STILL
    kept = last(course.done, step.least_s + _MARGIN_S) if newest else compact(course.done)
    course = replace(course, done=kept)
    done = kept.samples
    if done is None:
        return course
    live = judge.observe(step, course.rest.samples, done, course.layout)
    course = replace(course, live=live)
    seconds = course.phase_s if newest else kept.seconds
    most_s = _TRIED_S if course.performing and step.kind == "tryout" else step.most_s
    stops = judge.enough(live, step, seconds + 1.0 / course.rate_hz) or course.phase_s >= most_s
    return judged(course, judge) if stops else course
