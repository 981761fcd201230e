"""Poses of a tracker by the Lab Streaming Layer, from an outlet in another process."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from handstudio.device.lsl import LslTracker
from handstudio.errors import DeviceError, TrackError

pytest.importorskip("pylsl")

OUTLET = """
import sys, time
import pylsl
name, labelled = sys.argv[1], sys.argv[2] == "labelled"
columns = ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")
labels = [f"{terminal}_{column}" for terminal in ("upper", "lower") for column in columns]
info = pylsl.StreamInfo(name, "MoCap", len(labels), 120, "float32", name)
if labelled:
    channels = info.desc().append_child("channels")
    for label in labels:
        channels.append_child("channel").append_child_value("label", label)
outlet = pylsl.StreamOutlet(info)
print("ready", flush=True)
count = 0
while True:
    outlet.push_sample([float(count), 2, 3, 1, 0, 0, 0, 4, 5, 6, 0, 1, 0, 0])
    count += 1
    time.sleep(1 / 120)
"""


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The layer keeps to this machine."""
    path = tmp_path / "lsl_api.cfg"
    path.write_text("[multicast]\nResolveScope = machine\n[log]\nlevel = -3\n")
    monkeypatch.setenv("LSLAPICFG", str(path))
    return path


@pytest.fixture
def outlet(request: pytest.FixtureRequest, config: Path) -> Iterator[str]:
    name = f"handstudio-{request.node.name[:30]}-{id(config)}"
    kind = getattr(request, "param", "labelled")
    process = subprocess.Popen(
        [sys.executable, "-c", OUTLET, name, kind], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    while process.stdout.readline().strip() != "ready":
        assert process.poll() is None
    yield name
    process.kill()
    process.wait()
    process.stdout.close()


def test_poses_come_in_metres_and_on_our_clock(outlet: str) -> None:
    tracker = LslTracker(outlet)
    rows = [tracker.read(1.0) for _ in range(20)]
    tracker.close()
    upper = np.concatenate([row[0].t_room_terminal for row in rows])
    time_us = np.concatenate([row[0].time_us for row in rows])
    assert len(upper) >= 20
    np.testing.assert_allclose(np.diff(upper[:, 0]), 1e-3, atol=1e-6)  # none is missing
    assert np.all(np.diff(time_us) > 0)
    lower = rows[0][1]
    np.testing.assert_allclose(lower.t_room_terminal[0], [0.004, 0.005, 0.006], atol=1e-9)
    np.testing.assert_allclose(lower.q_room_terminal[0], [0, 1, 0, 0])


@pytest.mark.parametrize("outlet", ["unlabelled"], indirect=True)
def test_channels_without_names_are_refused(outlet: str) -> None:
    with pytest.raises(TrackError, match="labels 0 of its 14 channels"):
        LslTracker(outlet)


def test_a_stream_that_is_not_there_is_said(config: Path) -> None:
    with pytest.raises(DeviceError, match="No stream called"):
        LslTracker("nobody streams this", timeout_s=0.2)
