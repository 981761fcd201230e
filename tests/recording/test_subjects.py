"""Subjects: codes every system takes, files that may be damaged, and removal with certainty."""

from __future__ import annotations

import shutil
import sys
from datetime import UTC, datetime
from pathlib import Path

import pytest

from handstudio.errors import TakeError
from handstudio.recording.bin import list_bin, move_to_bin
from handstudio.recording.deletion import delete_subject, what_deleting_removes
from handstudio.recording.library import entries, new_take_path
from handstudio.recording.subjects import (
    FILE,
    Subject,
    create_subject,
    list_subjects,
    load_subject,
    save_subject,
)
from handstudio.recording.writer import TakeWriter

NOW = datetime(2026, 3, 4, 12, 30, 5, tzinfo=UTC)
ONE = Subject("S01", "left", 171.0, "dominant hand")

posix = pytest.mark.skipif(sys.platform == "win32", reason="links and locks of POSIX")


# --- what is known of them ------------------------------------------------------------------------


@pytest.mark.parametrize("code", ["S01", "患者7", "P-1.b+", "Zoë"])
def test_a_subject_is_kept(tmp_path, code):
    made = create_subject(tmp_path, Subject(code, "right", 180.5))
    assert made == load_subject(tmp_path, code) == Subject(code, "right", 180.5)
    assert [known.subject for known in list_subjects(tmp_path)] == [made]


def test_spaces_around_a_code_and_how_its_accents_are_written_do_not_count(tmp_path):
    assert create_subject(tmp_path, Subject(" Zoe\u0308 ")).code == "Zoë"
    assert load_subject(tmp_path, "Zoe\u0308").code == "Zoë"


@pytest.mark.parametrize("code", ["s01", "S01", " S01 ", "Ｓ０１"])
def test_a_code_that_some_system_takes_for_one_there_is_is_refused(tmp_path, code):
    create_subject(tmp_path, ONE)
    with pytest.raises(TakeError, match=r"There is a subject S01 already.*\n"):
        create_subject(tmp_path, Subject(code))
    assert load_subject(tmp_path, "S01") == ONE


@pytest.mark.parametrize(
    "code",
    [
        *("", " ", "../x", "..", ".", ".bin", "/x", "C:\\x", "C:", "a/b", "a\\b", "a b", "S01."),
        *("CON", "aux.1", "lpt9", "a*", "a\0b", "x" * 81, "手" * 61, "_x"),
    ],
)
def test_a_code_that_some_system_does_not_take_is_refused(tmp_path, code):
    sessions = tmp_path / "sessions"
    sessions.mkdir()
    with pytest.raises(TakeError) as caught:
        create_subject(sessions, Subject(code))
    assert "Use letters, digits" in caught.value.remedy or "Type a name" in caught.value.remedy
    assert list(tmp_path.rglob("*")) == [sessions]


@pytest.mark.parametrize("length", [0.187, 7.4, -180.0, 401.0, float("nan"), float("inf")])
def test_a_hand_of_no_such_length_is_refused(tmp_path, length):
    with pytest.raises(TakeError, match=r"A hand is not .* mm long"):
        create_subject(tmp_path, Subject("S01", "left", length))
    assert list_subjects(tmp_path) == []


def test_what_is_known_may_change_and_the_content_before_is_kept(tmp_path):
    create_subject(tmp_path, ONE)
    changed = save_subject(tmp_path, Subject("S01", "left", 172.0))
    assert load_subject(tmp_path, "S01") == changed
    assert b"171" in (tmp_path / "S01" / f"{FILE}.bak").read_bytes()
    with pytest.raises(TakeError, match="There is no subject S02"):
        save_subject(tmp_path, Subject("S02"))


def test_a_folder_of_takes_is_a_subject_of_which_nothing_is_known(tmp_path, written):
    written(new_take_path(tmp_path, "old one", "squeeze", NOW))
    (known,) = list_subjects(tmp_path)
    assert known.subject == Subject("old_one")
    assert known.visits == ("2026-03-04",)
    assert save_subject(tmp_path, Subject("old_one", "left")) == load_subject(tmp_path, "old_one")


def test_a_new_take_goes_to_the_subject_and_visit_there_are(tmp_path):
    create_subject(tmp_path, ONE)
    path = new_take_path(tmp_path, "s01", "squeeze", NOW, "After surgery")
    assert path == tmp_path / "S01" / "After_surgery" / "squeeze.mcap"
    path.parent.mkdir()
    assert new_take_path(tmp_path, "S01", "x", NOW, "after surgery").parent == path.parent
    assert new_take_path(tmp_path, "S01", "x", NOW, " ").parent.name == "2026-03-04"
    assert new_take_path(tmp_path, "S01", "x", NOW, "../../y").parent == tmp_path / "S01" / "y"


@pytest.mark.parametrize("damage", [b"", b"{", b"[]", b'{"code": "\xff"}', b'{"code": 5}'])
def test_a_damaged_file_has_its_backup_and_then_says_so(tmp_path, damage):
    create_subject(tmp_path, ONE)
    create_subject(tmp_path, Subject("S02"))
    save_subject(tmp_path, Subject("S01"))
    file = tmp_path / "S01" / FILE
    file.write_bytes(damage)
    assert load_subject(tmp_path, "S01") == ONE  # the one before
    file.with_name(f"{FILE}.bak").write_bytes(damage)
    with pytest.raises(TakeError, match=r"subject\.json.*cannot be read") as caught:
        load_subject(tmp_path, "S01")
    first, second = list_subjects(tmp_path)
    assert first.subject == Subject("S01")
    assert first.error is not None
    assert first.error.what == caught.value.what
    assert second.error is None
    assert "again" in caught.value.remedy  # which helps:
    assert save_subject(tmp_path, ONE) == load_subject(tmp_path, "S01")


def test_the_folder_is_the_code_also_where_it_was_copied(tmp_path):
    create_subject(tmp_path, ONE)
    shutil.copytree(tmp_path / "S01", tmp_path / "S02")
    assert load_subject(tmp_path, "S02").code == "S02"


def test_where_a_subject_cannot_be_kept_it_says_so(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(TakeError, match=r"cannot be written.*\n.*permissions"):
        create_subject(file, ONE)


# --- removal --------------------------------------------------------------------------------------


@pytest.fixture
def sessions(tmp_path, taken, header) -> Path:
    """Of S01 two takes, one of them and an interrupted recording in the bin; one of S02."""
    sessions = tmp_path / "sessions"
    create_subject(sessions, ONE)
    taken(sessions / "S01" / "2026-03-04" / "squeeze.mcap")
    binned = taken(sessions / "S01" / "2026-03-05" / "open.mcap")
    move_to_bin(sessions, binned, NOW)
    writer = TakeWriter(sessions / "S01" / "2026-03-05" / "cut.mcap", header)
    writer.abandon()
    move_to_bin(sessions, sessions / "S01" / "2026-03-05" / "cut.mcap.recording", NOW)
    taken(sessions / "S02" / "2026-03-04" / "S01.mcap")  # the name of a take is no code
    move_to_bin(sessions, taken(sessions / "S02" / "2026-03-04" / "two.mcap"), NOW)
    return sessions


def named(sessions: Path, code: str) -> list[Path]:
    return [path for path in sessions.rglob("*") if path.name == code]


def test_it_is_counted_what_deleting_removes(sessions, content):
    before = content(sessions)
    told = what_deleting_removes(sessions, "S01")
    assert (told.takes, told.in_bin, told.visits) == (1, 2, 2)
    assert told.minutes == pytest.approx(2 * 0.35 / 60.0)
    ours = [data for name, data in before.items() if "S01/" in name and data is not None]
    assert told.bytes == sum(map(len, ours))
    assert content(sessions) == before


@pytest.mark.parametrize("typed", ["", "s01", "S01 ", "S02", "Ｓ０１"])
def test_nothing_is_deleted_unless_the_code_was_typed(sessions, content, typed):
    before = content(sessions)
    with pytest.raises(TakeError, match="Type the code exactly"):
        delete_subject(sessions, "S01", typed)
    assert content(sessions) == before


def test_everything_of_a_subject_goes_and_nothing_of_another(sessions, content):
    before = content(sessions)
    told = what_deleting_removes(sessions, "S01")
    assert delete_subject(sessions, "S01", "S01") == told
    assert named(sessions, "S01") == []
    kept = {name: data for name, data in before.items() if "S02" in Path(name).parts}
    after = content(sessions)
    assert {name: data for name, data in after.items() if "S02" in Path(name).parts} == kept
    assert [binned.name for binned in list_bin(sessions)] == ["two"]
    with pytest.raises(TakeError, match="There is no subject S01"):
        delete_subject(sessions, "S01", "S01")


def test_a_subject_of_which_all_is_in_the_bin_can_be_deleted(sessions):
    shutil.rmtree(sessions / "S01")
    told = delete_subject(sessions, "S01", "S01")
    assert (told.takes, told.in_bin) == (0, 2)
    assert named(sessions, "S01") == []


@pytest.mark.parametrize("code", ["", ".", "..", "../sessions", ".bin", "S01/2026-03-04", "/"])
def test_what_is_no_subject_is_not_deleted(sessions, content, code):
    before = content(sessions.parent)
    with pytest.raises(TakeError, match="There is no subject"):
        delete_subject(sessions, code, code)
    assert content(sessions.parent) == before


def test_a_subject_that_is_being_recorded_is_not_deleted(sessions, header, content):
    writer = TakeWriter(sessions / "S01" / "day" / "now.mcap", header)
    before = content(sessions)
    with pytest.raises(TakeError, match=r"is being recorded.*\nEnd the recording"):
        delete_subject(sessions, "S01", "S01")
    assert content(sessions) == before
    writer.discard()
    delete_subject(sessions, "S01", "S01")


@pytest.mark.parametrize("place", ["S01/2026-03-04/squeeze.notes.json", ".bin"])
def test_what_cannot_be_removed_is_named_and_a_second_try_goes_on(sessions, monkeypatch, place):
    real = shutil.rmtree

    def sticky(path: Path, ignore_errors: bool = False) -> None:
        if place in str(path):
            return
        stuck = [path / name for name in ("2026-03-04/squeeze.notes.json",) if place[0] == "S"]
        kept = {file: file.read_bytes() for file in stuck if file.exists()}
        real(path, ignore_errors)
        for file, data in kept.items():
            file.parent.mkdir(parents=True)
            file.write_bytes(data)

    with monkeypatch.context() as patch:
        patch.setattr(shutil, "rmtree", sticky)
        with pytest.raises(TakeError, match=r"of subject S01 cannot be removed.*\n.*again"):
            delete_subject(sessions, "S01", "S01")
    assert named(sessions, "S01") != []
    delete_subject(sessions, "S01", "S01")
    assert named(sessions, "S01") == []


def test_takes_of_the_code_below_another_subject_are_told_of(sessions):
    # the takes of these tests all have S01 in their header
    told = what_deleting_removes(sessions, "S01")
    assert told.elsewhere == (sessions / "S02" / "2026-03-04" / "S01.mcap",)
    delete_subject(sessions, "S01", "S01")
    assert len(entries(sessions)) == 1


@posix
def test_a_link_is_removed_but_told_where_it_led(sessions, tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "disk" / "kept").write_text("")
    (sessions / "S01" / "other disk").symlink_to(tmp_path / "disk")
    told = delete_subject(sessions, "S01", "S01")
    assert (tmp_path / "disk").resolve() in told.elsewhere
    assert (tmp_path / "disk" / "kept").exists()
    assert named(sessions, "S01") == []


def test_a_crash_in_the_middle_leaves_a_subject_that_can_be_deleted(sessions, tripwire):
    for steps in range(60):
        with tripwire(steps, KeyboardInterrupt()):
            try:
                delete_subject(sessions, "S01", "S01")
            except KeyboardInterrupt:
                if named(sessions, "S01"):
                    assert what_deleting_removes(sessions, "S01").code == "S01"
                    assert (sessions / "S01").exists()
                    continue
        break
    assert steps > 4  # each time some more were removed
    assert named(sessions, "S01") == []
    assert len(entries(sessions)) == len(list_bin(sessions)) == 1
