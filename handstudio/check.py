"""Takes of a check → whether a calibration still holds: one function for page, shell, notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from handstudio.calibration.checking import LIMIT_DEG, LIMIT_UNCALIBRATED_DEG
from handstudio.calibration.checking import check as held_against
from handstudio.calibration.course import FLAT, GRASP
from handstudio.calibration.opening import opened
from handstudio.calibration.recorded import even
from handstudio.calibration.subject import SubjectCalibration
from handstudio.calibration.swings import Swings
from handstudio.calibration.verdict import Verdict
from handstudio.errors import CalibrationError
from handstudio.recording.notes import stretches
from handstudio.recording.take import Take
from handstudio.setup import calibrated


@dataclass(frozen=True, slots=True)
class Checked:
    """What came out: a verdict with one reading a segment, on a calibration."""

    calibration: SubjectCalibration
    verdict: Verdict


def check(takes: Sequence[Take], calibration: SubjectCalibration | None = None) -> Checked:
    """Say whether a calibration still holds, from the labels of takes; the last of a step counts.

    Args:
        takes: With a quick start each, and in one of them a flat hand and an opening and closing.
        calibration: The one in question; that of the last take unless given.

    Raises:
        CalibrationError: there is no calibration, or of the other hand, or steps are missing.
        TakeError: a take cannot be read.
    """
    known = calibration or (takes[-1].header.setup.subject if takes else None)
    if known is None:
        raise CalibrationError(
            "There is no calibration that could be checked.",
            "Calibrate first: the course under Calibrate, or handstudio calibrate.",
        )
    flat = _last_with(takes, FLAT.name)
    grasped = _last_with(takes, GRASP.name)
    if flat.header.setup.layout.side != known.side:
        raise CalibrationError(
            "{take} is of a {side} hand, the calibration of a {other} one.",
            "Check with a take of the same hand.",
            take=flat.path.name,
            side=flat.header.setup.layout.side,
            other=known.side,
        )
    lying = _prepared(flat, known)
    bending = lying if flat is grasped else _prepared(grasped, known)
    rate_hz, (start, end) = bending.rate_hz, _labels(grasped, GRASP.name)[-1][:2]
    free = flat.header.setup.sensors is not None
    return Checked(
        known,
        held_against(
            lying,
            bending,
            slice(round(start * rate_hz), round(end * rate_hz)),
            known,
            LIMIT_DEG if free else LIMIT_UNCALIBRATED_DEG,
        ),
    )


def _last_with(takes: Sequence[Take], label: str) -> Take:
    for take in reversed(takes):
        if _labels(take, label):
            return take
    raise CalibrationError(
        "No part of the takes is labelled {label}.",
        "Do the course Check, then check its take.",
        label=label,
    )


def _labels(take: Take, only: str) -> list[tuple[float, float, str]]:
    return [stretch for stretch in stretches(take.path) if stretch[2] == only]


def _prepared(take: Take, calibration: SubjectCalibration) -> Swings:
    setup = calibrated(take.header.setup, subject=calibration, sensors=take.header.setup.sensors)
    recorded = even(take.runs(), setup.rate_hz, setup.sensors, setup.layout.names)
    return opened(
        setup.layout,
        setup.rate_hz,
        recorded,
        stretches(take.path),
        calibrated=setup.sensors is not None,
    )
