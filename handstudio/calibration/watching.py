"""Whether a step of a calibration was done well, from the signals alone.

The same judgement for somebody who is guided live and for a take that is calibrated later. It may
be asked at any time with everything so far: a figure that is not there yet is 0.
"""

from __future__ import annotations

from handstudio.calibration.course import Step
from handstudio.calibration.heard import answering_of, seconds_of, thinned
from handstudio.calibration.stillness import directions_of, stillness_of
from handstudio.calibration.upright import upright_of
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.calibration.watched_grasp import watch_grasp
from handstudio.calibration.watched_swing import watch_swing
from handstudio.calibration.watched_turn import watch_turn
from handstudio.layout import Layout
from handstudio.samples import ImuSamples


def observe(step: Step, rest: ImuSamples | None, done: ImuSamples, layout: Layout) -> Verdict:
    """Judge what has been done so far.

    Args:
        step: What was asked.
        rest: The rest right before it, for biases and attitudes; None where there was none.
        done: What is labelled with the step, from its begin; may be empty.
        layout: Which sensor sits where, in the order of the samples.

    Returns:
        Readings, the most telling first, in an order that stays while ``done`` grows. A figure
        that cannot be had is NaN and fails. A step that begins with a rest and had too little of
        it fails for "time" about "static", and then nothing is said of stillness. The cost grows
        with ``done``: of a rest of hours the last minute is enough while it lasts. A turn is not
        over before the rig is laid back.
    """
    rest = None if rest is None else thinned(rest)
    time = Reading("time", seconds_of(done), step.least_s, "s")
    everything = answering_of(done, layout)
    over = True
    match step.kind:
        case "fit":
            seen = [everything, *upright_of(done, layout), time]
        case "rest" | "noise":
            seen = [everything, stillness_of(done, layout, "table"), time]
        case "pose":
            still = stillness_of(done, layout, "table")
            seen = [everything, still, *upright_of(done, layout), time]
        case "turn":
            turned, over = watch_turn(rest, done, layout)
            seen = [everything, *turned, time]
        case "swing":
            seen = [*watch_swing(step, rest, done, layout), time]
        case "grasp":
            seen = [everything, *watch_grasp(done, layout), time]
        case "tumble":
            seen = [everything, directions_of(done), time]
        case "tryout":
            seen = [everything]
    return Verdict(step.name, tuple(seen), over)


def enough(verdict: Verdict, step: Step, seconds: float) -> bool:
    """Whether a step that has gone on for so long [s] may stop by itself.

    It may when all is well and over, but a look at the result lasts as long as somebody looks.
    """
    if seconds >= step.most_s:
        return True
    return step.kind != "tryout" and seconds >= step.least_s and verdict.ok and verdict.over
