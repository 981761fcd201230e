"""Notes and other small files: always a whole one there, the new or the one before."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from handstudio.errors import TakeError
from handstudio.recording.atomic import write_atomically
from handstudio.recording.notes import (
    Label,
    Mark,
    Notes,
    load_notes,
    notes_path,
    save_notes,
    with_label,
    with_mark,
    with_text,
    without_label,
    without_mark,
)

ONE = Notes((Label(0.5, 1.25, "static"), Label(2.0, 3.0, "index_mcp:flexion")), "左手 ok")
TWO = Notes((), "later")


@pytest.fixture
def take(tmp_path) -> Path:
    return tmp_path / "squeeze.v2.mcap"


def test_without_a_file_there_are_no_notes(take):
    assert load_notes(take) == Notes()
    assert list(take.parent.iterdir()) == []


def test_notes_are_kept_beside_their_take(take):
    save_notes(take, ONE)
    assert notes_path(take).name == "squeeze.v2.notes.json"
    assert load_notes(take) == ONE


def test_the_notes_before_stay_as_a_backup_and_nothing_else_is_left(take):
    save_notes(take, ONE)
    save_notes(take, TWO)
    assert load_notes(take) == TWO
    names = {path.name for path in take.parent.iterdir()}
    assert names == {"squeeze.v2.notes.json", "squeeze.v2.notes.json.bak"}


@pytest.mark.parametrize(
    "damage", [b"", b'{"labels": [', b"\xff\xfe", b'{"labels": 5}', b'{"text": "\xff"}']
)
def test_where_the_notes_are_damaged_the_backup_is_read(take, damage):
    save_notes(take, ONE)
    save_notes(take, TWO)
    notes_path(take).write_bytes(damage)
    assert load_notes(take) == ONE


def test_where_the_notes_are_gone_the_backup_is_read(take):
    save_notes(take, ONE)
    save_notes(take, TWO)
    notes_path(take).unlink()
    assert load_notes(take) == ONE


def test_where_both_are_damaged_it_says_so_and_following_the_remedy_helps(take):
    save_notes(take, ONE)
    save_notes(take, TWO)
    backup = notes_path(take).with_name(notes_path(take).name + ".bak")
    for path in (notes_path(take), backup):
        path.write_bytes(b"{")
    with pytest.raises(TakeError, match=r"notes\.json.*cannot be read") as caught:
        load_notes(take)
    named = [path for path in (notes_path(take), backup) if path.name in caught.value.remedy]
    assert named == [notes_path(take), backup]
    for path in named:
        path.rename(path.with_name("elsewhere-" + path.name))
    assert load_notes(take) == Notes()


def test_a_folder_that_cannot_be_written_is_an_error_of_ours(take):
    (take.parent / "file").write_text("")
    with pytest.raises(TakeError, match=r"cannot be written.*\n.*permissions"):
        save_notes(take.parent / "file" / "squeeze.mcap", ONE)


@pytest.mark.parametrize("moment", ["fsync", "replace"])
def test_a_crash_while_writing_leaves_the_notes_before(take, monkeypatch, moment):
    save_notes(take, ONE)
    with monkeypatch.context() as patch:
        if moment == "fsync":
            patch.setattr(os, "fsync", _crash)
        else:
            patch.setattr(Path, "replace", _crash)
        with pytest.raises(KeyboardInterrupt):
            save_notes(take, TWO)
    assert load_notes(take) == ONE
    save_notes(take, TWO)
    assert load_notes(take) == TWO


def test_what_is_written_atomically_replaces_the_whole(tmp_path):
    path = tmp_path / "deeper" / "x"
    write_atomically(path, b"a long content")
    write_atomically(path, b"short")
    assert path.read_bytes() == b"short"
    assert path.with_name("x.bak").read_bytes() == b"a long content"


def _crash(*_: object) -> None:
    raise KeyboardInterrupt


def test_marks_and_stretches_come_and_go_in_order_of_time():
    notes = with_mark(with_mark(Notes(), 2.0), 0.5, "起点")
    assert notes.marks == (Mark(0.5, "起点"), Mark(2.0))
    assert without_mark(notes, Mark(2.0)).marks == (Mark(0.5, "起点"),)
    assert without_mark(notes, Mark(9.0)) == notes
    labelled = with_label(with_label(notes, 3.0, 1.0, " grasp "), 0.0, 0.5, "rest")
    assert labelled.labels == (Label(0.0, 0.5, "rest"), Label(1.0, 3.0, "grasp"))
    assert without_label(labelled, Label(1.0, 3.0, "grasp")).labels == (Label(0.0, 0.5, "rest"),)
    assert with_text(labelled, "ok") == Notes(labelled.labels, "ok", notes.marks)


def test_of_two_marks_that_are_the_same_one_is_removed():
    notes = with_mark(with_mark(Notes(), 1.0), 1.0)
    assert without_mark(notes, Mark(1.0)).marks == (Mark(1.0),)


@pytest.mark.parametrize("at_s", [float("nan"), float("inf")])
def test_what_is_no_time_is_refused(at_s):
    with pytest.raises(TakeError, match="no time in a take"):
        with_mark(Notes(), at_s)
    with pytest.raises(TakeError, match="no time in a take"):
        with_label(Notes(), 0.0, at_s, "x")


def test_a_stretch_has_a_name_and_a_length():
    with pytest.raises(TakeError, match="no name"):
        with_label(Notes(), 0.0, 1.0, "  ")
    with pytest.raises(TakeError, match=r"begins and ends at 1\.00 s"):
        with_label(Notes(), 1.0, 1.0, "x")


def test_notes_of_before_marks_can_be_read(take):
    old = b'{"labels": [{"start_s": 0.5, "end_s": 1.25, "label": "static"}], "text": "ok"}'
    notes_path(take).write_bytes(old)
    assert load_notes(take) == Notes((Label(0.5, 1.25, "static"),), "ok")


def test_notes_of_a_recording_lie_where_its_closed_take_looks(take):
    save_notes(take.with_name(f"{take.name}.recording"), ONE)
    assert load_notes(take) == ONE
