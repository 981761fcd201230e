"""Takes of a calibration → what is known of the hand: for page, shell and notebooks alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TypeAlias

import msgspec
import numpy as np

from handstudio import __version__
from handstudio.calibration.chain_tree import UNCALIBRATED as ROUGH
from handstudio.calibration.chain_tree import USUAL
from handstudio.calibration.course import FLAT, HAND, REST, SWINGS, TURN
from handstudio.calibration.opening import opened
from handstudio.calibration.quick_start import Labelled
from handstudio.calibration.recorded import Recorded, even
from handstudio.calibration.solve import found
from handstudio.calibration.subject import SubjectCalibration
from handstudio.calibration.swings import Swings, is_there, joined
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.calibration.watching import observe
from handstudio.errors import CalibrationError
from handstudio.hand.skeleton import HandSide, HandType
from handstudio.layout import with_hand_type
from handstudio.recording.calibrations import new_id
from handstudio.recording.notes import stretches
from handstudio.recording.take import Take
from handstudio.samples import ImuSamples
from handstudio.setup import Setup

Progress: TypeAlias = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Calibrated:
    """What came out.

    Attributes:
        calibration: Of the subject.
        verdicts: Of every step that was found in the takes.
        to_repeat: Names of the steps that would make it better, or without which a joint has to
            rest on proportions.
    """

    calibration: SubjectCalibration
    verdicts: tuple[Verdict, ...]
    to_repeat: tuple[str, ...]


def calibrate(
    takes: Sequence[Take],
    progress: Progress = lambda _: None,
    hand_type: HandType | None = None,
) -> Calibrated:
    """Calibrate a subject from the labels of takes; of a step done twice the last good one counts.

    The glove must have stayed on between them: what is computed is how it sits, too.

    Args:
        takes: The takes.
        progress: Told how far it is.
        hand_type: How the palm is divided; as the layout of the takes has it unless given.

    Raises:
        CalibrationError: the takes hold too little to calibrate anything, are of different people
            or hands, or of another glove.
        LayoutError: the sensors cannot tell a hand of that type.
        TakeError: a take cannot be read.
    """
    _refuse_strangers(takes)
    courses = []
    for count, take in enumerate(takes):
        courses.append(_course(take, hand_type))
        progress(0.4 * (count + 1) / len(takes))
    verdicts = _verdicts(courses)
    setup = courses[-1].setup
    swings = joined([_prepared(course, verdicts) for course in courses])
    _refuse_too_little(swings)
    progress(0.6)
    side: HandSide = "left" if setup.layout.side == "left" else "right"
    known = all(take.header.setup.sensors is not None for take in takes)
    hand = found(swings, side, setup.hand.hand_length_m, USUAL if known else ROUGH)
    progress(0.95)
    now = datetime.now(UTC)
    calibration = SubjectCalibration(
        id=new_id(now),
        made_utc=now.isoformat(timespec="seconds"),
        software=f"handstudio {__version__}",
        subject=takes[-1].header.subject,
        side=side,
        hand_length_m=setup.hand.hand_length_m,
        hand_type=setup.layout.hand_type,
        device=setup.device.serial_number if setup.device is not None else "",
        segments=hand.segments(),
        tips=hand.tips(),
        centres=hand.centres(),
        axes=hand.functional_axes(),
        rocking=hand.rocks(),
        verdicts=tuple(verdicts.values()),
        takes=tuple((take.path.name, take.sha256()) for take in takes),
    )
    progress(1.0)
    return Calibrated(calibration, tuple(verdicts.values()), _to_repeat(setup, verdicts))


_SETTLING_S = 0.3
_LEAST_SWINGS = 4  # joints; less is no calibration of a hand
_STEPS = {step.name: step for step in HAND}


@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """One take of it, freed of the sensors' errors; and what each labelled step was seen to be."""

    setup: Setup
    recorded: Recorded
    labels: list[Labelled]
    verdicts: dict[Labelled, Verdict]


def _course(take: Take, hand_type: HandType | None) -> _Course:
    setup, labels = take.header.setup, stretches(take.path)
    if hand_type is not None:
        layout = with_hand_type(setup.layout, hand_type)
        setup = msgspec.structs.replace(setup, layout=layout)
    if not any(name in _STEPS for _, _, name in labels):
        raise CalibrationError(
            "{take}: no part of it is labelled as a step of a calibration.",
            "Record one with the course under Calibrate, or label its parts (static, "
            "heading_rotation, index_mcp:flexion ...).",
            take=take.path.name,
        )
    recorded = even(take.runs(), setup.rate_hz, setup.sensors, setup.layout.names)
    verdicts = {
        label: _judged(setup, recorded, labels, label)
        for label in labels
        if label[2] in _STEPS and is_there(setup.layout, label[2])
    }
    return _Course(setup, recorded, labels, verdicts)


def _verdicts(courses: Sequence[_Course]) -> dict[str, Verdict]:
    """Of every step: that of the last time it was done well, else of the last time."""
    out: dict[str, Verdict] = {}
    for course in courses:
        for (_, _, name), verdict in course.verdicts.items():
            if verdict.ok or name not in out or not out[name].ok:
                out[name] = verdict
    return out


def _judged(
    setup: Setup, recorded: Recorded, labels: Sequence[Labelled], label: Labelled
) -> Verdict:
    step = _STEPS[label[2]]
    before = _rest_before(labels, label) if step.kind in ("swing", "turn") else None
    rest = None if before is None else _part(setup, recorded, _settled(before, step.rest_s))
    done = _settled(label, step.least_s) if step.kind in ("rest", "pose") else label
    return _storable(observe(step, rest, _part(setup, recorded, done), setup.layout))


def _rest_before(labels: Sequence[Labelled], label: Labelled) -> Labelled | None:
    rests = [x for x in labels if x[2] == REST.name and x[1] <= label[0] + 0.5]
    return max(rests, key=lambda x: x[1], default=None)


def _part(setup: Setup, recorded: Recorded, label: Labelled) -> ImuSamples:
    return recorded.part(label[0], label[1], setup.rate_hz)


def _settled(label: Labelled, least_s: float) -> Labelled:
    """A rest less its beginning, in which boards still swing from the movement before."""
    start, end, name = label
    latest = max(start, end - max(least_s, 1.0))
    return min(start + _SETTLING_S, latest), end, name


def _storable(verdict: Verdict) -> Verdict:
    """Without figures that could not be had, which no text can hold; good it is not for that."""
    known = tuple(r for r in verdict.readings if np.isfinite(r.value))
    if verdict.ok or not all(r.ok for r in known):
        return Verdict(verdict.step, known)
    return Verdict(verdict.step, (*known, Reading("answering", 0.0, 100.0, "%")))


def _prepared(course: _Course, verdicts: dict[str, Verdict]) -> Swings:
    """A take's swings; those done badly only where nothing better is there."""
    kept = [label for label in course.labels if not _outdone(course, verdicts, label)]
    return opened(
        course.setup.layout,
        course.setup.rate_hz,
        course.recorded,
        _last_of_each(kept),
        calibrated=course.setup.sensors is not None,
    )


def _outdone(course: _Course, verdicts: dict[str, Verdict], label: Labelled) -> bool:
    """Whether a swing was done badly here and well another time."""
    verdict = course.verdicts.get(label) if ":" in label[2] else None
    return verdict is not None and not verdict.ok and verdicts[label[2]].ok


def _last_of_each(labels: Sequence[Labelled]) -> list[Labelled]:
    """Of a swing done twice the last one; rests all stay."""
    last = {name: start for start, _, name in labels if ":" in name}
    return [x for x in labels if ":" not in x[2] or last[x[2]] == x[0]]


def _refuse_strangers(takes: Sequence[Take]) -> None:
    if not takes:
        raise CalibrationError("No take was named.", "Choose the takes of a calibration.")
    first = takes[0].header
    for take in takes:
        setup = take.header.setup
        if not setup.layout.is_hand:
            raise CalibrationError(
                "{take}: {why}",
                "Calibrate with a glove.",
                take=take.path.name,
                why=setup.layout.no_hand,
            )
        if take.header.subject != first.subject or setup.layout != first.setup.layout:
            raise CalibrationError(
                "{take} is of another person, hand or glove than {first}.",
                "Calibrate from takes of one person and one glove.",
                take=take.path.name,
                first=takes[0].path.name,
            )


def _refuse_too_little(swings: Swings) -> None:
    count = len({swing.joint for swing in swings.swings})
    if count < _LEAST_SWINGS:
        raise CalibrationError(
            "Only {count} joints were swung; a hand needs {least} at least.",
            "Do the steps of the course that are missing, then calibrate again.",
            count=count,
            least=_LEAST_SWINGS,
        )


def _to_repeat(setup: Setup, verdicts: dict[str, Verdict]) -> tuple[str, ...]:
    there = {joint.name for joint in setup.layout.instrumented_joints} | {"elbow"}
    asked = [TURN, FLAT, *(step for step in SWINGS if step.joint in there)]
    missing = [s.name for s in asked if s.name not in verdicts and not s.optional]
    return (*missing, *(name for name, verdict in verdicts.items() if not verdict.ok))
