"""Long work in a process of its own: the page and the capture never wait for it."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from typing import TypeAlias

from app.report.make import report_of, report_path, save_report
from app.work.joint_work import Finger, JointAnswer, JointOrder, find_joint, judged, virtual_finger
from app.work.solving import Answer, solve
from handstudio.analysis.posture_time import Band
from handstudio.analysis.stretches import Stretch
from handstudio.errors import HandstudioError
from handstudio.export.export import export
from handstudio.export.formats import format_named
from handstudio.export.part import Content, Processed, Window
from handstudio.finds import Found, finds
from handstudio.hand.skeleton import HandType
from handstudio.measure import Measured, measure
from handstudio.process import process
from handstudio.recording.take import open_take
from handstudio.setup import Setup
from handstudio.signals import signals
from handstudio.survey import survey
from handstudio.trim import trim
from handstudio.way import find_way
from handstudio.wizards.joint_course import JointCourse, Poses

Beside: TypeAlias = tuple[Path | None, Path | None]
"""The takes that measures are held against: an earlier one, and one of the other hand."""

# In the job's process: where it tells how far it is, and whether it is to stop.
_share: Synchronized[float] | None = None
_stop: Synchronized[int] | None = None


class Stopped(HandstudioError):  # noqa: N818 - nothing went wrong
    """Somebody no longer wanted it."""


class Jobs:
    """One job process; jobs run one after the other."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._done: Synchronized[float] = context.Value("d", 0.0)
        self._cancelled: Synchronized[int] = context.Value("i", 0)
        self._pool = ProcessPoolExecutor(
            max_workers=1,
            mp_context=context,
            initializer=_begin,
            initargs=(self._done, self._cancelled),
        )

    @property
    def share_done(self) -> float:
        """How far the present job is, 0 to 1."""
        return float(self._done.value)

    def warm_up(self) -> None:
        """Start the process before it is needed."""
        self._pool.submit(_nothing)

    def process(self, path: Path, setup: Setup | None = None) -> Future[None]:
        """Compute the motion of a take, by its own setup or another: opening it then finds it."""
        self._reset()
        return self._pool.submit(_process, path, setup)

    def export(
        self,
        path: Path,
        name: str,
        content: Content | None,
        window: Window,
        setup: Setup | None = None,
    ) -> Future[Path]:
        """Write a part of a take in a format, beside it, by its own setup or another."""
        self._reset()
        return self._pool.submit(_export, path, name, content, window, setup)

    def measure(
        self,
        path: Path,
        window: Window,
        setup: Setup | None,
        beside: Beside,
        bands: Sequence[Band],
    ) -> Future[Measured]:
        """Measure a part of a take, and compare it."""
        self._reset()
        return self._pool.submit(_measure, path, window, setup, beside, tuple(bands))

    def report(
        self,
        path: Path,
        window: Window,
        setup: Setup | None,
        beside: Beside,
        *,
        bands: Sequence[Band],
        language: str,
    ) -> Future[Path]:
        """Write a report of a part of a take, beside it."""
        self._reset()
        return self._pool.submit(
            _report, path, window, setup, beside, bands=tuple(bands), language=language
        )

    def find(self, path: Path, setup: Setup) -> Future[Found]:
        """Look for what was written and grasped in a take."""
        self._reset()
        return self._pool.submit(_find, path, setup)

    def survey(self, path: Path, setup: Setup | None = None) -> Future[tuple[Stretch, ...]]:
        """Find the stretches of a take's motion that want a second look."""
        self._reset()
        return self._pool.submit(_survey, path, setup)

    def find_way(self, path: Path, setup: Setup | None = None) -> Future[None]:
        """Find the way of a take's hand in a tracker's room: `kept_way` then has it."""
        self._reset()
        return self._pool.submit(_find_way, path, setup)

    def signals(self, path: Path) -> Future[None]:
        """Write what the sensors of a take told: choosing it then finds it."""
        self._reset()
        return self._pool.submit(_signals, path)

    def trim(self, path: Path, begin_s: float, end_s: float | None, name: str) -> Future[Path]:
        """Make a take of a part of one."""
        self._reset()
        return self._pool.submit(_trim, path, begin_s, end_s, name)

    def solve(
        self, course: str, paths: Sequence[Path], sessions: Path, hand_type: HandType | None = None
    ) -> Future[Answer]:
        """Compute what a course is for from its takes, and keep what is to be used from now on.

        A palm is divided as the takes' layout has it unless ``hand_type`` says otherwise.
        """
        self._reset()
        return self._pool.submit(_solve, course, tuple(paths), sessions, hand_type)

    def find_joint(self, order: JointOrder) -> Future[JointAnswer]:
        """Find the joint between two terminals of a file."""
        self._reset()
        return self._pool.submit(_find_joint, order)

    def virtual_finger(self, joint: str, number: int) -> Future[Finger]:
        """Let a virtual person bend a joint, a terminal on each side of it."""
        self._reset()
        return self._pool.submit(_virtual_finger, joint, number)

    def judge_joint(self, course: JointCourse, piece: Poses, finger: Finger) -> Future[JointAnswer]:
        """Find the joint at the end of a guided course."""
        self._reset()
        return self._pool.submit(_judge_joint, course, piece, finger)

    def cancel(self) -> None:
        """Stop the present job at its next step; its future then raises `Stopped`."""
        self._cancelled.value = 1

    def _reset(self) -> None:
        self._done.value, self._cancelled.value = 0.0, 0

    def close(self) -> None:
        """End; a job that runs is abandoned."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def _begin(share: Synchronized[float], stop: Synchronized[int]) -> None:
    global _share, _stop
    _share, _stop = share, stop
    threading.Thread(target=_end_with_the_studio, name="parent", daemon=True).start()


def _end_with_the_studio() -> None:
    """A studio that is killed says nothing: without this its job process would wait for ever."""
    studio = multiprocessing.parent_process()
    if studio is not None:
        studio.join()
        os._exit(1)


def _tell(share: float) -> None:
    if _share is not None:
        _share.value = share
    if _stop is not None and _stop.value:
        raise Stopped("It was stopped.", "Nothing was changed.")


def _nothing() -> None:
    pass


def _process(path: Path, setup: Setup | None) -> None:
    process(open_take(path), setup, progress=_tell)


def _survey(path: Path, setup: Setup | None) -> tuple[Stretch, ...]:
    return survey(open_take(path), setup, _tell)


def _find_way(path: Path, setup: Setup | None) -> None:
    find_way(open_take(path), setup, _tell)


def _signals(path: Path) -> None:
    signals(open_take(path), _tell)


def _trim(path: Path, begin_s: float, end_s: float | None, name: str) -> Path:
    return trim(open_take(path), begin_s, end_s, name=name, progress=_tell)


def _export(
    path: Path, name: str, content: Content | None, window: Window, setup: Setup | None
) -> Path:
    take, chosen = open_take(path), format_named(name)
    by = setup or take.header.setup
    source = Processed(take, by, process(take, by, progress=_tell))
    kind = chosen.content(content, by.layout)
    target = chosen.target(path, kind)
    return export(source, target, chosen, content=kind, window=window, progress=_tell)


def _measure(
    path: Path, window: Window, setup: Setup | None, beside: Beside, bands: tuple[Band, ...]
) -> Measured:
    earlier, other = (None if one is None else open_take(one) for one in beside)
    return measure(
        open_take(path),
        setup,
        window,
        earlier=earlier,
        other_side=other,
        bands=bands,
        progress=_tell,
    )


def _report(
    path: Path,
    window: Window,
    setup: Setup | None,
    beside: Beside,
    *,
    bands: tuple[Band, ...],
    language: str,
) -> Path:
    earlier, other = (None if one is None else open_take(one) for one in beside)
    made = report_of(
        open_take(path),
        setup,
        window,
        earlier=earlier,
        other_side=other,
        bands=bands,
        language=language,
        progress=_tell,
    )
    return save_report(made.html, report_path(path, language))


def _find(path: Path, setup: Setup) -> Found:
    return finds(open_take(path), setup, _tell)


def _solve(
    course: str, paths: tuple[Path, ...], sessions: Path, hand_type: HandType | None
) -> Answer:
    return solve(course, [open_take(path) for path in paths], sessions, hand_type, _tell)


def _find_joint(order: JointOrder) -> JointAnswer:
    return find_joint(order, _tell)


def _virtual_finger(joint: str, number: int) -> Finger:
    return virtual_finger(joint, number, _tell)


def _judge_joint(course: JointCourse, piece: Poses, finger: Finger) -> JointAnswer:
    return judged(course, piece, finger, _tell)
