"""A tracker's stream beside a glove's: into the take, gone, back, and what is no tracker."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from handstudio.device.capture import Capture
from handstudio.device.orders import Connect, Disconnect, Phase, SetTracker, StartTake, StopTake
from handstudio.device.tracker import TrackerPhase, TrackerReader
from handstudio.errors import DeviceError
from handstudio.recording.take import open_take
from handstudio.recording.tracker_message import TrackerFacts
from tests.device.conftest import eventually

pytest.importorskip("pylsl")


@pytest.fixture
def stream(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The layer keeps to this machine."""
    path = tmp_path / "lsl_api.cfg"
    path.write_text("[multicast]\nResolveScope = machine\n[log]\nlevel = -3\n")
    monkeypatch.setenv("LSLAPICFG", str(path))
    return f"handstudio test {tmp_path.name}"


def test_a_terminal_of_the_virtual_glove_is_recorded_on_the_clock_of_its_bytes(
    stream: str, tmp_path: Path
) -> None:
    capture = Capture()
    facts = TrackerFacts(f"lsl:{stream}", "hand")
    reader = TrackerReader(facts, capture)
    path = tmp_path / "with.mcap"
    capture.start()
    reader.start()
    try:
        capture.send(SetTracker(facts))
        capture.send(Connect(f"virtual:?tracker=hand&tracker-name={stream}"))
        eventually(lambda: capture.newest.phase is Phase.STREAMING, "the glove streams")
        eventually(lambda: reader.newest.phase is TrackerPhase.STREAMING, "the tracker streams")
        capture.send(StartTake(path, "S01"))
        begun = reader.newest.count
        eventually(lambda: reader.newest.count > begun + 60, "poses come")
        capture.send(StopTake())
        eventually(path.exists, "the take is whole")
        capture.send(Disconnect())
        eventually(lambda: reader.newest.phase is TrackerPhase.GONE, "it is seen to be gone")
    finally:
        reader.end()
        capture.stop()
        reader.join()
    take = open_take(path)
    poses = take.poses()
    assert take.header.tracker == facts
    assert take.summary is not None
    assert take.summary.poses == len(poses) > 50
    late_us = poses.arrival_ns // 1000 - poses.own_us
    assert np.median(np.abs(late_us)) < 200_000
    assert np.abs(np.diff(poses.own_us) - 1e6 / 60).max() < 5_000  # none is missing
    arrivals = [at_ns for at_ns, _ in take.chunks()]
    assert arrivals[0] - 10**9 < poses.arrival_ns[0] < arrivals[-1] + 10**9


def test_what_is_no_address_of_a_tracker_is_refused() -> None:
    with pytest.raises(DeviceError, match="not the address of a tracker"):
        TrackerReader(TrackerFacts("usb:1"), Capture())
