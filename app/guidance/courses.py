"""Courses that were left: a small file beside the subject's takes; they go on another day."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

import msgspec

from app.shown.guided import Stand
from handstudio.calibration.course import COURSES
from handstudio.calibration.course import course as steps_of
from handstudio.errors import CalibrationError, HandstudioError
from handstudio.layout import Layout
from handstudio.recording.atomic import write_atomically
from handstudio.wizards.course import Course, begin, usual_s
from handstudio.wizards.saved import pack, resumed


class _Kept(msgspec.Struct):
    takes: tuple[str, ...]
    course: msgspec.Raw


@dataclass(frozen=True, slots=True, eq=False)
class Left:
    """A course as it was left, and the takes it was done in, by their place in the library."""

    course: Course
    takes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Courses:
    """The courses of one subject and hand.

    Attributes:
        sessions: The library.
        subject: Code of the person.
        layout: Of the device.
        rate_hz: Of the device.
        performing: Its wearer does what is asked.
    """

    sessions: Path
    subject: str
    layout: Layout
    rate_hz: float
    performing: bool = False

    def fresh(self, name: str) -> Course:
        """A course at its first step."""
        steps = steps_of(name, self.layout)
        return begin(name, steps, self.layout, self.rate_hz, performing=self.performing)

    def left(self, name: str) -> Left:
        """A course as it was left; at its first step where it was not.

        Raises:
            CalibrationError: what was kept of it cannot be read.
        """
        path = self._path(name)
        try:
            kept = msgspec.json.decode(path.read_bytes(), type=_Kept)
        except FileNotFoundError:
            return Left(self.fresh(name))
        except (OSError, ValueError) as error:  # ValueError: no JSON, or no UTF-8
            raise _unreadable(path, error) from error
        return Left(resumed(self.fresh(name), bytes(kept.course), str(path)), kept.takes)

    def keep(self, left: Left) -> None:
        """Store a course as it stands.

        Raises:
            CalibrationError: it cannot be written; what was kept before is still there.
        """
        kept = _Kept(left.takes, msgspec.Raw(pack(left.course)))
        path = self._path(left.course.name)
        try:
            write_atomically(path, msgspec.json.format(msgspec.json.encode(kept)))
        except OSError as error:
            raise CalibrationError(
                "{path}: where the course stands cannot be kept ({reason}).",
                "Free some space or check the folder's permissions; the take has the labels.",
                path=path,
                reason=error.strerror or error,
            ) from error

    def forget(self, name: str) -> None:
        """A course is over: the next one begins at its first step."""
        with contextlib.suppress(OSError):
            self._path(name).unlink(missing_ok=True)

    def stands(self) -> tuple[Stand, ...]:
        """Where every course stands that this device has sensors for."""
        found = []
        for name in COURSES:
            fresh = self.fresh(name)
            if not fresh.steps or (name == "hand" and not self.layout.is_hand):
                continue
            try:
                course = self.left(name).course
            except HandstudioError:
                course = fresh
            if course.settled == len(course.steps):
                course = fresh
            found.append(Stand(name, course.seconds_left, course.settled, len(course.steps)))
        return tuple(found)

    def _path(self, name: str) -> Path:
        return self.sessions / self.subject / f"{name}-{self.layout.side}.course.json"


def stands_without_device() -> tuple[Stand, ...]:
    """What courses there are, and how long they take."""
    return tuple(
        Stand(name, sum(usual_s(step) for step in steps), 0, len(steps))
        for name, steps in COURSES.items()
    )


def _unreadable(path: Path, error: Exception) -> CalibrationError:
    return CalibrationError(
        "{path}: where the course was left cannot be read ({reason}).",
        "Begin the course anew; what was recorded is kept.",
        path=path,
        reason=error,
    )
