"""A take of the showcase, processed once; and a studio without a page and without a device."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

import pytest

from app import intents
from app.report.make import report_of, report_path, save_report
from app.shown import review as reviewing
from app.shown.review import Review
from app.state import State
from app.studio import Studio
from app.work.jobs import Beside, Jobs
from app.work.joint_work import Finger, JointAnswer, JointOrder, find_joint, judged, virtual_finger
from handstudio.analysis.posture_time import Band
from handstudio.analysis.stretches import Stretch
from handstudio.device.capture import Capture
from handstudio.device.orders import Newest, Order, Phase, Report
from handstudio.device.recorder import Recorder
from handstudio.export.export import export
from handstudio.export.formats import FORMATS
from handstudio.export.part import Content, Processed, Window
from handstudio.finds import Found, finds
from handstudio.measure import Measured, measure
from handstudio.pipeline import Motion
from handstudio.process import process
from handstudio.recording.header import Header
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.subjects import Subject, create_subject
from handstudio.recording.take import Take, open_take
from handstudio.samples import ImuSamples
from handstudio.settings import SettingsStore
from handstudio.setup import Setup
from handstudio.signals import signals
from handstudio.survey import survey
from handstudio.trim import trim
from handstudio.way import find_way
from handstudio.wizards.joint_course import JointCourse, Poses

TICK_S = 0.016


@pytest.fixture(scope="session")
def take(tmp_path_factory: pytest.TempPathFactory) -> Take:
    path: Path = simulate(tmp_path_factory.mktemp("sessions"), rehearse(seed=2), seconds=8.0)
    return open_take(path)


@pytest.fixture(scope="session")
def review(take: Take) -> Review:
    return reviewing.opened(take, process(take))


@dataclass
class StillCapture:
    """A capture in which happens what a test says."""

    newest: Newest = Newest()
    orders: list[Order] = field(default_factory=list)
    waiting: list[Report] = field(default_factory=list)
    motions: list[Motion] = field(default_factory=list)
    samples: list[ImuSamples] = field(default_factory=list)

    def send(self, order: Order) -> None:
        self.orders.append(order)

    def drain(self) -> list[Motion]:
        motions, self.motions = self.motions, []
        return motions

    def drain_samples(self) -> list[ImuSamples]:
        samples, self.samples = self.samples, []
        return samples

    def reports(self) -> list[Report]:
        waiting, self.waiting = self.waiting, []
        return waiting


class PromptJobs:
    """Does long work at once."""

    share_done = 1.0

    def process(self, path: Path, setup: Setup | None = None) -> Future[None]:
        return done(lambda: process(open_take(path), setup))

    def survey(self, path: Path, setup: Setup | None = None) -> Future[tuple[Stretch, ...]]:
        return done(lambda: survey(open_take(path), setup))

    def find(self, path: Path, setup: Setup) -> Future[Found]:
        return done(lambda: finds(open_take(path), setup))

    def find_way(self, path: Path, setup: Setup | None = None) -> Future[None]:
        return done(lambda: find_way(open_take(path), setup))

    def signals(self, path: Path) -> Future[None]:
        return done(lambda: signals(open_take(path)))

    def trim(self, path: Path, begin_s: float, end_s: float | None, name: str) -> Future[Path]:
        return done(lambda: trim(open_take(path), begin_s, end_s, name=name))

    def export(
        self,
        path: Path,
        name: str,
        content: Content | None,
        window: Window,
        setup: Setup | None = None,
    ) -> Future[Path]:
        take, chosen = open_take(path), FORMATS[name]
        setup = setup or take.header.setup
        source = Processed(take, setup, process(take, setup))
        target = chosen.target(path, chosen.content(content, setup.layout))
        return done(lambda: export(source, target, chosen, content=content, window=window))

    def measure(
        self,
        path: Path,
        window: Window,
        setup: Setup | None,
        beside: Beside,
        bands: Sequence[Band],
    ) -> Future[Measured]:
        take, others = open_take(path), _opened(beside)
        return done(lambda: measure(take, setup, window, bands=bands, **others))

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
        def work() -> Path:
            asked = {"bands": bands, "language": language, **_opened(beside)}
            made = report_of(open_take(path), setup, window, **asked)
            return save_report(made.html, report_path(path, language))

        return done(work)

    def find_joint(self, order: JointOrder) -> Future[JointAnswer]:
        return done(lambda: find_joint(order, _untold))

    def virtual_finger(self, joint: str, number: int) -> Future[Finger]:
        return done(lambda: virtual_finger(joint, number, _untold))

    def judge_joint(self, course: JointCourse, piece: Poses, finger: Finger) -> Future[JointAnswer]:
        return done(lambda: judged(course, piece, finger, _untold))


def _untold(_share: float) -> None:
    pass


def _opened(beside: Beside) -> dict[str, Any]:
    earlier, other = (None if one is None else open_take(one) for one in beside)
    return {"earlier": earlier, "other_side": other}


def done(work: Callable[[], Any]) -> Future[Any]:
    future: Future[Any] = Future()
    try:
        future.set_result(work())
    except Exception as error:
        future.set_exception(error)
    return future


@pytest.fixture
def capture() -> StillCapture:
    return StillCapture()


@pytest.fixture
def studio(capture: StillCapture, tmp_path: Path) -> Studio:
    sessions = tmp_path / "sessions"
    store = SettingsStore.opened(tmp_path / "settings.json")
    studio = Studio(
        cast("Capture", capture), cast("Jobs", PromptJobs()), store, State(sessions), "en"
    )
    studio.refresh_takes()
    return studio


@pytest.fixture
def streaming(capture: StillCapture, studio: Studio, review: Review) -> Studio:
    """A device sends, and S01 was chosen."""
    create_subject(studio.state.sessions, Subject("S01", "right", 187.0))
    studio.refresh_takes()
    capture.newest = Newest(
        Phase.STREAMING, "virtual:", setup=review.setup, motion=review.motion[-1:]
    )
    studio.send(intents.PagesOpen(1))
    after(studio, intents.ChooseSubject("S01"), intents.SetCountdown(0))
    capture.orders.clear()
    return studio


class StillRecorder(Recorder):
    """A take that is on, as far as the page looks at it; nothing is written."""

    seconds = 12.3  # type: ignore[assignment]

    def __init__(self, path: Path, header: Header) -> None:
        self.path, self.header = path, header
        self.bytes, self.first_us, self.failure = 1_000_000, 0, None


def recording(capture: StillCapture, path: Path) -> StillRecorder:
    """From now on a take is on."""
    path.parent.mkdir(parents=True, exist_ok=True)
    setup = capture.newest.setup
    assert setup is not None
    recorder = StillRecorder(path, Header(path.stem, "S01", 0, setup, "wire", "virtual:"))
    capture.newest = replace(capture.newest, recorder=recorder)
    return recorder


def after(studio: Studio, *asked: intents.Intent) -> State:
    for intent in asked:
        studio.send(intent)
    return studio.tick(TICK_S)
