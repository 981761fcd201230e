"""Long work that somebody waits for: ordered here, done elsewhere, used when it is done."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app.words import _, language
from app.work.jobs import Beside, Jobs
from app.work.joint_work import Finger, JointAnswer, JointOrder, TrackFile, looked_into
from app.work.outcomes import (
    Added,
    Computed,
    Download,
    Exported,
    FoundIn,
    Gathered,
    MeasuredPart,
    OfJoint,
    Outcome,
    Previewed,
    Solved,
    Surveyed,
    Trimmed,
    Uncomputed,
    Unseen,
    WayFound,
    Work,
    Written,
)
from handstudio.analysis.posture_time import Band
from handstudio.analysis.stretches import Stretch
from handstudio.errors import HandstudioError
from handstudio.export.part import Content, Window
from handstudio.finds import Found
from handstudio.hand.skeleton import HandType
from handstudio.process import process_head
from handstudio.recording.parcel import SUFFIX, pack, take_in
from handstudio.recording.take import Take
from handstudio.setup import Setup
from handstudio.wizards.joint_course import JointCourse, Poses

_IMPORTED = "imported"
"""Whose takes raw folders are that do not say."""


@dataclass
class _Pending:
    future: Future[Any]
    use: Callable[[Any], Outcome]
    words: str
    fail: Callable[[HandstudioError], Outcome | HandstudioError] = lambda error: error


@dataclass
class Workshop:
    """Keeps what is waited for; for one thread."""

    jobs: Jobs
    _pending: list[_Pending] = field(default_factory=list)
    _aside: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1, "aside"))

    @property
    def work(self) -> Work | None:
        """The oldest work that is waited for."""
        if not self._pending:
            return None
        return Work(self._pending[0].words, self.jobs.share_done)

    def compute(self, take: Take) -> None:
        """The motion of a take."""
        words = _("Computing the motion of {name}").format(name=take.path.stem)
        future = self.jobs.process(take.path)

        def fail(error: HandstudioError) -> Outcome:
            return Uncomputed(take, error, own=True)

        self._pending.append(_Pending(future, lambda _result: Computed(take), words, fail))

    def compute_by(self, take: Take, setup: Setup) -> None:
        """The motion of a take by another setup."""

        def fail(error: HandstudioError) -> Outcome:
            return Uncomputed(take, error)

        smooth = _("Smoothing {name}"), _("Computing the motion of {name}")
        words = smooth[not setup.smooth].format(name=take.path.stem)
        future = self.jobs.process(take.path, setup)
        self._pending.append(_Pending(future, lambda _result: Computed(take, setup), words, fail))

    def find(self, take: Take, setup: Setup) -> None:
        """What was written and grasped in a take."""

        def use(found: Found) -> Outcome:
            return FoundIn(take, setup, found)

        words = _("Looking for writing and grasps in {name}").format(name=take.path.stem)
        future = self.jobs.find(take.path, setup)
        fail = _unseen(take, "found")
        self._pending.append(_Pending(future, use, words, fail))

    def preview(self, take: Take) -> None:
        """The first seconds of a take, beside the computing of all of it."""
        future = self._aside.submit(process_head, take)
        words = _("Computing the motion of {name}").format(name=take.path.stem)
        # in the same words as the whole, whose share it tells
        self._pending.append(_Pending(future, lambda motion: Previewed(take, motion), words))

    def look_through(self, take: Take, setup: Setup | None) -> None:
        """The stretches of a motion that is there already."""
        words = _("Looking through {name}").format(name=take.path.stem)

        def use(found: tuple[Stretch, ...]) -> Outcome:
            return Surveyed(take, setup, found)

        future, fail = self.jobs.survey(take.path, setup), _unseen(take, "stretches")
        self._pending.append(_Pending(future, use, words, fail))

    def find_way(self, take: Take, setup: Setup | None) -> None:
        """The way of the hand in a tracker's room, by a motion that is there already."""
        words = _("Finding the place of {name} in the room").format(name=take.path.stem)
        future, fail = self.jobs.find_way(take.path, setup), _unseen(take, "way")
        self._pending.append(_Pending(future, lambda _result: WayFound(take), words, fail))

    def write_signals(self, take: Take) -> None:
        """What the sensors of a take told."""
        words = _("Reading the signals of {name}").format(name=take.path.stem)
        future = self.jobs.signals(take.path)
        fail = _unseen(take, "signals")
        self._pending.append(_Pending(future, lambda _result: Written(take), words, fail))

    def trim(self, path: Path, begin_s: float, end_s: float | None, name: str) -> None:
        """A part of a take as a take of its own."""
        words = _("Trimming {name}").format(name=path.stem)
        self._pending.append(_Pending(self.jobs.trim(path, begin_s, end_s, name), Trimmed, words))

    def add(self, name: str, content: bytes | None, sessions: Path) -> None:
        """A take from elsewhere."""
        words = _("Copying {name}").format(name=Path(name).name)
        future = self._aside.submit(_taken_in, name, content, sessions)
        self._pending.append(_Pending(future, Added, words))

    def share(self, take: Take, page: int) -> None:
        """A take and its notes as one file."""
        target = take.path.with_suffix(SUFFIX)

        def use(written: Path) -> Outcome:
            return Exported(Download(page, written.name, written))

        words = _("Exporting {name}").format(name=target.name)
        self._pending.append(_Pending(self._aside.submit(pack, take, target), use, words))

    def export(
        self,
        path: Path,
        kind: str,
        content: Content | None,
        window: Window,
        *,
        page: int,
        setup: Setup | None = None,
    ) -> None:
        """A part of a take in a format, beside it, by its own setup or another, for a page."""

        def use(written: Path) -> Outcome:
            return Exported(Download(page, written.name, written))

        words = _("Exporting {name}").format(name=f"{path.stem}, {kind.upper()}")
        future = self.jobs.export(path, kind, content, window, setup)
        self._pending.append(_Pending(future, use, words))

    def measure(
        self,
        take: Take,
        window: Window,
        setup: Setup | None,
        beside: Beside,
        bands: Sequence[Band],
    ) -> None:
        """A part of a take, by its own setup or another, against other takes."""
        words = _("Measuring {name}").format(name=take.path.stem)
        future = self.jobs.measure(take.path, window, setup, beside, bands)
        self._pending.append(_Pending(future, lambda found: MeasuredPart(take, found), words))

    def report(
        self,
        path: Path,
        window: Window,
        page: int,
        setup: Setup | None = None,
        beside: Beside = (None, None),
        *,
        bands: Sequence[Band],
    ) -> None:
        """A report of a part of a take, in the language that is spoken, for a page."""

        def use(written: Path) -> Outcome:
            return Exported(Download(page, written.name, written))

        words = _("Writing the report of {name}").format(name=path.stem)
        future = self.jobs.report(path, window, setup, beside, bands=bands, language=language())
        self._pending.append(_Pending(future, use, words))

    def gather(self, make: Callable[[], bytes], page: int) -> None:
        """The diagnostics."""

        def use(content: bytes) -> Outcome:
            return Gathered(Download(page, "handstudio-diagnostics.zip", content))

        words = _("Gathering diagnostics")
        self._pending.append(_Pending(self._aside.submit(make), use, words))

    def solve(
        self, course: str, paths: Sequence[Path], sessions: Path, hand_type: HandType | None
    ) -> None:
        """What a course is for."""
        future = self.jobs.solve(course, paths, sessions, hand_type)
        words = _("Computing the calibration")
        self._pending.append(_Pending(future, Solved, words, Solved))

    def look_into_tracks(self, number: int, name: str, content: bytes | None) -> None:
        """What a file of a tracker holds."""
        words = _("Reading {name}").format(name=Path(name).name)
        self._of_joint(number, self._aside.submit(looked_into, name, content), words)

    def find_joint(self, number: int, order: JointOrder) -> None:
        """The joint between two terminals of a file."""
        self._of_joint(number, self.jobs.find_joint(order), _("Finding the joint"))

    def bend_virtual_finger(self, number: int, joint: str, person: int) -> None:
        """A virtual finger with a tracker."""
        future = self.jobs.virtual_finger(joint, person)
        self._of_joint(number, future, _("Preparing a virtual finger"))

    def judge_joint(self, number: int, course: JointCourse, piece: Poses, finger: Finger) -> None:
        """The joint at the end of a guided course."""
        future = self.jobs.judge_joint(course, piece, finger)
        self._of_joint(number, future, _("Finding the joint"))

    def _of_joint(self, number: int, future: Future[Any], words: str) -> None:
        def use(told: TrackFile | Finger | JointAnswer | HandstudioError) -> Outcome:
            return OfJoint(number, told)

        self._pending.append(_Pending(future, use, words, use))

    def cancel(self) -> None:
        """Stop what is on."""
        self.jobs.cancel()

    def done(self) -> Iterator[Outcome | HandstudioError]:
        """What is done since the last call, or why it is not."""
        for one in [pending for pending in self._pending if pending.future.done()]:
            self._pending.remove(one)
            try:
                yield one.use(one.future.result())
            except HandstudioError as error:
                yield one.fail(error)
            except Exception as error:  # the job's process may have been killed
                failed = HandstudioError(
                    "{work}: {reason}",
                    "Try again; if it fails again, restart the studio.",
                    work=one.words,
                    reason=repr(error),
                )
                yield one.fail(failed)


def _unseen(take: Take, what: str) -> Callable[[HandstudioError], Outcome]:
    return lambda error: Unseen(take, what, error)


def _taken_in(name: str, content: bytes | None, sessions: Path) -> Path:
    """A file or folder of this computer, or what a page sent, in the library."""
    from handstudio.recording.raw_import import import_folder  # noqa: PLC0415 - takes a while

    path = Path(name).expanduser()
    if content is None:
        return (
            import_folder(path, sessions, _IMPORTED) if path.is_dir() else take_in(path, sessions)
        )
    with tempfile.TemporaryDirectory(prefix="handstudio-") as place:
        sent = Path(place) / (path.name or "sent")
        sent.write_bytes(content)
        return take_in(sent, sessions)
