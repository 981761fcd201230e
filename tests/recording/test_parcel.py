"""A take and its notes as one file, there and back; and files that are none."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from handstudio.errors import TakeError
from handstudio.recording.notes import Mark, Notes, load_notes, save_notes
from handstudio.recording.parcel import pack, take_in
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take


@pytest.fixture
def taken(tmp_path: Path) -> Path:
    path: Path = simulate(
        tmp_path / "here", rehearse(seed=3), seconds=0.5, code="S07", name="reach"
    )
    save_notes(path, Notes(text="left thumb hurts", marks=(Mark(0.2, "here"),)))
    return path


def test_it_comes_with_its_notes_and_lies_under_its_subject_and_day(taken, tmp_path):
    parcel = pack(open_take(taken), tmp_path / "sent.take.zip")
    there = take_in(parcel, tmp_path / "there")
    assert there.relative_to(tmp_path / "there").parts[0] == "S07"
    assert there.name == "sent.mcap"
    assert there.read_bytes() == taken.read_bytes()
    assert load_notes(there) == load_notes(taken)


def test_a_bare_take_brings_the_notes_beside_it(taken, tmp_path):
    there = take_in(taken, tmp_path / "there")
    assert load_notes(there).text == "left thumb hurts"
    assert taken.exists()
    again = take_in(taken, tmp_path / "there")
    assert again != there


@pytest.mark.parametrize("content", [b"", b"four years of work", b"PK\x03\x04 and no more"])
def test_what_is_no_take_stays_outside(content, tmp_path):
    file = tmp_path / "thesis.mcap"
    file.write_bytes(content)
    with pytest.raises(TakeError):
        take_in(file, tmp_path / "there")
    assert not list((tmp_path / "there").rglob("*.*"))


def test_a_zip_of_something_else_says_so(tmp_path):
    with zipfile.ZipFile(tmp_path / "photos.zip", "w") as photos:
        photos.writestr("../../take.mcap", "a way out")
    with pytest.raises(TakeError, match="without a take"):
        take_in(tmp_path / "photos.zip", tmp_path / "there")


def test_a_take_that_is_cut_short_stays_outside(taken, tmp_path):
    parcel = pack(open_take(taken), tmp_path / "sent.take.zip")
    with zipfile.ZipFile(parcel) as whole:
        content = whole.read("take.mcap")
    with zipfile.ZipFile(parcel, "w") as short:
        short.writestr("take.mcap", content[: len(content) // 2])
    with pytest.raises(TakeError, match="cut short"):
        take_in(parcel, tmp_path / "there")


def test_where_nothing_can_be_written_nothing_is_left(taken, tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(TakeError, match="cannot be written"):
        pack(open_take(taken), tmp_path / "taken" / "sent.take.zip")
