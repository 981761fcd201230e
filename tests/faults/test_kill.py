"""`handstudio record` killed at any moment: what was flushed comes back, and nothing runs on."""

from __future__ import annotations

import contextlib
import struct
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from handstudio.process import process
from handstudio.recording.recovery import recover
from handstudio.recording.take import open_take
from handstudio.recording.writer import FLUSH_S

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/task").is_dir(), reason="needs /proc to see what runs on"
)

STALL_S = 0.25
"""How late a thread of a busy machine may be. The figure that counts is FLUSH_S."""

# The command itself, with a diary of what its line received: (when [monotonic ns], size), bytes.
RECORD = """
import os, struct, sys, time
from handstudio.cli import main
from handstudio.device.virtual_source import VirtualSource

diary = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
read = VirtualSource.read

def noted(self, timeout_s):
    chunk = read(self, timeout_s)
    if chunk:
        os.write(diary, struct.pack("<qq", time.monotonic_ns(), len(chunk)) + chunk)
    return chunk

VirtualSource.read = noted
main(sys.argv[2:])
"""


@dataclass
class Killed:
    """What a recording process had received when it was killed, and where its file is."""

    received: list[tuple[int, bytes]]  # monotonic [ns], chunk
    file: Path


def killed(folder: Path, rate_hz: int, after_s: float) -> Killed:
    """Record, and kill the process so long after the file is there."""
    diary, sessions = folder / "diary", folder / "sessions"
    arguments = ["record", f"virtual:?rate={rate_hz}", "--sessions", str(sessions)]
    command = [sys.executable, "-c", RECORD, str(diary), *arguments]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        end = time.monotonic() + 30.0
        while not (files := list(sessions.rglob("*.mcap.recording"))):
            assert time.monotonic() < end
            assert process.poll() is None
            time.sleep(0.01)
        glove = child_of(process.pid)
        time.sleep(after_s)
    finally:
        process.kill()
        process.wait()
    while Path(f"/proc/{glove}").exists():  # it ends with us, whatever ended us
        assert time.monotonic() < end + 10.0
        time.sleep(0.01)
    return Killed(entries(diary.read_bytes()), files[0])


def child_of(pid: int) -> int:
    found: set[int] = set()
    for task in Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(OSError):
            found |= {int(child) for child in (task / "children").read_text().split()}
    (child,) = found
    return child


def entries(diary: bytes) -> list[tuple[int, bytes]]:
    found, at = [], 0
    while at + 16 <= len(diary):
        when_ns, size = struct.unpack_from("<qq", diary, at)
        chunk = diary[at + 16 : at + 16 + size]
        if len(chunk) == size:
            found.append((when_ns, chunk))
        at += 16 + size
    return found


def check(got: Killed) -> float:
    """All that was flushed is there, in order; how much time is not [s]."""
    recovered = recover(got.file)
    take = open_take(recovered.path)
    saved = [chunk for _, chunk in take.chunks()]
    chunks = [chunk for _, chunk in got.received]
    assert saved, "nothing was saved"
    first = next(k for k in range(len(chunks)) if chunks[k : k + len(saved)] == saved)
    received_ns = np.array([when_ns for when_ns, _ in got.received])
    lost_ns = received_ns[first + len(saved) :]
    assert len(process(take)) > 0
    if len(lost_ns) == 0:
        return 0.0
    # what came with the chunk that was still on its way to the file counts too
    return float(lost_ns[-1] - lost_ns[0]) * 1e-9


def survives(folder: Path, seed: int, moments: int) -> None:
    rng = np.random.default_rng(seed)
    lost = []
    for k in range(moments):
        home = folder / str(k)
        home.mkdir()
        rate_hz = (100, 1000)[k % 2]
        got = killed(home, rate_hz, float(rng.uniform(0.5, 2.0)))
        lost.append(check(got))
        steps_s = np.diff([when_ns for when_ns, _ in got.received]) * 1e-9
        assert lost[-1] <= FLUSH_S + steps_s.max() + STALL_S, lost
    print(f"lost in {moments} kills [s]: {np.round(lost, 3).tolist()}", file=sys.stderr)


def test_a_recording_that_is_killed_loses_a_quarter_of_a_second_at_most(tmp_path):
    survives(tmp_path, 81, 4)


@pytest.mark.long
def test_many_recordings_that_are_killed_lose_a_quarter_of_a_second_at_most(tmp_path):
    survives(tmp_path, 82, 20)


def test_a_recording_whose_take_just_began_can_be_recovered(tmp_path):
    got = killed(tmp_path, 100, 0.0)
    recovered = recover(got.file)
    assert recovered.path.name == "take-recovered.mcap"
    assert open_take(recovered.path).header.subject == "S01"
    assert got.file.exists()
