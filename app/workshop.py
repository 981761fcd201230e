"""Long work that somebody waits for: ordered here, done elsewhere, used when it is done."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app.intents import Export
from app.jobs import Jobs
from app.solving import Answer
from app.state import Download, Work
from app.words import _
from handstudio.errors import HandstudioError
from handstudio.export.part import Window
from handstudio.recording.take import Take
from handstudio.setup import Setup


@dataclass(frozen=True, slots=True)
class Computed:
    """The motion of this take is there now, by its own setup or another."""

    take: Take
    setup: Setup | None = None


@dataclass(frozen=True, slots=True)
class Uncomputed:
    """The motion of this take by another setup will not be there, and why not."""

    take: Take
    error: HandstudioError


@dataclass(frozen=True, slots=True)
class Exported:
    """A file was written, and is wanted by a page."""

    download: Download


@dataclass(frozen=True, slots=True)
class Gathered:
    """A file was made for a page, and is nowhere else."""

    download: Download


@dataclass(frozen=True, slots=True)
class Solved:
    """What a course is for was computed, or not, and why not."""

    answer: Answer | HandstudioError


Outcome = Computed | Uncomputed | Exported | Gathered | Solved


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
        self._pending.append(_Pending(future, lambda _result: Computed(take), words))

    def compute_by(self, take: Take, setup: Setup) -> None:
        """The motion of a take by another setup."""

        def fail(error: HandstudioError) -> Outcome:
            return Uncomputed(take, error)

        smooth = _("Smoothing {name}"), _("Computing the motion of {name}")
        words = smooth[not setup.smooth].format(name=take.path.stem)
        future = self.jobs.process(take.path, setup)
        self._pending.append(_Pending(future, lambda _result: Computed(take, setup), words, fail))

    def export(
        self,
        path: Path,
        order: Export,
        window: Window,
        setup: Setup | None = None,
    ) -> None:
        """A part of a take in some format, beside it, by its own setup or another."""

        def use(written: Path) -> Outcome:
            return Exported(Download(order.page, written.name, written))

        words = _("Exporting {name}").format(name=f"{path.stem}, {order.format.upper()}")
        future = self.jobs.export(path, order.format, order.content, window, setup)
        self._pending.append(_Pending(future, use, words))

    def gather(self, make: Callable[[], bytes], page: int) -> None:
        """The diagnostics."""

        def use(content: bytes) -> Outcome:
            return Gathered(Download(page, "handstudio-diagnostics.zip", content))

        words = _("Gathering diagnostics")
        self._pending.append(_Pending(self._aside.submit(make), use, words))

    def solve(self, course: str, paths: Sequence[Path], sessions: Path) -> None:
        """What a course is for."""
        future = self.jobs.solve(course, paths, sessions)
        words = _("Computing the calibration")
        self._pending.append(_Pending(future, Solved, words, Solved))

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
