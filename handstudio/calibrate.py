"""Takes of a calibration → what is known of the hand: one function for page, shell and notebooks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from handstudio.calibration.subject import SubjectCalibration
from handstudio.calibration.verdict import Verdict
from handstudio.recording.take import Take

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


def calibrate(takes: Sequence[Take], progress: Progress = lambda _: None) -> Calibrated:
    """Calibrate a subject from the labels of takes; of a step done twice the last good one counts.

    Raises:
        CalibrationError: the takes hold too little to calibrate anything, are of different people
            or hands, or of another glove.
        TakeError: a take cannot be read.
    """
    raise NotImplementedError
