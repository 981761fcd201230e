"""The commands that keep the library do what they say, for persons and programs."""

from __future__ import annotations

from pathlib import Path

import pytest

from handstudio.recording.header import Header
from handstudio.recording.notes import Notes, save_notes
from handstudio.recording.simulated import simulate
from handstudio.recording.subjects import Subject, create_subject
from handstudio.recording.take import open_take
from handstudio.recording.writer import TakeWriter


@pytest.fixture(scope="session")
def bytes_of_a_take(tmp_path_factory) -> bytes:
    return simulate(tmp_path_factory.mktemp("one"), seconds=1.0).read_bytes()


@pytest.fixture
def sessions(tmp_path, bytes_of_a_take) -> Path:
    """Two subjects with a take each."""
    for subject, name in (("S01", "squeeze"), ("患者2", "握る")):
        path = tmp_path / subject / "2026-03-04" / f"{name}.mcap"
        path.parent.mkdir(parents=True)
        path.write_bytes(bytes_of_a_take)
        save_notes(path, Notes((), f"about {name}"))
    return tmp_path


@pytest.fixture(scope="session")
def header(bytes_of_a_take, tmp_path_factory) -> Header:
    """The header of a take."""
    path = tmp_path_factory.mktemp("header") / "x.mcap"
    path.write_bytes(bytes_of_a_take)
    return open_take(path).header


@pytest.fixture
def keep(here, sessions):
    """``keep("takes")``: the command, on these takes."""
    return lambda *arguments: here(*arguments, "--sessions", sessions)


@pytest.fixture
def names(keep):
    """``names("--search", "x")``: the takes there are."""
    return lambda *more: {row["name"] for row in keep("takes", "--json", *more).json}


def test_takes_are_listed_and_found(keep, names, sessions):
    assert names() == {"squeeze", "握る"}
    assert names("--search", "患者 about") == {"握る"}
    assert names("--search", "nothing") == set()
    (row,) = keep("takes", "--json", "--search", "squeeze").json
    assert row["path"] == str(sessions / "S01" / "2026-03-04" / "squeeze.mcap")
    assert (row["state"], row["problem"]) == ("ready", None)
    assert row["duration_s"] == 1.0
    assert row["notes"]["text"] == "about squeeze"
    said = keep("takes")
    assert said.code == 0
    for words in ("squeeze", "患者2", "握る", "1.0 s", "ready"):
        assert words in said.out


def test_what_cannot_be_opened_is_listed_with_what_it_is(keep, sessions, header):
    day = sessions / "S01" / "day"
    writer = TakeWriter(day / "now.mcap", header)
    TakeWriter(day / "cut.mcap", header).abandon()
    (day / "bad.mcap").write_bytes(b"")
    states = {row["name"]: row["state"] for row in keep("takes", "--json").json}
    assert states == {
        **{"squeeze": "ready", "握る": "ready"},
        **{"now": "recording", "cut": "interrupted", "bad": "damaged"},
    }
    writer.discard()


def test_a_take_gets_another_name(keep, names, sessions):
    take = sessions / "S01" / "2026-03-04" / "squeeze.mcap"
    said = keep("rename", take, "open hand")
    assert said.out == f"{take.with_name('open_hand.mcap')}\n"
    assert names() == {"open_hand", "握る"}
    said = keep("rename", take, "x")
    assert said.code == 1
    assert "is not there" in said.err


def test_takes_go_to_the_bin_and_come_back(keep, names, sessions):
    takes = list(sessions.glob("*/*/*.mcap"))
    said = keep("bin", *takes)
    assert said.code == 0
    assert said.out.count("handstudio restore '") == 2
    assert names() == set()
    binned = keep("bin", "--json").json
    assert {Path(row["origin"]) for row in binned} == set(takes)
    assert "握る" in keep("bin").out
    said = keep("restore", *(row["key"] for row in binned))
    assert set(said.out.splitlines()) == {str(take) for take in takes}
    assert names() == {"squeeze", "握る"}


def test_the_bin_is_emptied_when_asked(keep, names, sessions):
    take = sessions / "S01" / "2026-03-04" / "squeeze.mcap"
    (key,) = keep("bin", take, "--json").json
    assert keep("bin", take.with_name("x"), "--empty").code == 1
    assert keep("bin", "--empty", "--older-than-days", 1).out == "0 removed.\n"
    assert keep("bin", "--empty").out == "1 removed.\n"
    said = keep("restore", key)
    assert said.code == 1
    assert "is not in the bin" in said.err


def test_restore_wants_to_know_what(keep):
    said = keep("restore")
    assert said.code == 1
    assert "handstudio restore" in said.err


def test_subjects_are_listed(keep, sessions):
    create_subject(sessions, Subject("S03", "left", 171.0))
    rows = {row["subject"]["code"]: row for row in keep("subjects", "--json").json}
    assert {code: row["takes"] for code, row in rows.items()} == {"S01": 1, "S03": 0, "患者2": 1}
    assert rows["S03"]["subject"]["hand_length_mm"] == 171.0
    (sessions / "S03" / "subject.json").write_bytes(b"{")
    said = keep("subjects")
    assert said.code == 0
    for words in ("S01", "患者2", "cannot be read"):
        assert words in said.out


def test_a_subject_is_deleted_only_when_typed(keep, names, sessions):
    keep("bin", sessions / "S01" / "2026-03-04" / "squeeze.mcap")
    said = keep("delete-subject", "S01")
    assert said.code == 1
    assert "1 in the bin" in said.out
    assert "handstudio delete-subject 'S01' --typed 'S01'" in said.err
    said = keep("delete-subject", "S01", "--typed", "s01")
    assert said.code == 1
    assert "Type the code exactly" in said.err
    assert (sessions / "S01").exists()
    said = keep("delete-subject", "S01", "--typed", "S01")
    assert said.code == 0
    assert [path for path in sessions.rglob("*") if "S01" in path.name] == []
    assert names() == {"握る"}
