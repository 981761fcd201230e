"""The library: names that every system takes, no name twice, and files that cannot be opened."""

from __future__ import annotations

import os
from datetime import datetime
from pathlib import Path

import pytest

from handstudio.errors import TakeError
from handstudio.recording import library
from handstudio.recording.library import entries, new_take_path, sessions_folder
from handstudio.recording.naming import file_name
from handstudio.recording.notes import Notes, save_notes
from handstudio.recording.writer import UNFINISHED, TakeWriter

NOW = datetime(2026, 3, 4, 23, 59)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("squeeze", "squeeze"),
        ("  fist & open  ", "fist_open"),
        ("左手 1", "左手_1"),
        ("../../etc/passwd", "etc_passwd"),
        ("a/b\\c:d*e?f", "a_b_c_d_e_f"),
        (".hidden.", "hidden"),
        ("v1.2-x+y", "v1.2-x+y"),
        ("x" * 300, "x" * 80),
    ],
)
def test_words_become_a_name_for_a_file(text, name):
    assert file_name(text, "take") == name


@pytest.mark.parametrize("text", ["", "   ", "...", "///", "__"])
def test_nothing_is_no_name(text):
    with pytest.raises(TakeError, match=r"The take has no name.*\nType a name"):
        file_name(text, "take")


def test_a_take_lies_under_its_subject_and_day(tmp_path):
    path = new_take_path(tmp_path, "S 01", "squeeze", NOW)
    assert path == tmp_path / "S_01" / "2026-03-04" / "squeeze.mcap"
    assert not path.parent.exists()


def test_a_name_that_is_taken_gets_a_number(tmp_path, written, header):
    first = written(new_take_path(tmp_path, "S01", "squeeze", NOW))
    second = new_take_path(tmp_path, "S01", "squeeze", NOW)
    assert second.name == "squeeze-2.mcap"
    TakeWriter(second, header).abandon()  # one that was interrupted is taken too
    assert new_take_path(tmp_path, "S01", "squeeze", NOW).name == "squeeze-3.mcap"
    assert new_take_path(tmp_path, "S02", "squeeze", NOW).name == first.name


def test_every_take_is_listed_newest_first_and_what_cannot_be_opened_says_why(
    tmp_path, written, header
):
    visit = tmp_path / "S01" / "2026-03-04"
    old, new = written(visit / "old.mcap"), written(visit / "new.mcap")
    broken = visit / "broken.mcap"
    broken.write_bytes(new.read_bytes()[:-200])
    TakeWriter(visit / "cut.mcap", header).abandon()
    cut = visit / f"cut.mcap{UNFINISHED}"
    (visit / "old.notes.json").write_text("{}")
    written(tmp_path / "not_in_a_visit.mcap")
    for age, path in enumerate((new, broken, cut, old)):
        os.utime(path, (2e9 - age, 2e9 - age))
    found = entries(tmp_path)
    assert [entry.path for entry in found] == [new, broken, cut, old]
    assert [entry.take is not None for entry in found] == [True, False, False, True]
    for entry in found[1:3]:
        assert entry.problem
        assert f"handstudio recover '{entry.path}'" in entry.remedy


def test_an_empty_or_absent_library_holds_nothing(tmp_path):
    assert entries(tmp_path) == []
    assert entries(tmp_path / "nowhere") == []


def test_takes_live_where_one_chose_or_in_the_checkout_or_with_the_user(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert sessions_folder(Path("here")) == Path("here")
    assert sessions_folder().parent.name == "handstudio"
    (tmp_path / "sessions").mkdir()
    assert sessions_folder() != tmp_path / "sessions"  # any folder of that name is not enough
    (tmp_path / "pyproject.toml").touch()
    assert sessions_folder() == tmp_path / "sessions"


def test_only_what_changed_is_read_again(tmp_path, written, monkeypatch):
    visit = tmp_path / "S01" / "day"
    paths = [written(visit / f"{name}.mcap") for name in "abc"]
    read: list[str] = []
    real = library.open_take
    monkeypatch.setattr(library, "open_take", lambda path: read.append(path.name) or real(path))
    first = entries(tmp_path)
    assert sorted(read) == ["a.mcap", "b.mcap", "c.mcap"]
    read.clear()
    second = entries(tmp_path, first)
    assert second == first
    assert read == []
    save_notes(paths[1], Notes((), "new words"))
    paths[2].unlink()
    paths[0].write_bytes(paths[0].read_bytes()[:-200])
    third = {entry.name: entry for entry in entries(tmp_path, second)}
    assert sorted(read) == ["a.mcap", "b.mcap"]
    assert third.keys() == {"a", "b"}
    assert third["a"].take is None
    assert third["b"].notes.text == "new words"


def test_notes_that_cannot_be_read_do_not_hide_their_take(tmp_path, written):
    path = written(tmp_path / "S01" / "day" / "a.mcap")
    path.with_suffix(".notes.json").write_bytes(b'{"text": "\xff"}')
    (entry,) = entries(tmp_path)
    assert entry.take is not None
    assert entry.notes == Notes()
    assert entry.notes_error is not None
    assert "cannot be read" in entry.notes_error.what


def test_hidden_folders_hold_no_takes(tmp_path, written):
    written(tmp_path / ".bin" / "S01" / "a.mcap")
    written(tmp_path / "S01" / ".trash" / "b.mcap")
    written(tmp_path / "S01" / "day" / ".c.mcap")
    assert entries(tmp_path) == []
