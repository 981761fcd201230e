"""Disks that are full, gone or slow: the capture goes on, and what was flushed is there."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from handstudio.device import recorder as recorder_module
from handstudio.device.orders import Phase, StartTake, StopTake, TakeDone
from handstudio.errors import HandstudioError, TakeError
from handstudio.pipeline import join
from handstudio.process import kept_motion, process
from handstudio.recording.recovery import recover
from handstudio.recording.take import open_take
from handstudio.recording.writer import TakeWriter

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


def check_recovered(studio, path: Path, least: int) -> None:
    """What was flushed gives, to the last bit, the motion that was shown; at least so much."""
    take = open_take(recover(path.with_name(path.name + ".recording")).path)
    motion, live = process(take), join(studio.motions)
    assert len(motion) >= least
    first = int(np.searchsorted(live.time_us, motion.time_us[0]))
    shown = live[first : first + len(motion)]
    assert motion.time_us.tobytes() == shown.time_us.tobytes()
    assert motion.q_world_sensor.tobytes() == shown.q_world_sensor.tobytes()


def failed(studio) -> HandstudioError:
    studio.until(lambda _: studio.reports, "a report")
    (report,) = studio.reports
    assert isinstance(report, TakeError), report
    assert studio.newest.recorder is None
    return report


@contextmanager
def small_disk(place: Path, size: str) -> Iterator[None]:
    place.mkdir()
    mounted = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]
    if os.geteuid() != 0 or shutil.which("mount") is None:
        pytest.skip("only root can make a disk that is small")
    if subprocess.run(mounted, capture_output=True, check=False).returncode != 0:
        pytest.skip("no disk can be mounted here")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_file_that_may_grow_no_more_ends_the_take_not_the_stream(
    studio, glove, limit_of_file_size
):
    studio.connect(glove(seed=71, rate=200).address)
    with limit_of_file_size(150_000):
        path = studio.start_take()
        report = failed(studio)
    assert str(path) in report.what
    assert "cannot be written" in report.what
    assert f"handstudio recover '{path}.recording'" in report.remedy
    studio.go_on(100)
    assert studio.newest.phase is Phase.STREAMING
    check_recovered(studio, path, 200)
    studio.start_take("the next")
    studio.go_on(50)
    studio.check(studio.stop_take())


def test_a_full_disk_ends_the_take_not_the_stream(studio, glove, tmp_path):
    studio.connect(glove(seed=72, rate=200).address)
    disk = tmp_path / "stick"
    with small_disk(disk, "250k"):
        path = disk / "take.mcap"
        studio.send(StartTake(path, "S01"))
        report = failed(studio)
        assert "No space left" in report.what
        studio.go_on(100)
        shutil.rmtree(path.with_suffix(".motion"), ignore_errors=True)
        unfinished = path.with_name(path.name + ".recording")
        shutil.copy(unfinished, tmp_path / unfinished.name)
    check_recovered(studio, tmp_path / "take.mcap", 100)


def test_a_full_disk_for_the_motion_alone_costs_the_take_nothing(
    studio, glove, monkeypatch, limit_of_file_size
):
    """At 20 sensors a motion is twice as large as the bytes it is made of."""
    studio.connect(glove(seed=73, rate=200).address)
    with limit_of_file_size(200_000):
        studio.start_take()
        studio.go_on(400)
        take = studio.stop_take()
    assert kept_motion(take) is None
    assert len(process(take)) >= 400
    assert not list(take.path.with_suffix(".motion").glob("unfinished-*"))


def test_a_folder_that_vanishes_is_reported_and_the_stream_goes_on(studio, glove):
    studio.connect(glove(seed=74).address)
    path = studio.folder / "visit" / "take.mcap"
    studio.send(StartTake(path, "S01"))
    studio.until(lambda newest: newest.recorder is not None, "a take is on")
    studio.go_on(30)
    shutil.rmtree(path.parent)
    studio.send(StopTake())
    assert str(path) in failed(studio).what
    studio.go_on(30)


def test_a_folder_that_cannot_be_made_is_reported_at_once(studio, glove):
    studio.connect(glove(seed=75).address)
    (studio.folder / "thesis").write_text("four years of work")
    studio.send(StartTake(studio.folder / "thesis" / "take.mcap", "S01"))
    assert "cannot be written" in failed(studio).what
    studio.go_on(30)


def test_a_place_for_the_motion_that_is_taken_costs_the_take_nothing(studio, glove):
    studio.connect(glove(seed=76).address)
    (studio.folder / "take.motion").write_text("four years of work")
    studio.start_take()
    studio.go_on(30)
    take = studio.stop_take()
    assert kept_motion(take) is None
    assert take.summary is not None
    (studio.folder / "take.motion").unlink()
    assert len(process(take)) >= 30


def test_an_interrupted_recording_is_not_overwritten(studio, glove):
    studio.connect(glove(seed=77).address)
    left = studio.folder / "take.mcap.recording"
    left.write_text("four years of work")
    studio.send(StartTake(studio.folder / "take.mcap", "S01"))
    assert "an interrupted recording" in failed(studio).what
    assert left.read_text() == "four years of work"


@pytest.fixture
def stuck_disk(monkeypatch) -> Iterator[Callable[[], None]]:
    """A disk that takes nothing until it is told to go on."""
    import threading  # noqa: PLC0415

    free = threading.Event()
    honest = TakeWriter.write

    def slow(self: TakeWriter, arrival_ns: int, chunk: bytes) -> None:
        free.wait()
        honest(self, arrival_ns, chunk)

    monkeypatch.setattr(TakeWriter, "write", slow)
    yield free.set
    free.set()


def test_a_disk_that_is_too_slow_ends_the_take_whole(studio, glove, monkeypatch, stuck_disk):
    monkeypatch.setattr(recorder_module, "BACKLOG_LIMIT", 100_000)
    studio.connect(glove(seed=78, rate=1000).address)
    path = studio.start_take()
    studio.until(lambda newest: newest.recorder is None, "it is given up")
    studio.go_on(100)
    stuck_disk()
    assert "behind" in failed(studio).what
    motion = studio.check(open_take(path))
    assert len(motion) > 100
    assert sum(len(chunk) for _, chunk in open_take(path).chunks()) <= 100_000


def test_a_disk_that_is_slow_for_a_while_costs_nothing(studio, glove, stuck_disk):
    studio.connect(glove(seed=79).address)
    path = studio.start_take()
    studio.go_on(50)
    studio.send(StopTake())
    studio.until(lambda newest: newest.recorder is None, "the next can begin")
    assert TakeDone(path) not in studio.reports
    studio.send(StartTake(studio.folder / "next.mcap", "S01"))
    studio.go_on(20)
    stuck_disk()
    assert len(studio.check(studio.take_done(path))) >= 50
    assert len(studio.check(studio.stop_take())) >= 20
