"""The library from the page: names, the bin, undo, notes, subjects, search."""

from __future__ import annotations

from pathlib import Path

import pytest

from app import intents
from app.studio import Studio
from app.takes.keeping import Keeper
from app.views import timeline
from handstudio.process import process
from handstudio.recording.notes import load_notes
from handstudio.recording.simulated import simulate
from handstudio.recording.take import open_take

from .conftest import after


@pytest.fixture
def taken(studio: Studio) -> Path:
    """One take, processed, open."""
    path = simulate(studio.state.sessions, seconds=3.0, code="S07", name="reach")
    process(open_take(path))
    studio.refresh_takes()
    assert after(studio, intents.OpenTake(path)).review is not None
    return path


def test_a_take_that_is_renamed_stays_open(studio: Studio, taken: Path) -> None:
    after(studio, intents.Seek(1.0))
    state = after(studio, intents.RenameTake(taken, "grasp"))
    assert state.review is not None
    assert state.review.take.path.stem == "grasp"
    assert state.review.at_s == 1.0
    assert [entry.name for entry in state.shelf.takes] == ["grasp"]
    state = after(studio, intents.Undo())
    assert [entry.name for entry in state.shelf.takes] == ["reach"]
    assert state.review is not None
    assert state.review.take.path == taken
    assert "reach" in state.messages[0].text


def test_a_take_in_the_bin_is_closed_and_comes_back(studio: Studio, taken: Path) -> None:
    state = after(studio, intents.BinTake(taken))
    assert state.review is None
    assert state.shelf.takes == ()
    assert [binned.name for binned in state.shelf.binned] == ["reach"]
    assert "reach" in state.shelf.undo
    state = after(studio, intents.Undo())
    assert [entry.path for entry in state.shelf.takes] == [taken]
    assert state.review is not None  # it was open when it went
    assert after(studio, intents.Undo()).messages == ()  # nothing more


def test_the_bin_is_emptied_for_good(studio: Studio, taken: Path) -> None:
    state = after(studio, intents.BinTake(taken), intents.EmptyBin())
    assert state.shelf.binned == ()
    assert state.shelf.undo == ""
    assert not list(studio.state.sessions.rglob("reach*"))


def test_words_marks_and_stretches_are_kept_and_taken_back(studio: Studio, taken: Path) -> None:
    after(studio, intents.SetNotes("left thumb hurts"), intents.Seek(1.0), intents.PutMark())
    after(studio, intents.MarkIn(), intents.Seek(2.0), intents.MarkOut())
    state = after(studio, intents.NamePart("pinch"))
    assert state.review is not None
    assert state.review.notes == load_notes(taken)
    assert [mark.at_s for mark in state.review.notes.marks] == [1.0]
    assert [(n.start_s, n.end_s, n.label) for n in state.review.notes.labels] == [
        (1.0, 2.0, "pinch")
    ]
    strip = timeline.as_html(state.review)
    assert "pinch 1.00-2.00 s" in strip
    state = after(studio, intents.Undo(), intents.Undo())
    assert state.review is not None
    assert state.review.notes.marks == ()
    assert state.review.notes.text == "left thumb hurts"


def test_the_keys_go_from_mark_to_mark(studio: Studio, taken: Path) -> None:
    for at_s in (0.5, 1.5):
        after(studio, intents.Seek(at_s), intents.PutMark())
    reached = []
    after(studio, intents.Seek(0.0))
    for forward in (True, True, True, False, False, False):
        state = after(studio, intents.GoToMark(forward=forward))
        assert state.review is not None
        reached.append(round(state.review.at_s, 2))
    assert reached[:2] == [0.5, 1.5]
    assert reached[2] == pytest.approx(3.0, abs=0.05)
    assert reached[3:] == [1.5, 0.5, 0.0]


def test_a_mark_goes_where_it_is_not_wanted(studio: Studio, taken: Path) -> None:
    after(studio, intents.Seek(1.0), intents.PutMark(), intents.RemoveMark(1.0))
    assert load_notes(taken).marks == ()


def test_the_list_shows_what_was_searched_for(studio: Studio, taken: Path) -> None:
    simulate(studio.state.sessions, seconds=3.0, code="S08", name="pour")
    studio.refresh_takes()
    state = after(studio, intents.Search("s08"))
    assert [entry.name for entry in state.shelf.found] == ["pour"]
    assert len(after(studio, intents.Search("")).shelf.found) == 2


def test_a_subject_goes_with_everything_or_not_at_all(studio: Studio, taken: Path) -> None:
    after(studio, intents.BinTake(taken), intents.Undo(), intents.OpenTake(taken))
    state = after(studio, intents.DeleteSubject("S07", "S70"))
    assert state.messages[0].alarm
    assert taken.exists()
    state = after(studio, intents.DeleteSubject("S07", "S07"))
    assert state.review is None
    assert state.shelf.subjects == ()
    assert not list(studio.state.sessions.rglob("*reach*"))
    assert state.shelf.undo == ""


def test_a_code_that_is_there_already_is_changed(studio: Studio) -> None:
    keeper = Keeper(studio.state.sessions)
    keeper.save_subject(intents.SaveSubject("S01", "right", 180.0))
    keeper.save_subject(intents.SaveSubject("S01", "left", 170.0))
    assert [(s.code, s.side, s.hand_length_mm) for s in keeper.shelf.subjects] == [
        ("S01", "left", 170.0)
    ]


def test_notes_that_cannot_be_read_do_not_hide_the_take(studio: Studio, taken: Path) -> None:
    taken.with_suffix(".notes.json").write_text("{broken", encoding="utf-8")
    state = after(studio, intents.ShowLive(), intents.OpenTake(taken))
    assert state.review is not None
    assert state.messages[0].alarm


def test_a_take_is_put_back_from_the_bin(studio: Studio, taken: Path) -> None:
    state = after(studio, intents.BinTake(taken))
    state = after(studio, intents.RestoreTake(state.shelf.binned[0].key))
    assert [entry.path for entry in state.shelf.takes] == [taken]
    assert state.shelf.undo == ""  # nothing is left to take back
