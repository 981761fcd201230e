"""A guided course as the page shows it: the sheet of a step, the list, the result. Pure."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass
from typing import TypeAlias

from jaxtyping import Bool

from app import intents
from app.guidance.courses import stands_without_device
from app.guidance.ghost import ghost_of
from app.shown.guided import Guided, Result, Stand
from app.state import State
from app.views.answers import answer_of
from app.views.pieces import AMBER, GREEN, GREY, RED, big, frame, line, sentence, small, table
from app.views.steps import (
    cost_of,
    course_name,
    course_purpose,
    failing_of,
    figure_of,
    joint_name,
    label_of,
    sentence_of,
    title_of,
)
from app.words import _, in_words
from handstudio.arrays import Array
from handstudio.calibration.course import Step
from handstudio.calibration.subject import Segment, SubjectCalibration
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.device.orders import Phase as Line
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import HandSide, Skeleton
from handstudio.layout import divisible
from handstudio.wizards.course import (
    Accept,
    Course,
    Next,
    Outcome,
    Phase,
    Repeat,
    Skip,
    Standing,
)

Choice: TypeAlias = tuple[str, intents.Intent]
"""A button: its words, and what it asks for."""

IMPLAUSIBLE_SD = 3.0
"""A length this many standard deviations from the mean of people is one in four hundred."""


_NAMED = 4  # steps that are worth repeating; more are counted


@dataclass(frozen=True, slots=True)
class Sheet:
    """What is read from two metres away, and what can be said to it.

    Attributes:
        content: The page shows this.
        first: The button that the space bar presses too; None: there is nothing to say.
        others: The buttons beside it.
    """

    content: str
    first: Choice | None = None
    others: tuple[Choice, ...] = ()


def sheet_of(state: State) -> Sheet | None:
    """The sheet of the course that is on, or of what came of it; None: there is none."""
    if state.guided is not None:
        return _step_sheet(state.guided, lost=state.newest.phase is Line.LOST)
    if state.result is not None:
        return _result_sheet(state.result, state)
    return None


# --- the sheet of a step --------------------------------------------------------------------------


def _step_sheet(guided: Guided, *, lost: bool) -> Sheet:
    course = guided.course
    body = _problem(guided) if guided.problem is not None else _body(course)
    if lost and course.phase in (Phase.INTRO, Phase.VERDICT):  # the others say so themselves
        words = html.escape(_("Device lost: check the cable."))
        body += f'<div style="font-size:1.1rem;color:{RED}">{words}</div>'
    content = frame(_head(course) + body)
    return Sheet(content, _first(guided), _others(guided))


def _head(course: Course) -> str:
    where = _("Step {number} of {count}").format(number=course.index + 1, count=len(course.steps))
    left = _("about {time} left").format(time=minutes_of(course.seconds_left))
    line = " · ".join([where, title_of(course.step), left])
    share = course.settled / max(len(course.steps), 1)
    return (
        f'<div style="font-size:.95rem;opacity:.75">{html.escape(line)}</div>'
        f'<div style="height:3px;margin:.25em 0 .5em;background:{GREY}">'
        f'<div style="height:3px;width:{100 * share:.1f}%;background:{GREEN}"></div></div>'
    )


def _body(course: Course) -> str:  # noqa: PLR0911 - a list
    """What the phase has to show, beside the sentence that stays."""
    asked = sentence(sentence_of(course.step))
    match course.phase:
        case Phase.INTRO:
            return big("●", GREY, asked + small(_introduction(course)))
        case Phase.COUNTDOWN:
            return big(str(course.count), AMBER, asked + small(_trouble(course)))
        case Phase.RESTING:
            return big("‖", AMBER, sentence(_("Keep still …")) + _bars(course.live))
        case Phase.DOING:
            return big(_clock(course), GREEN, asked + _bars(course.live))
        case Phase.VERDICT:
            return _verdict(course.step, course.outcome)
        case Phase.AWAY:
            words = _("Device lost: check the cable. This step begins anew once it is back.")
            return big("!", RED, sentence(words))
        case Phase.OVER:
            return big("✓", GREEN, sentence(_("Done.")))


def _introduction(course: Course) -> str:
    if course.trouble:
        return _trouble(course)
    if course.by_itself:
        return _("It begins by itself.")
    return _("The pale hand shows it. Space begins.")


def _trouble(course: Course) -> str:
    return {
        "": "",
        "away": _("The device was away: this step begins anew."),
        "gap": _("Data were lost: this step begins anew."),
    }[course.trouble]


def _clock(course: Course) -> str:
    seconds = math.ceil(max(0.0, course.step.least_s - course.phase_s))
    return str(seconds) if seconds > 0 else "…"


def _verdict(step: Step, outcome: Outcome) -> str:
    verdict = outcome.verdict
    failing = verdict.failing if verdict is not None else ()
    if outcome.standing is Standing.GOOD:
        return big("✓", GREEN, sentence(_("Good."), GREEN) + _bars(verdict))
    told = "".join(
        f'<div style="font-size:1.3rem;line-height:1.3">{html.escape(words)}</div>'
        for words in (failing_of(reading, step.joint) for reading in failing[:2])
    )
    more = len(failing) - 2
    rest = small(_("and {count} more").format(count=more)) if more > 0 else ""
    cost = small(_("Used all the same: {cost}").format(cost=cost_of(step)))
    return big("✗", RED, sentence(_("Not good enough."), RED) + told + rest + cost)


def _problem(guided: Guided) -> str:
    what, remedy = in_words(guided.problem) if guided.problem is not None else ("", "")
    return big("!", RED, sentence(what) + small(remedy))


def _first(guided: Guided) -> Choice | None:
    if guided.problem is not None:
        return _("Go on in a new take"), intents.Guide(Next())
    course = guided.course
    match course.phase:
        case Phase.INTRO:
            return _("Begin"), intents.Guide(Next())
        case Phase.DOING:
            return _("That is enough"), intents.Guide(Next())
        case Phase.VERDICT if course.outcome.standing is Standing.GOOD:
            return _("Next"), intents.Guide(Next())
        case Phase.VERDICT:
            return _("Repeat"), intents.Guide(Repeat())
        case Phase.COUNTDOWN | Phase.RESTING | Phase.AWAY | Phase.OVER:
            return None


def _others(guided: Guided) -> tuple[Choice, ...]:
    course, choices = guided.course, list[Choice]()
    refused = course.phase is Phase.VERDICT and course.outcome.standing is Standing.REFUSED
    running = course.phase in (Phase.COUNTDOWN, Phase.RESTING, Phase.DOING)
    if guided.problem is None:
        if refused:
            choices.append((_("Use it all the same"), intents.Guide(Accept())))
        elif running or course.phase is Phase.VERDICT:
            choices.append((_("Repeat"), intents.Guide(Repeat())))
        if course.step.optional:
            choices.append((_("Skip"), intents.Guide(Skip())))
    return (*choices, (_("Leave"), intents.LeaveCourse()))


# --- bars -----------------------------------------------------------------------------------------


def _bars(verdict: Verdict | None) -> str:
    if verdict is None:
        return small(_("Looking …"))
    return f'<div style="margin-top:.35em">{"".join(map(_bar, verdict.readings[:5]))}</div>'


def _bar(reading: Reading) -> str:
    """How much there is, and the mark of enough, or of too much."""
    mark = 66.0 if reading.at_least else 50.0
    share = 0.0 if math.isnan(reading.value) else reading.share
    width = min(100.0, mark * max(share, 0.0))
    colour = GREEN if reading.ok else AMBER
    about = f" {joint_name(reading.about)}" if reading.about not in ("", "static") else ""
    sign = "≥" if reading.at_least else "≤"
    figure = f"{figure_of(reading.value, reading.unit)}"
    limit = f"{sign} {figure_of(reading.limit, reading.unit)}"
    return (
        '<div style="display:flex;align-items:center;gap:.6em;font-size:.95rem;line-height:1.55">'
        f'<div style="width:11em;white-space:nowrap;overflow:hidden;text-overflow:ellipsis">'
        f"{html.escape(label_of(reading) + about)}</div>"
        f'<div style="position:relative;flex:1;height:.75em;background:{GREY};border-radius:3px">'
        f'<div style="height:100%;width:{width:.0f}%;background:{colour};border-radius:3px"></div>'
        f'<div style="position:absolute;left:{mark:.0f}%;top:-.2em;height:1.15em;width:3px;'
        'background:currentColor"></div></div>'
        '<div style="width:10.5em;font-variant-numeric:tabular-nums;white-space:nowrap">'
        f'<b>{html.escape(figure)}</b> <span style="opacity:.7">{html.escape(limit)}</span></div>'
        "</div>"
    )


# --- the list of steps ----------------------------------------------------------------------------

_SIGNS = {
    Standing.OPEN: ("○", "currentColor"),
    Standing.GOOD: ("✓", GREEN),
    Standing.REFUSED: ("✗", RED),
    Standing.ACCEPTED: ("✓", AMBER),
    Standing.SKIPPED: ("–", "currentColor"),
}


def list_of(course: Course) -> str:
    """All steps, each with what became of it."""
    rows = []
    for i, (step, outcome) in enumerate(zip(course.steps, course.outcomes, strict=True)):
        here = i == course.index and course.phase is not Phase.OVER
        rows.append(_row(i, step, outcome, here=here))
    return f'<div style="padding:.2em .75em">{"".join(rows)}</div>'


def _row(number: int, step: Step, outcome: Outcome, *, here: bool) -> str:
    sign, colour = ("▸", AMBER) if here else _SIGNS[outcome.standing]
    failing = outcome.verdict.failing if outcome.verdict is not None else ()
    told = f" · {failing_of(failing[0], step.joint)}" if failing else ""
    note = {Standing.ACCEPTED: _("used all the same"), Standing.SKIPPED: _("skipped")}
    words = note.get(outcome.standing, "") + told
    weight = "700" if here else "400"
    return (
        f'<div style="display:flex;gap:.5em;font-size:.8rem;line-height:1.5;font-weight:{weight}">'
        f'<span style="color:{colour};width:1em">{sign}</span><div>{number + 1}. '
        f'{html.escape(title_of(step))} <span style="opacity:.7">{html.escape(words)}</span></div>'
        "</div>"
    )


def step_choices(course: Course) -> dict[str, int]:
    """Every step by its words, to be chosen for doing it once more."""
    return {
        f"{i + 1}. {title_of(step)} {_SIGNS[outcome.standing][0]}": i
        for i, (step, outcome) in enumerate(zip(course.steps, course.outcomes, strict=True))
    }


# --- the courses there are ------------------------------------------------------------------------


def stands_of(state: State) -> tuple[Stand, ...]:
    """The courses that can be begun, or all there are while nobody or no device is there."""
    return state.stands or stands_without_device()


def palm_is_chosen(state: State) -> bool:
    """Whether how the palm is divided is for a person to say: the glove there can tell each way."""
    setup = state.newest.setup
    return setup is not None and divisible(setup.layout)


def stand_of(stand: Stand) -> str:
    """A course in the list: what it is for, how long it takes, where it stands."""
    time = minutes_of(stand.seconds)
    if stand.settled:
        where = _("{settled} of {steps} steps done, {time} left").format(
            settled=stand.settled, steps=stand.steps, time=time
        )
    else:
        where = _("{steps} steps, {time}").format(steps=stand.steps, time=time)
    return (
        '<div style="padding:.5em .75em 0;font-size:.82rem;line-height:1.4">'
        f"<b>{html.escape(course_name(stand.name))}</b> {html.escape(where)}"
        f'<div style="opacity:.75">{html.escape(course_purpose(stand.name))}</div></div>'
    )


def minutes_of(seconds: float) -> str:
    """A time that is only about right."""
    if seconds < 55.0:
        return _("{seconds:.0f} s").format(seconds=5.0 * math.ceil(seconds / 5.0))
    return _("{minutes:.0f} min").format(minutes=math.ceil(seconds / 60.0))


# --- the result -----------------------------------------------------------------------------------


def _result_sheet(result: Result, state: State) -> Sheet:
    if result.solving:
        named, share = result.course.name, state.work.share if state.work is not None else 0.0
        words = _("Computing the calibration …") if named == "hand" else _("Computing …")
        bar = (
            f'<div style="height:.75em;margin:.6em 0;background:{GREY};border-radius:3px">'
            f'<div style="height:100%;width:{100 * share:.0f}%;background:{GREEN};'
            'border-radius:3px"></div></div>'
        )
        content = big("●", AMBER, sentence(words) + bar)
        return Sheet(frame(content), None, ((_("Cancel"), intents.CancelWork()),))
    close: Choice = (_("Close"), intents.CloseResult())
    if result.error is not None:
        what, remedy = in_words(result.error)
        none = _("No calibration.") if result.course.name == "hand" else _("No result.")
        content = big("✗", RED, sentence(none) + line(what) + small(remedy))
        return Sheet(frame(content), close, _redo(result))
    if result.answer is None:
        content = sentence(_("Done.")) + line(_("The take is kept; its labels name every step."))
        return Sheet(frame(big("✓", GREEN, content)), close)
    content = _calibrated(result) if result.calibrated is not None else answer_of(result.answer)
    return Sheet(frame(content), close, _redo(result))


def _redo(result: Result) -> tuple[Choice, ...]:
    """The first steps that are worth repeating."""
    wanted = result.calibrated.to_repeat if result.calibrated is not None else ()
    found = [i for i, step in enumerate(result.course.steps) if step.name in wanted]
    return tuple(
        (
            _("Repeat {step}").format(step=title_of(result.course.steps[i])),
            intents.RedoStep(i),
        )
        for i in found[:2]
    )


def _calibrated(result: Result) -> str:
    if result.calibrated is None:
        return ""
    calibration, repeat = result.calibrated.calibration, result.calibrated.to_repeat
    odd = [s for s in calibration.segments if abs(s.plausible) > IMPLAUSIBLE_SD]
    good = not repeat and not odd
    word = _("Calibrated.") if good else _("Calibrated, with doubts.")
    names = {step.name: title_of(step) for step in result.course.steps}
    told = ""
    if repeat:
        steps = ", ".join(names.get(name, name) for name in repeat[:_NAMED])
        if len(repeat) > _NAMED:
            steps += ", " + _("and {count} more").format(count=len(repeat) - _NAMED)
        told += line(_("Worth repeating: {steps}.").format(steps=steps))
    if odd:
        who = ", ".join(joint_name(segment.name) for segment in odd)
        told += line(_("Unusual lengths: {segments}.").format(segments=who))
    colour = GREEN if good else AMBER
    head = big("✓" if good else "!", colour, sentence(word, colour) + told)
    return head + _segments(calibration) + _residuals(calibration)


def _segments(calibration: SubjectCalibration) -> str:
    titles = (_("Segment"), _("Length"), _("Among people"), _("From"))
    return table(titles, [_segment(segment) for segment in calibration.segments])


def _segment(segment: Segment) -> tuple[str, tuple[str, ...]]:
    sources = {
        "measured": _("measured"),
        "with prior": _("measured, with average proportions"),
        "proportions": _("average proportions"),
    }
    odd = abs(segment.plausible) > IMPLAUSIBLE_SD
    length = f"{1e3 * segment.length_m:.1f} ± {1e3 * segment.length_sd_m:.1f} mm"
    among = _("{sd:+.1f} SD").format(sd=segment.plausible)
    cells = (joint_name(segment.name), length, among, sources[segment.length_source])
    return AMBER if odd else "", cells


def _residuals(calibration: SubjectCalibration) -> str:
    if not calibration.centres:
        return ""
    worst = max(calibration.centres, key=lambda centre: centre.residual)
    middle = sorted(centre.residual for centre in calibration.centres)[
        len(calibration.centres) // 2
    ]
    words = _("Left of the accelerations: {middle:.2f} m/s² in the middle, {worst:.2f} at {joint}.")
    return small(words.format(middle=middle, worst=worst.residual, joint=joint_name(worst.joint)))


# --- the hand that shows it -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class GhostView:
    """A pale hand to draw beside the live one.

    Attributes:
        skeleton: Of it.
        pose: Where it is now.
        moving: The segments that the step is about.
        words: What it is there for; empty: that is told elsewhere.
        beside: Whether it stands beside the other; else in its place.
    """

    skeleton: Skeleton
    pose: Pose
    moving: Bool[Array, " k"]
    words: str
    beside: bool = True


def ghost_view(state: State) -> GhostView | None:
    """The hand that shows what the step asks for; None: nothing is to be shown."""
    guided, setup = state.guided, state.newest.setup
    if guided is None or setup is None or not setup.layout.is_hand or guided.problem is not None:
        return None
    course = guided.course
    if course.phase is Phase.OVER:
        return None
    side: HandSide = "left" if setup.layout.side == "left" else "right"
    ghost = ghost_of(course.step, side, setup.hand.hand_length_m)
    shown = course.phase in (Phase.INTRO, Phase.DOING)
    seconds = (course.now_us or 0) * 1e-6 if shown else 0.0
    return GhostView(ghost.skeleton, ghost.at(seconds), ghost.moving, _("Like this"))
