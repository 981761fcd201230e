"""What the page knows of guided courses: how one goes, where they stand, what came out. Values."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from app.work.solving import Answer
from handstudio.calibrate import Calibrated
from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.subject import SubjectCalibration
from handstudio.errors import HandstudioError
from handstudio.wizards.course import Course


@dataclass(frozen=True, slots=True, eq=False)
class Guided:
    """A course that is on.

    Attributes:
        course: Where it stands.
        recording: Its take is on; without it nothing goes on.
        problem: Why the take ended, where the course did not.
    """

    course: Course
    recording: bool = False
    problem: HandstudioError | None = None


@dataclass(frozen=True, slots=True)
class InUse:
    """The calibrations that everything shown rests on now.

    Attributes:
        subject: Of the wearer's hand; None: mean proportions.
        sensors: Of the device's sensors; None: as they were shipped.
        older: Ids of those of this hand that were made before, newest first.
        none: Somebody wants none, although there is one.
        now: When they were read.
    """

    subject: SubjectCalibration | None = None
    sensors: DeviceCalibration | None = None
    older: tuple[str, ...] = ()
    none: bool = False
    now: datetime | None = None


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a course stands that may be begun.

    Attributes:
        name: Of the course.
        seconds: How long it takes, or what is left of it.
        settled: Steps that are done or skipped, of one that was left.
        steps: How many there are.
    """

    name: str
    seconds: float
    settled: int = 0
    steps: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """What came of a course, or why nothing did.

    Attributes:
        course: As it ended.
        solving: What it is for is being computed.
        answer: What was computed.
        error: Why there is none.
    """

    course: Course
    solving: bool = False
    answer: Answer | None = None
    error: HandstudioError | None = None

    @property
    def calibrated(self) -> Calibrated | None:
        """The calibration of a hand, where that was computed."""
        return self.answer if isinstance(self.answer, Calibrated) else None
