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

from handstudio.errors import TakeError
from handstudio.process import process
from handstudio.recording.recovery import recover
from handstudio.recording.take import open_take
from handstudio.recording.writer import FLUSH_S

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/task").is_dir(), reason="needs /proc to see what runs on"
)

STALL_S = 0.25
"""How late a thread of a busy machine may be. The figure that counts is FLUSH_S."""

# The command itself, with a diary: what its line received, and what its file had flushed.
# An entry is its time [monotonic ns], its kind, the size of what follows, and that.
DIARY = """
import os, struct, sys, time
from handstudio.device.virtual_source import VirtualSource
from handstudio.recording.writer import TakeWriter

diary = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
read, flush = VirtualSource.read, TakeWriter.flush

def note(kind, data):
    os.write(diary, struct.pack("<qqq", time.monotonic_ns(), kind, len(data)) + data)

def noted(self, timeout_s):
    chunk = read(self, timeout_s)
    if chunk:
        note(0, chunk)
    return chunk

def promised(self):
    flush(self)
    note(1, struct.pack("<q", self.chunks))

VirtualSource.read, TakeWriter.flush = noted, promised
"""

RECORD = f"""{DIARY}
from handstudio.cli import main

main(["record", sys.argv[2], "--sessions", sys.argv[3]])
"""

# The whole studio, and somebody who presses its button as soon as there is a hand.
STUDIO = f"""{DIARY}
import threading
from pathlib import Path
import app.__main__ as product
from app import intents
from handstudio.device.orders import Phase

begin = product._begin

def begun(studio, address):
    begin(studio, address)
    threading.Thread(target=press, args=(studio,), daemon=True).start()

def press(studio):
    while studio.capture.newest.phase is not Phase.STREAMING:
        time.sleep(0.01)
    studio.send(intents.SetCountdown(0))
    while studio.capture.newest.recorder is None:  # refused where a busy machine's glove was away
        studio.send(intents.SaveSubject("S01", "right", 187.0, then_record=True))
        time.sleep(5.0)

product._begin = begun
product.run(product.Options(Path(sys.argv[3]), sys.argv[2], port=9765, browser=False))
"""


@dataclass
class Killed:
    """What a recording process had received and flushed when it was killed, and its file."""

    received: list[tuple[int, bytes]]  # monotonic [ns], chunk
    promised: int  # chunks that its writer said to have flushed
    file: Path


def killed(folder: Path, rate_hz: int, after_s: float, program: str = RECORD) -> Killed:
    """Record, and kill the process so long after the file is there."""
    diary, sessions = folder / "diary", folder / "sessions"
    command = [sys.executable, "-c", program, str(diary), f"virtual:?rate={rate_hz}", str(sessions)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    children: set[int] = set()
    end = time.monotonic() + 60.0
    try:
        while not (files := list(sessions.rglob("*.mcap.recording"))):
            assert time.monotonic() < end
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(after_s)
        children = children_of(process.pid)
    finally:
        process.kill()
        process.wait()
    while any(runs(child) for child in children):  # they end with us, whatever ended us
        assert time.monotonic() < end + 30.0
        time.sleep(0.01)
    noted = entries(diary.read_bytes())
    flushed = [struct.unpack("<q", data)[0] for _, kind, data in noted if kind == 1]
    received = [(when_ns, data) for when_ns, kind, data in noted if kind == 0]
    return Killed(received, max(flushed, default=0), files[0])


def children_of(pid: int) -> set[int]:
    """Glove, and what a studio starts for its work; they write nothing of ours."""
    found: set[int] = set()
    for task in Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(OSError):
            found |= {int(child) for child in (task / "children").read_text().split()}
    assert found
    return found


def runs(pid: int) -> bool:
    """Whether a process is there and has not ended; one nobody waited for is a zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def entries(diary: bytes) -> list[tuple[int, int, bytes]]:
    """Whole entries: when, of which kind, and what."""
    found, at = [], 0
    while at + 24 <= len(diary):
        when_ns, kind, size = struct.unpack_from("<qqq", diary, at)
        data = diary[at + 24 : at + 24 + size]
        if len(data) == size:
            found.append((when_ns, kind, data))
        at += 24 + size
    return found


def check(got: Killed) -> float:
    """All that was flushed is there, in order; how much time is not [s]."""
    recovered = recover(got.file)
    assert recovered.chunks >= got.promised
    take = open_take(recovered.path)
    saved = [chunk for _, chunk in take.chunks()]
    chunks = [chunk for _, chunk in got.received]
    if not saved:
        assert got.promised == 0
        return 0.0
    first = next(k for k in range(len(chunks)) if chunks[k : k + len(saved)] == saved)
    received_ns = np.array([when_ns for when_ns, _ in got.received])
    lost_ns = received_ns[first + len(saved) :]
    assert len(process(take)) > 0
    if len(lost_ns) == 0:
        return 0.0
    # what came with the chunk that was still on its way to the file counts too
    return float(lost_ns[-1] - lost_ns[0]) * 1e-9


def survives(folder: Path, seed: int, moments: int, program: str) -> None:
    rng = np.random.default_rng(seed)
    lost = []
    for k in range(moments):
        home = folder / str(k)
        home.mkdir()
        got = killed(home, (100, 1000)[k % 2], float(rng.uniform(0.3, 2.0)), program)
        lost.append(check(got))
        steps_s = np.diff([when_ns for when_ns, _ in got.received]) * 1e-9
        assert lost[-1] <= FLUSH_S + steps_s.max() + STALL_S, lost
    print(f"lost in {moments} kills [s]: {np.round(lost, 3).tolist()}", file=sys.stderr)


def test_a_recording_that_is_killed_loses_a_quarter_of_a_second_at_most(tmp_path):
    survives(tmp_path, 81, 2, RECORD)


@pytest.mark.long
@pytest.mark.parametrize(
    ("program", "moments"), [(RECORD, 30), (STUDIO, 20)], ids=["record", "studio"]
)
def test_fifty_recordings_that_are_killed_keep_what_was_flushed(tmp_path, program, moments):
    survives(tmp_path, 82, moments, program)


def test_a_recording_whose_take_just_began_can_be_recovered(tmp_path):
    got = killed(tmp_path, 100, 0.0)
    if got.file.stat().st_size == 0:  # between its name and its first byte
        assert got.promised == 0
        with pytest.raises(TakeError, match="before anything was recorded"):
            recover(got.file)
        return
    recovered = recover(got.file)
    assert recovered.path.name == "take-recovered.mcap"
    assert recovered.chunks >= got.promised
    assert open_take(recovered.path).header.subject == "S01"
    assert got.file.exists()
