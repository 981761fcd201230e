"""The writer thread: its file, its limit, and what it keeps of a failure."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from handstudio import pipeline
from handstudio.device import recorder as recorder_module
from handstudio.device.recorder import Recorder
from handstudio.errors import TakeError
from handstudio.process import kept_motion, process
from handstudio.recording.header import Header, Summary
from handstudio.recording.recovery import recover
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import Take, open_take
from handstudio.recording.writer import TakeWriter
from handstudio.setup import for_device
from handstudio.simulation.glove import description
from handstudio.stream import EventStream

START_NS = 1_800_000_000_000_000_000
SUMMARY = Summary(0, 0, 0.0)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Take:
    return open_take(simulate(tmp_path_factory.mktemp("sessions"), rehearse(seed=6), seconds=2.0))


def header(path: Path) -> Header:
    told = description("right", 6, 100, 1, "Virtual glove")
    return Header(path.stem, "S01", START_NS, for_device(told, "handstudio-1"), "wire", "test")


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "take.mcap"


@pytest.fixture
def recorder(path):
    one = Recorder(path, header(path), b"")
    yield one
    one.stop(SUMMARY)
    one.wait()


def test_what_is_put_is_what_is_read(recorder, path):
    rng = np.random.default_rng(1)
    chunks = [(START_NS + k, rng.bytes(int(rng.integers(1, 3000)))) for k in range(300)]
    for arrival_ns, chunk in chunks:
        recorder.put(arrival_ns, chunk)
    assert recorder.chunks == 300
    assert recorder.bytes == sum(len(chunk) for _, chunk in chunks)
    recorder.stop(SUMMARY)
    recorder.wait()
    assert recorder.finished
    assert recorder.failure is None
    assert list(open_take(path).chunks()) == chunks
    assert open_take(path).summary is not None


def test_the_live_motion_is_kept_where_it_is_looked_for(recorder, path, recorded):
    setup = recorder.header.setup
    stream, state = EventStream("handstudio-1", setup.ranges), pipeline.begin(setup)
    motions = []
    for arrival_ns, chunk in recorded.chunks():
        recorder.put(arrival_ns, chunk)
        motion, state = pipeline.run(setup, state, stream.feed(chunk, arrival_ns)[1])
        recorder.put_motion(motion)
        motions.append(motion)
    recorder.stop(SUMMARY)
    recorder.wait()
    kept, live = kept_motion(open_take(path)), pipeline.join(motions)
    assert kept is not None
    assert kept.time_us.tobytes() == live.time_us.tobytes()
    assert kept.q_world_sensor.tobytes() == live.q_world_sensor.tobytes()
    assert np.array_equal(process(open_take(path)).time_us, live.time_us)


def test_before_it_is_closed_there_is_no_take_of_that_name(recorder, path):
    recorder.put(START_NS, b"abc")
    assert not path.exists()
    recorder.stop(SUMMARY)
    recorder.wait()
    assert path.exists()


def test_a_failure_is_kept_and_nothing_more_is_taken(recorder, path, monkeypatch):
    honest, failing = TakeWriter.write, threading.Event()

    def write(self: TakeWriter, arrival_ns: int, chunk: bytes) -> None:
        if failing.is_set():
            raise TakeError("no more", "buy a disk")
        honest(self, arrival_ns, chunk)
        self.flush()

    monkeypatch.setattr(TakeWriter, "write", write)
    recorder.put(START_NS, b"before")
    recorder.put(START_NS, b"this too")
    while recorder._written < 14:
        pass
    failing.set()
    recorder.put(START_NS, b"this not")
    recorder.wait()
    assert isinstance(recorder.failure, TakeError)
    assert recorder.failure.what == "no more"
    assert recorder.finished
    known = recorder.bytes
    recorder.put(START_NS, b"nor this")
    recorder.put_motion(pipeline.empty(20))
    recorder.stop(SUMMARY)
    recorder.wait()
    assert recorder.bytes == known
    assert recorder.failure.what == "no more"
    monkeypatch.undo()
    back = recover(path.with_name("take.mcap.recording"))
    assert [chunk for _, chunk in open_take(back.path).chunks()] == [b"before", b"this too"]


def test_a_mistake_of_ours_is_kept_as_a_failure_too(recorder, path, monkeypatch):
    def write(*_: object) -> None:
        raise ZeroDivisionError("a mistake")

    monkeypatch.setattr(TakeWriter, "write", write)
    recorder.put(START_NS, b"abc")
    recorder.wait()
    assert "ZeroDivisionError: a mistake" in recorder.failure.what
    assert f"{path}.recording" in recorder.failure.remedy


def test_what_waits_for_the_disk_is_limited_and_the_take_has_no_hole(recorder, path, monkeypatch):
    monkeypatch.setattr(recorder_module, "BACKLOG_LIMIT", 1000)
    honest, free = TakeWriter.write, threading.Event()

    def write(self: TakeWriter, arrival_ns: int, chunk: bytes) -> None:
        free.wait()
        honest(self, arrival_ns, chunk)

    monkeypatch.setattr(TakeWriter, "write", write)
    for k in range(30):
        recorder.put(START_NS + k, bytes([k]) * (100 if k != 9 else 101))
    assert "behind" in recorder.failure.what
    free.set()
    recorder.put(START_NS, b"later, when there would be room again")
    recorder.stop(SUMMARY)
    recorder.wait()
    assert [chunk[0] for _, chunk in open_take(path).chunks()] == list(range(9))
    assert "behind" in recorder.failure.what


def test_long_recordings_do_not_wear_out_the_limit(recorder, path, monkeypatch):
    """What is written makes room, to the byte, however long it goes on."""
    monkeypatch.setattr(recorder_module, "BACKLOG_LIMIT", 64_000)
    for k in range(20_000):
        while recorder.bytes - recorder._written > 32_000:
            pass
        recorder.put(START_NS + k, bytes(100))
    recorder.stop(SUMMARY)
    recorder.wait()
    assert recorder.failure is None
    assert recorder._written == recorder.bytes == 2_000_000


def test_a_take_that_exists_is_refused_and_left_alone(path):
    path.write_text("four years of work")
    with pytest.raises(TakeError, match="exists already"):
        Recorder(path, header(path), b"")
    assert path.read_text() == "four years of work"
