"""A recording that goes on is told from one that was interrupted, across processes."""

from __future__ import annotations

import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import pytest

from handstudio.recording.bin import move_to_bin
from handstudio.recording.held import hold, is_held
from handstudio.recording.housekeeping import rename_take, undo
from handstudio.recording.library import entries
from handstudio.recording.writer import UNFINISHED, TakeWriter

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="locks of POSIX")

NOW = datetime(2026, 3, 4, 12, 30, 5, tzinfo=UTC)

RECORDING = """
import sys
from pathlib import Path
from handstudio.layout import glove
from handstudio.recording.header import Header
from handstudio.recording.writer import TakeWriter
from handstudio.setup import Setup

setup = Setup(glove("right", ["SN1"]), 100.0, decoder="handstudio-1")
writer = TakeWriter(Path(sys.argv[1]), Header("t", "S", 1, setup, "wire", "test"))
print("recording", flush=True)
sys.stdin.read()
"""


def test_a_recording_of_another_process_is_held_until_that_dies(tmp_path):
    path = tmp_path / "S01" / "day" / "other.mcap"
    cut = path.with_name(path.name + UNFINISHED)
    process = subprocess.Popen(
        [sys.executable, "-c", RECORDING, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"recording\n"
        assert is_held(cut)
        assert entries(tmp_path)[0].recording
        process.kill()
        process.wait()
    assert not is_held(cut)
    (entry,) = entries(tmp_path)
    assert not entry.recording
    assert "interrupted" in entry.problem


def test_a_recording_is_held_until_it_is_closed(tmp_path, header):
    writer = TakeWriter(tmp_path / "a.mcap", header)
    assert is_held(tmp_path / f"a.mcap{UNFINISHED}")
    assert not is_held(writer.close())


def test_one_holds_at_a_time(tmp_path):
    path = tmp_path / "x"
    path.write_bytes(b"")
    with path.open("rb") as one, path.open("rb") as other:
        assert hold(one)
        assert not hold(other)
    assert not is_held(path)
    assert not is_held(tmp_path / "nothing")


@pytest.mark.parametrize("act", ["rename", "bin"])
def test_who_lists_the_library_does_not_disturb_a_move_that_goes_on(
    tmp_path, taken, monkeypatch, act
):
    path = taken(tmp_path / "S01" / "day" / "squeeze.mcap")
    seen: list[int] = []
    real = Path.rename

    def slow(source: Path, target: Path) -> Path:
        seen.append(len(entries(tmp_path)))
        return real(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "rename", slow)
        if act == "rename":
            rename_take(tmp_path, path, "other")
        else:
            move_to_bin(tmp_path, path, NOW)
    assert seen == [1] * 7  # until its own file goes, last, the take is there
    assert [entry.name for entry in entries(tmp_path)] == (["other"] if act == "rename" else [])


def test_where_files_cannot_be_held_takes_move_all_the_same(tmp_path, taken, content, monkeypatch):
    path = taken(tmp_path / "S01" / "day" / "squeeze.mcap")
    before = content(tmp_path)
    monkeypatch.setattr(sys, "platform", "win32")
    assert undo(tmp_path, rename_take(tmp_path, path, "other")) == path
    assert undo(tmp_path, move_to_bin(tmp_path, path, NOW)) == path
    (tmp_path / ".moves").mkdir()
    (tmp_path / ".moves" / "x.json").write_text(
        '[{"source": "S01/day/squeeze.mcap", "target": "S01/day/other.mcap"}]'
    )
    assert [entry.name for entry in entries(tmp_path)] == ["other"]
    path.with_name("other.mcap").rename(path)
    assert content(tmp_path) == before
