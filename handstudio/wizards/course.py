"""A course of calibration steps: one value, made anew by what happens.

``advance(course, event, judge) -> course``. Time is the device's, in the samples; there is no other
clock. What is to be heard, asked of the device and written down stands in ``told`` after each
event. Cutting the samples otherwise changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Literal, Protocol, TypeAlias, runtime_checkable

import numpy as np

from handstudio.calibration.course import Step
from handstudio.calibration.verdict import Verdict
from handstudio.layout import Layout
from handstudio.samples import ImuSamples
from handstudio.wizards.window import Window, added, begun, compact, last

COUNT_S = 3.0
"""Counted before a step."""

LOOK_S = 0.25
"""Between two looks at what was done so far."""

READ_S = 2.5
"""How long a step is shown before the count where the course goes on by itself."""

SHOWN_S = 1.5
"""How long a good verdict is shown before it goes on by itself."""

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


class Phase(Enum):
    """Where a step stands."""

    INTRO = "intro"  # it is shown; somebody says when it begins
    COUNTDOWN = "countdown"
    RESTING = "resting"
    DOING = "doing"
    VERDICT = "verdict"
    AWAY = "away"  # the device was lost in the middle of it
    OVER = "over"  # every step is done or skipped


class Standing(Enum):
    """What became of a step."""

    OPEN = "open"
    GOOD = "good"
    REFUSED = "refused"
    ACCEPTED = "accepted"  # refused, and used all the same
    SKIPPED = "skipped"

    @property
    def settled(self) -> bool:
        """Whether the course goes on past it."""
        return self in (Standing.GOOD, Standing.ACCEPTED, Standing.SKIPPED)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a step was seen to be, and what became of it."""

    standing: Standing = Standing.OPEN
    verdict: Verdict | None = None


# --- what is told ---------------------------------------------------------------------------------


class Cue(Enum):
    """Something to be heard."""

    TICK = "tick"
    START = "start"
    STOP = "stop"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True)
class Perform:
    """Have whoever wears the glove do this, where the device can ask."""

    motions: str


@dataclass(frozen=True, slots=True)
class Labelled:
    """This stretch of the device's time is to be written down [µs]."""

    label: str
    start_us: int
    end_us: int


Told: TypeAlias = Cue | Perform | Labelled


# --- what happens ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """The device sent these."""

    samples: ImuSamples


@dataclass(frozen=True, slots=True)
class Lost:
    """The device is away."""


@dataclass(frozen=True, slots=True)
class Next:
    """Go on: begin the step, end it now, repeat a refused one, or go to the next."""


@dataclass(frozen=True, slots=True)
class Repeat:
    """The step once more."""


@dataclass(frozen=True, slots=True)
class Accept:
    """Use the step though it was refused."""


@dataclass(frozen=True, slots=True)
class Skip:
    """Leave the step out, where it may be."""


@dataclass(frozen=True, slots=True)
class Redo:
    """This step, by its place in the course, once more; the others stay."""

    index: int


@dataclass(frozen=True, slots=True)
class GoByItself:
    """Whether the course goes on without anybody saying so."""

    on: bool


@dataclass(frozen=True, slots=True)
class Leave:
    """No more for now; the step that is on is begun anew when somebody comes back."""


Event: TypeAlias = Samples | Lost | Next | Repeat | Accept | Skip | Redo | GoByItself | Leave


@runtime_checkable
class Judge(Protocol):
    """Sees what a step is, and whether there is enough of it."""

    def observe(
        self, step: Step, rest: ImuSamples | None, done: ImuSamples, layout: Layout
    ) -> Verdict:
        """What the step was seen to be so far."""

    def enough(self, verdict: Verdict, step: Step, seconds: float) -> bool:
        """Whether it can stop."""


# --- the course -----------------------------------------------------------------------------------

Trouble: TypeAlias = Literal["", "away", "gap"]
"""Why a step was begun anew by itself."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A course and where it stands.

    Attributes:
        name: Of the course.
        layout: Of the device.
        rate_hz: Of the device.
        steps: In order.
        outcomes: One a step.
        index: The step that is on.
        phase: Where it stands.
        performing: Whoever wears the glove does what the device is asked for.
        by_itself: It goes on without anybody saying so, except past a refused step.
        since_us: When the phase began; None: with the next instant.
        now_us: The newest instant.
        rest: What was felt while everything rested before the step.
        done: What was felt while it was done.
        live: What is seen of it so far.
        moved: The wearer was seen to move since it was asked to perform.
        calm_us: When it had rested for long enough, until the next look.
        trouble: Why it stands here, where that is no good news.
        told: What to hear, ask and write down since the last event.
    """

    name: str
    layout: Layout
    rate_hz: float
    steps: tuple[Step, ...]
    outcomes: tuple[Outcome, ...]
    index: int = 0
    phase: Phase = Phase.INTRO
    performing: bool = False
    by_itself: bool = False
    since_us: int | None = None
    now_us: int | None = None
    due_us: int = 0
    rest: Window = Window()
    done: Window = Window()
    live: Verdict | None = None
    moved: bool = False
    calm_us: int | None = None
    trouble: Trouble = ""
    told: tuple[Told, ...] = ()

    @property
    def step(self) -> Step:
        """The step that is on."""
        return self.steps[self.index]

    @property
    def outcome(self) -> Outcome:
        """What became of it so far."""
        return self.outcomes[self.index]

    @property
    def phase_s(self) -> float:
        """How long the phase has been on."""
        if self.since_us is None or self.now_us is None:
            return 0.0
        return (self.now_us - self.since_us) * 1e-6

    @property
    def count(self) -> int:
        """What is counted: 3, 2, 1."""
        return max(1, int(np.ceil(COUNT_S - self.phase_s)))

    @property
    def settled(self) -> int:
        """How many steps need nothing more."""
        return sum(outcome.standing.settled for outcome in self.outcomes)

    @property
    def seconds_left(self) -> float:
        """About how long the rest of it takes."""
        pairs = zip(self.steps, self.outcomes, strict=True)
        return sum((usual_s(step) for step, each in pairs if not each.standing.settled), 0.0)


def usual_s(step: Step) -> float:
    """About how long a step takes with everything around it [s]."""
    around = 0.0 if step.kind == "fit" else COUNT_S
    return around + step.rest_s + step.least_s + SHOWN_S


def begin(
    name: str,
    steps: tuple[Step, ...],
    layout: Layout,
    rate_hz: float,
    *,
    performing: bool = False,
) -> Course:
    """A course at its first step."""
    outcomes = tuple(Outcome() for _ in steps)
    return Course(
        name,
        layout,
        rate_hz,
        steps,
        outcomes,
        performing=performing,
        by_itself=performing,
    )


def advance(course: Course, event: Event, judge: Judge) -> Course:  # noqa: PLR0911 - a list
    """What becomes of a course when this happens."""
    course = replace(course, told=())
    match event:
        case Samples(samples=samples):
            return _felt(course, samples, judge)
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
            return course if course.phase is Phase.OVER else _to(course, Phase.INTRO)


# --- what people say ------------------------------------------------------------------------------


def _next(course: Course, judge: Judge) -> Course:
    match course.phase:
        case Phase.INTRO:
            return _begun(course)
        case Phase.DOING:
            return course if course.live is None else _judged(course, judge)
        case Phase.VERDICT:
            good = course.outcome.standing is Standing.GOOD
            return _onward(course) if good else _begun(course)
        case Phase.COUNTDOWN | Phase.RESTING | Phase.AWAY | Phase.OVER:
            return course


def _again(course: Course) -> Course:
    match course.phase:
        case Phase.INTRO | Phase.COUNTDOWN | Phase.RESTING | Phase.DOING | Phase.VERDICT:
            return _begun(course)
        case Phase.AWAY | Phase.OVER:
            return course


def _accepted(course: Course) -> Course:
    refused = course.phase is Phase.VERDICT and course.outcome.standing is Standing.REFUSED
    if not refused:
        return course
    return _onward(_with_outcome(course, replace(course.outcome, standing=Standing.ACCEPTED)))


def _skipped(course: Course) -> Course:
    if course.phase is Phase.OVER or not course.step.optional:
        return course
    return _onward(_with_outcome(course, replace(course.outcome, standing=Standing.SKIPPED)))


def _redone(course: Course, index: int) -> Course:
    if not 0 <= index < len(course.steps):
        return course
    course = _to(replace(course, index=index), Phase.INTRO)
    return _with_outcome(course, replace(course.outcome, standing=Standing.OPEN))


def _onward(course: Course) -> Course:
    """To the next step that needs something, else to the first that does, else it is over."""
    open_ones = [i for i, each in enumerate(course.outcomes) if not each.standing.settled]
    later = [i for i in open_ones if i > course.index]
    if not open_ones:
        return _to(course, Phase.OVER)
    return _to(replace(course, index=(later or open_ones)[0]), Phase.INTRO)


def _begun(course: Course) -> Course:
    """The step begins: with the count, but where there is nothing to get ready for."""
    if course.step.kind == "fit":
        return _doing(course)
    return _to(course, Phase.COUNTDOWN)


def _lost(course: Course) -> Course:
    match course.phase:
        case Phase.COUNTDOWN | Phase.RESTING | Phase.DOING:
            return replace(_to(course, Phase.AWAY), trouble="away")
        case Phase.INTRO | Phase.VERDICT | Phase.AWAY | Phase.OVER:
            return course


# --- what the device sends ------------------------------------------------------------------------


def _felt(course: Course, samples: ImuSamples, judge: Judge) -> Course:
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


def _over_a_gap(course: Course, next_us: int) -> Course:
    if course.phase is Phase.AWAY:
        return replace(_to(course, Phase.INTRO), trouble="away")
    if course.now_us is None or 0 < next_us - course.now_us <= GAP_S * 1e6:
        return course
    match course.phase:
        case Phase.RESTING | Phase.DOING:
            return replace(_to(course, Phase.COUNTDOWN), trouble="gap")
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
            return _begun(course) if course.by_itself and ready else course
        case Phase.COUNTDOWN:
            return _counted(course)
        case Phase.RESTING:
            return _resting(course, judge)
        case Phase.DOING:
            return _look_at_it(course, judge)
        case Phase.VERDICT:
            good = course.outcome.standing is Standing.GOOD
            goes = good and course.by_itself and course.phase_s >= SHOWN_S
            return _onward(course) if goes else course
        case Phase.AWAY | Phase.OVER:
            return course


def _counted(course: Course) -> Course:
    if course.phase_s < COUNT_S - 1e-6:
        return _tell(course, Cue.TICK)
    if course.step.rest_s > 0.0:
        course = _asked(_to(course, Phase.RESTING))
        return replace(course, rest=begun(course.rate_hz), moved=not course.performing)
    return _doing(course)


def _doing(course: Course) -> Course:
    course = replace(_asked(_to(course, Phase.DOING)), done=begun(course.rate_hz))
    return _tell(course, Cue.START)


def _asked(course: Course) -> Course:
    motions = course.step.perform or ("static" if course.step.kind == "fit" else "")
    return _tell(course, Perform(motions)) if course.performing and motions else course


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
    course = replace(_to(_tell(course, label), Phase.DOING), rest=held, done=done)
    return _tell(course, Cue.START)


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
    return _judged(course, judge) if stops else course


def _judged(course: Course, judge: Judge) -> Course:
    """The step is done: what was it?"""
    step, done = course.step, course.done.samples
    if done is None:
        return course
    verdict = judge.observe(step, course.rest.samples, done, course.layout)
    good = verdict.ok or (step.kind == "tryout" and not verdict.failing)
    label = Labelled(step.name, int(done.time_us[0]), int(done.time_us[-1]))
    course = _with_outcome(course, Outcome(Standing.GOOD if good else Standing.REFUSED, verdict))
    course = _tell(_to(course, Phase.VERDICT), label, Cue.STOP)
    return course if good else _tell(course, Cue.REFUSED)


def _to(course: Course, phase: Phase) -> Course:
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
    return _tell(course, Cue.TICK) if phase is Phase.COUNTDOWN else course


def _tell(course: Course, *told: Told) -> Course:
    return replace(course, told=(*course.told, *told))


def _with_outcome(course: Course, outcome: Outcome) -> Course:
    outcomes = list(course.outcomes)
    outcomes[course.index] = outcome
    return replace(course, outcomes=tuple(outcomes))
