"""What the page knows of guided courses: how one goes, where they stand, what came out. Values."""

from __future__ import annotations

from dataclasses import dataclass

from handstudio.calibrate import Calibrated
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
        solving: A calibration is being computed from it.
        calibrated: The calibration.
        error: Why there is none.
    """

    course: Course
    solving: bool = False
    calibrated: Calibrated | None = None
    error: HandstudioError | None = None
