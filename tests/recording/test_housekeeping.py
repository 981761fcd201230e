"""Renaming, bin and undo: nothing is lost, whatever happens in the middle."""

from __future__ import annotations

import os
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from handstudio.errors import TakeError
from handstudio.recording.bin import empty_bin, list_bin, move_to_bin, restore
from handstudio.recording.housekeeping import edit_notes, rename_take, undo
from handstudio.recording.library import entries, new_take_path
from handstudio.recording.naming import belongings, file_name
from handstudio.recording.notes import Label, Mark, Notes, load_notes, notes_path, save_notes
from handstudio.recording.take import open_take
from handstudio.recording.writer import UNFINISHED, TakeWriter

NOW = datetime(2026, 3, 4, 12, 30, 5, tzinfo=UTC)
IN_STEPS = range(1, 40)
"""More moves and removals than any operation makes."""

posix = pytest.mark.skipif(sys.platform == "win32", reason="permissions and locks of POSIX")


@pytest.fixture
def sessions(tmp_path) -> Path:
    return tmp_path / "sessions"


@pytest.fixture
def take(sessions, taken) -> Path:
    return taken(sessions / "S01" / "2026-03-04" / "squeeze.v2.mcap")


# --- rename ---------------------------------------------------------------------------------------


def test_a_take_gets_another_name_with_all_that_belongs_to_it_but_exports(sessions, take, content):
    before = content(take.parent)
    done = rename_take(sessions, take, "fist & open")
    assert done.path == take.with_name("fist_open.mcap")
    after = content(take.parent)
    assert after.pop("squeeze.v2.angles.csv") == before.pop("squeeze.v2.angles.csv")
    assert after == {k.replace("squeeze.v2", "fist_open"): v for k, v in before.items()}
    assert [entry.name for entry in entries(sessions)] == ["fist_open"]
    assert open_take(done.path).header.name == "squeeze"  # the raw file does not change


def test_a_take_whose_name_begins_like_another_s_takes_nothing_of_it(sessions, taken, content):
    folder = sessions / "S01" / "day"
    short, long = taken(folder / "squeeze.mcap"), taken(folder / "squeeze.v2.mcap")
    rename_take(sessions, short, "other")
    assert load_notes(long).text == "left hand"
    assert len(belongings(long)) == len(belongings(folder / "other.mcap")) == 6


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(max_size=300))
def test_any_name_is_taken_back_whatever_it_is(sessions, taken, content, name):
    path = sessions / "S01" / "day" / "squeeze.mcap"
    if not path.exists():
        taken(path)
    before = content(sessions)
    if _leaves_a_name(name):
        done = rename_take(sessions, path, name)
        assert done.path.parent == path.parent
        assert load_notes(done.path).text == "left hand"
        assert undo(sessions, done) == path
    else:
        with pytest.raises(TakeError, match="has no name"):
            rename_take(sessions, path, name)
    assert content(sessions) == before


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("../../outside", "outside"),
        ("/etc/passwd", "etc_passwd"),
        ("C:\\x", "C_x"),
        ("CON", "_CON"),
        ("nul.v2", "_nul.v2"),
        ("com¹", "_com¹"),
        ("左手 ぎゅっと", "左手_ぎゅっと"),
        ("か\u3099", "が"),
        ("cafe\u0301", "café"),
        ("हिन्दी", "हिन्दी"),
        ("x" * 300, "x" * 80),
        ("手" * 300, "手" * 60),
        ("\ud800ok", "ok"),
    ],
)
def test_names_stay_in_their_folder_and_within_what_systems_take(sessions, take, typed, name):
    done = rename_take(sessions, take, typed)
    assert done.path == take.with_name(f"{name}.mcap")
    assert file_name(name, "take") == name  # it is one already
    assert [entry.name for entry in entries(sessions)] == [name]


@pytest.mark.parametrize("taken_name", ["open", "OPEN", "ｏｐｅｎ"])
def test_a_name_that_some_system_takes_for_another_take_s_is_refused(
    sessions, take, taken, content, taken_name
):
    taken(take.with_name("open.mcap"))
    before = content(sessions)
    with pytest.raises(TakeError, match=r"another take.*\nChoose a name that is free"):
        rename_take(sessions, take, taken_name)
    assert content(sessions) == before


def test_only_the_case_of_a_name_may_change(sessions, take):
    done = rename_take(sessions, take, "Squeeze.V2")
    assert [entry.name for entry in entries(sessions)] == ["Squeeze.V2"]
    assert undo(sessions, done) == take


def test_notes_that_were_left_behind_do_not_become_another_take_s(sessions, take):
    save_notes(take.with_name("gone.mcap"), Notes((), "of a take long gone"))
    with pytest.raises(TakeError, match="Choose a name that is free"):
        rename_take(sessions, take, "gone")
    assert new_take_path(sessions, "S01", "gone", NOW).name == "gone-2.mcap"


def test_the_same_name_is_no_change(sessions, take, content):
    before = content(sessions)
    done = rename_take(sessions, take, "squeeze.v2")
    assert undo(sessions, done) == done.path == take
    assert content(sessions) == before


def test_where_the_old_name_is_taken_since_undo_finds_the_next_free(sessions, take, taken):
    done = rename_take(sessions, take, "other")
    taken(take)
    assert undo(sessions, done).name == "squeeze.v2-2.mcap"
    assert len(entries(sessions)) == 2


def test_a_name_cannot_be_taken_back_of_a_take_that_is_gone(sessions, take):
    done = rename_take(sessions, take, "other")
    done.path.unlink()
    with pytest.raises(TakeError, match="is not there"):
        undo(sessions, done)


@pytest.mark.parametrize("place", ["x.mcap", "S01/x.mcap", "S01/a/b/x.mcap", ".bin/a/x.mcap"])
def test_what_is_not_in_the_library_is_not_touched(sessions, written, place):
    path = written(sessions / place)
    for act in (lambda: rename_take(sessions, path, "y"), lambda: move_to_bin(sessions, path, NOW)):
        with pytest.raises(TakeError, match="is no take of the library"):
            act()
    assert path.exists()


@posix
def test_a_library_may_be_named_by_a_link_or_from_within(sessions, take, monkeypatch):
    link = sessions.parent / "link"
    link.symlink_to(sessions)
    done = rename_take(link, take, "by_link")
    assert done.path == link / "S01" / "2026-03-04" / "by_link.mcap"
    monkeypatch.chdir(sessions)
    assert rename_take(Path(), Path("S01/2026-03-04/by_link.mcap"), "within").path.exists()


def _leaves_a_name(text: str) -> bool:
    try:
        return bool(file_name(text, "take"))
    except TakeError:
        return False


# --- bin ------------------------------------------------------------------------------------------


def test_what_is_in_the_bin_is_no_longer_listed_and_comes_back_whole(sessions, take, content):
    before = content(sessions)
    done = move_to_bin(sessions, take, NOW)
    assert entries(sessions) == []
    assert list(take.parent.iterdir()) == [take.with_name("squeeze.v2.angles.csv")]
    (binned,) = list_bin(sessions)
    assert (binned.key, binned.origin) == ("20260304-123005-squeeze.v2", take)
    assert (binned.subject, binned.visit, binned.name) == ("S01", "2026-03-04", "squeeze.v2")
    assert binned.when == NOW
    assert load_notes(binned.path).text == "left hand"
    assert undo(sessions, done) == take
    assert content(sessions) == before


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25)
@given(st.permutations(range(4)), st.permutations(range(4)))
def test_the_bin_gives_back_everything_in_any_order(sessions, taken, content, put, back):
    paths = [
        sessions / subject / "day" / f"{name}.mcap"
        for subject in ("S01", "患者")
        for name in ("squeeze", "左手")
    ]
    for path in paths:
        if not path.exists():
            taken(path)
    before = content(sessions)
    keys = {number: move_to_bin(sessions, paths[number], NOW).key for number in put}
    assert entries(sessions) == []
    assert len(list_bin(sessions)) == len(set(keys.values())) == 4
    for number in back:
        assert restore(sessions, keys[number]) == paths[number]
    assert content(sessions) == before


@pytest.mark.parametrize("stem", ["手" * 80, "_", "CON", "é" * 100])
def test_a_take_somebody_named_by_hand_comes_back_too(sessions, written, stem):
    path = written(sessions / "S 01" / "day" / "x.mcap")
    path = path.rename(path.with_name(f"{stem}.mcap"))
    (entry,) = entries(sessions)
    assert undo(sessions, move_to_bin(sessions, entry.path, NOW)) == path
    assert undo(sessions, rename_take(sessions, path, "x")) == path


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names are always Unicode")
def test_a_name_that_is_no_unicode_is_refused_in_words(sessions, written):
    path = written(sessions / "S01" / "day" / "x.mcap")
    path = path.rename(path.with_name("odd\udcff.mcap"))
    with pytest.raises(TakeError, match="its name is no UTF-8"):
        move_to_bin(sessions, path, NOW)
    assert len(entries(sessions)) == 1


def test_where_its_place_is_taken_a_take_comes_back_beside_it(sessions, take, taken):
    key = move_to_bin(sessions, take, NOW).key
    taken(take)
    assert restore(sessions, key).name == "squeeze.v2-2.mcap"
    assert load_notes(take.with_name("squeeze.v2-2.mcap")).text == "left hand"


def test_a_take_comes_back_where_its_visit_is_gone(sessions, take):
    key = move_to_bin(sessions, take, NOW).key
    take.with_name("squeeze.v2.angles.csv").unlink()
    take.parent.rmdir()
    assert restore(sessions, key) == take


@pytest.mark.parametrize("key", ["", "nothing", "../S01", "/etc"])
def test_only_what_is_in_the_bin_comes_back(sessions, take, key):
    with pytest.raises(TakeError, match="is not in the bin"):
        restore(sessions, key)


def test_the_bin_is_emptied_of_what_is_old_or_of_all(sessions, written):
    day = sessions / "S01" / "day"
    for age in (0, 10, 40):
        move_to_bin(sessions, written(day / f"t{age}.mcap"), NOW - timedelta(days=age))
    assert empty_bin(sessions, NOW, older_than_days=30.0) == 1
    assert [binned.name for binned in list_bin(sessions)] == ["t0", "t10"]
    assert empty_bin(sessions, NOW) == 2
    assert list_bin(sessions) == []
    assert [path.name for path in sessions.iterdir()] == ["S01"]
    assert empty_bin(sessions, NOW) == 0


def test_a_recording_is_not_put_in_the_bin_but_what_is_left_of_one_is(sessions, header, content):
    path = sessions / "S01" / "day" / "cut.mcap"
    writer = TakeWriter(path, header)
    save_notes(path, Notes((), "while it is recorded"))
    cut = path.with_name(path.name + UNFINISHED)
    (entry,) = entries(sessions)
    assert entry.recording
    assert "is being recorded" in entry.problem
    for act in (
        lambda: rename_take(sessions, path, "y"),
        lambda: rename_take(sessions, cut, "y"),
        lambda: move_to_bin(sessions, path, NOW),
        lambda: move_to_bin(sessions, cut, NOW),
    ):
        with pytest.raises(TakeError):
            act()
    writer.abandon()
    before = content(sessions)
    (entry,) = entries(sessions, [entry])
    assert (entry.recording, entry.notes.text) == (False, "while it is recorded")
    done = move_to_bin(sessions, cut, NOW)
    assert not notes_path(path).exists()
    assert undo(sessions, done) == cut
    assert content(sessions) == before


# --- notes ----------------------------------------------------------------------------------------


def test_what_was_written_into_notes_is_taken_back(sessions, take):
    before = load_notes(take)
    done = edit_notes(take, Notes((Label(1.0, 2.0, "握る"),), "", (Mark(0.5, "here"),)))
    assert load_notes(take).marks == (Mark(0.5, "here"),)
    assert undo(sessions, done) == take
    assert load_notes(take) == before


def test_notes_are_not_taken_back_beside_a_take_that_is_gone(sessions, take):
    done = edit_notes(take, Notes())
    move_to_bin(sessions, take, NOW)
    with pytest.raises(TakeError, match="is not there"):
        undo(sessions, done)
    assert not notes_path(take).exists()


def test_notes_of_a_recording_may_be_taken_back(sessions, header):
    path = sessions / "S01" / "day" / "now.mcap"
    writer = TakeWriter(path, header)
    done = edit_notes(path, Notes((), "typed too soon"))
    undo(sessions, done)
    assert load_notes(path) == Notes()
    writer.discard()


# --- faults ---------------------------------------------------------------------------------------


def whole_takes(sessions: Path) -> list[tuple[str, int]]:
    """Each take there is, in the library and in the bin, and how much is beside it."""
    places = [*(e.path for e in entries(sessions)), *(b.path for b in list_bin(sessions))]
    return [(load_notes(path).text, len(belongings(path))) for path in places]


def renaming(sessions: Path, take: Path) -> None:
    rename_take(sessions, take, "other")


def binning(sessions: Path, take: Path) -> None:
    move_to_bin(sessions, take, NOW)


def renaming_back(sessions: Path, take: Path) -> None:
    undo(sessions, rename_take(sessions, take, "other"))


def restoring(sessions: Path, take: Path) -> None:
    restore(sessions, move_to_bin(sessions, take, NOW).key)


ACTS = [renaming, binning, renaming_back, restoring]


@pytest.mark.parametrize("act", ACTS)
def test_after_a_crash_at_any_step_the_take_is_whole_and_listed(
    tmp_path, taken, content, tripwire, act
):
    reached = 0
    for steps in IN_STEPS:
        sessions = tmp_path / str(steps)
        path = taken(sessions / "S01" / "day" / "squeeze.mcap")
        with tripwire(steps - 1, KeyboardInterrupt()) as wire:
            try:
                act(sessions, path)
            except KeyboardInterrupt:
                reached += 1
        assert whole_takes(sessions) == [("left hand", 6)], f"crashed at step {steps}"
        assert not (sessions / ".moves").exists()
        if not wire.tripped:
            break
    assert reached >= 8  # six files, and what is written down of them


@pytest.mark.parametrize("act", ACTS[:2])
@pytest.mark.parametrize("once", [True, False])
def test_a_disk_that_refuses_at_any_step_loses_nothing(
    tmp_path, taken, content, tripwire, *, act, once
):
    refused = 0
    for steps in IN_STEPS:
        sessions = tmp_path / str(steps)
        path = taken(sessions / "S01" / "day" / "squeeze.mcap")
        before = content(sessions)
        with tripwire(steps - 1, OSError(5, "Input/output error"), once) as wire:
            try:
                act(sessions, path)
            except TakeError as error:
                refused += 1
                said = error
                assert len(entries(sessions)) + len(list_bin(sessions)) >= 1  # lists all the same
        assert whole_takes(sessions) == [("left hand", 6)], f"refused at step {steps}"
        assert not (sessions / ".moves").exists()
        if once and refused == steps:
            assert content(sessions) == before
            assert "Nothing has changed" in said.remedy
        if not wire.tripped:
            break
    assert refused >= 7


@pytest.mark.parametrize("act", ACTS[:2])
def test_where_nothing_can_be_written_down_nothing_is_moved(sessions, take, content, act):
    (sessions / ".moves").write_text("in the way, as a disk without space is")
    before = content(sessions)
    with pytest.raises(TakeError, match=r"cannot be moved.*\n.*Nothing has changed"):
        act(sessions, take)
    assert content(sessions) == before
    assert len(entries(sessions)) == 1


@posix
@pytest.mark.skipif(hasattr(os, "geteuid") and os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_cannot_be_written_is_an_error_and_changes_nothing(sessions, take, content):
    before = content(sessions)
    take.parent.chmod(0o500)
    sessions.chmod(0o500)
    try:
        for act in ACTS[:2]:
            with pytest.raises(TakeError, match=r"cannot be moved.*\n.*permissions"):
                act(sessions, take)
        assert content(sessions) == before
    finally:
        take.parent.chmod(0o700)
        sessions.chmod(0o700)


@pytest.mark.parametrize("data", [b"", b"[", b"\xff", b'[{"source": "/etc/x", "target": "y"}]'])
def test_what_was_written_down_of_moves_and_is_damaged_is_no_danger(sessions, take, data):
    (sessions / ".moves").mkdir()
    (sessions / ".moves" / "x.json").write_bytes(data)
    assert len(entries(sessions)) == 1
    assert not (sessions / ".moves").exists()


def test_moves_do_not_lead_out_of_the_library(sessions, take):
    (sessions / ".moves").mkdir()
    told = b'[{"source": "S01/2026-03-04/squeeze.v2.mcap", "target": "S01/../../x.mcap"}]'
    (sessions / ".moves" / "x.json").write_bytes(told)
    assert [entry.path for entry in entries(sessions)] == [take]
