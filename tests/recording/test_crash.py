"""What a process that dies or a disk that is full leaves behind: all that was flushed."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from handstudio.layout import glove
from handstudio.recording.header import Header
from handstudio.recording.recovery import recover
from handstudio.recording.take import open_take
from handstudio.recording.writer import UNFINISHED, TakeWriter
from handstudio.setup import Setup

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of POSIX")

CHUNK = 120

# Writes numbered chunks as fast as it can, and says after each flush how many are handed over.
WRITER = """
import os, sys, time
from pathlib import Path
from handstudio.layout import glove
from handstudio.recording.header import Header
from handstudio.recording.writer import TakeWriter
from handstudio.setup import Setup
import handstudio.recording.writer as module

module.FLUSH_S = 0.002
class Telling(TakeWriter):
    def flush(self):
        super().flush()
        os.write(1, b"%d\\n" % self.chunks)

setup = Setup(glove("right", ["SN1"]), 1000.0, decoder="handstudio-1")
writer = Telling(Path(sys.argv[1]), Header("t", "S", 1, setup, "wire", "test"))
k = 0
while True:
    for _ in range(5):
        writer.write(1000 + k, k.to_bytes(4, "little") + os.urandom(%d))
        k += 1
    time.sleep(0.0005)
""".replace("%d))", f"{CHUNK - 4}))")


def numbers(path: Path) -> list[int]:
    chunks = [data for _, data in open_take(path).chunks()]
    assert all(len(data) == CHUNK for data in chunks)
    return [int.from_bytes(data[:4], "little") for data in chunks]


@posix
@pytest.mark.parametrize(
    "times",
    [pytest.param(2, id="twice"), pytest.param(30, id="many", marks=pytest.mark.long)],
)
def test_a_writer_that_is_killed_loses_only_what_it_had_not_flushed(tmp_path, times):
    rng = random.Random(times)
    waits = [rng.uniform(0.0, 0.3) for _ in range(times)]
    paths = [tmp_path / f"t{k}.mcap" for k in range(times)]
    # two at a time: what takes long is the start of a process
    for k in range(0, times, 2):
        pairs = list(zip(paths[k : k + 2], waits[k : k + 2], strict=True))
        running = [
            subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE)
            for path, _ in pairs
        ]
        for process, (path, wait) in zip(running, pairs, strict=True):
            _kill_and_recover(process, path, wait)


def _kill_and_recover(process: subprocess.Popen[bytes], path: Path, wait_s: float) -> None:
    assert process.stdout is not None
    assert process.stdout.readline() == b"0\n"  # header and first state are on disk
    time.sleep(wait_s)
    process.send_signal(signal.SIGKILL)
    said = process.stdout.read().split(b"\n")
    process.stdout.close()
    process.wait()
    # a number that was not said to its end counts for nothing
    promised = int(said[-2]) if len(said) > 1 else 0
    got = recover(path.with_name(path.name + UNFINISHED))
    assert numbers(got.path) == list(range(got.chunks))
    assert got.chunks >= promised
    assert not path.exists()


FILL = """
import resource, signal, sys
from handstudio.errors import TakeError

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # the write fails instead
limit = int(sys.argv.pop(2))
if limit:
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
try:
    exec(sys.stdin.read())
except TakeError as error:
    print("TakeError", error.what, error.remedy, sep="|")
"""


def filled(path: Path, limit: int) -> tuple[int, list[str]]:
    """Let the writer run until the disk is full: how many chunks it flushed, and its last words."""
    process = subprocess.run(
        [sys.executable, "-c", FILL, str(path), str(limit)],
        input=WRITER.encode(),
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert process.returncode == 0, process.stderr.decode()
    lines = process.stdout.decode().splitlines()
    return int(lines[-2]), lines[-1].split("|")


def _comes_back(path: Path, limit: int) -> None:
    promised, said = filled(path, limit)
    unfinished = path.with_name(path.name + UNFINISHED)
    kind, what, remedy = said
    assert kind == "TakeError"
    assert str(unfinished) in what
    assert "cannot be written" in what
    assert f"handstudio recover '{unfinished}'" in remedy
    assert "space" in remedy
    assert promised > 50
    unfinished = unfinished.rename(path.parent.parent / unfinished.name)  # where there is room
    got = recover(unfinished)
    assert numbers(got.path) == list(range(got.chunks))
    assert got.chunks >= promised


@posix
def test_a_file_that_may_not_grow_ends_in_an_error_and_what_was_flushed_comes_back(tmp_path):
    (tmp_path / "limited").mkdir()
    _comes_back(tmp_path / "limited" / "t.mcap", limit=60_000)


@posix
@pytest.mark.skipif(
    sys.platform != "linux" or os.geteuid() != 0, reason="mounting a small disk needs root"
)
def test_a_full_disk_ends_in_an_error_and_what_was_flushed_comes_back(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(disk)],
        capture_output=True,
        check=False,
    )
    if mounted.returncode != 0:
        pytest.skip(f"cannot mount here: {mounted.stderr.decode().strip()}")
    try:
        path = disk / "t.mcap"
        promised, said = filled(path, limit=0)
        assert said[0] == "TakeError"
        assert "No space left" in said[1]
        copy = tmp_path / f"t.mcap{UNFINISHED}"
        copy.write_bytes(path.with_name(copy.name).read_bytes())
        got = recover(copy)
        assert numbers(got.path) == list(range(got.chunks))
        assert got.chunks >= promised > 50
    finally:
        subprocess.run(["umount", str(disk)], check=True)


@posix
def test_a_disk_that_is_full_from_the_start_leaves_no_file_in_the_way(tmp_path):
    path = tmp_path / "t.mcap"
    process = subprocess.run(
        [sys.executable, "-c", FILL, str(path), "100"],
        input=WRITER.encode(),
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert process.stdout.startswith(b"TakeError"), process.stderr.decode()
    assert list(tmp_path.iterdir()) == []


def test_what_is_written_faster_than_it_happened_is_handed_over_as_often(tmp_path):
    """Half of a simulated or copied take is half a take too, however fast the machine."""
    path = tmp_path / "fast.mcap"
    setup = Setup(glove("right", ["SN1"]), 100.0, decoder="handstudio-1")
    writer = TakeWriter(path, Header("fast", "S", 1_000, setup, "wire", "test"))
    for instant in range(1000):
        writer.write(1_000 + instant * 10_000_000, bytes(CHUNK))
    whole = writer.close()
    cut = tmp_path / "cut.mcap.recording"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    assert 3.0 < recover(cut).duration_s < 7.0
