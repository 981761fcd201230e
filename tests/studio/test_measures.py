"""Measuring the open take on the page, and a report of it."""

from __future__ import annotations

import pytest

from app import intents
from app.shown.review import Review
from app.state import State
from app.studio import Studio
from app.views import measures as view
from handstudio.measure import measure
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import Take
from handstudio.settings import SettingsStore

from .conftest import after


@pytest.fixture
def opened(studio: Studio) -> Studio:
    """Two takes of one person, the later one open."""
    for seed in (1, 2):
        simulate(studio.state.sessions, rehearse(seed=seed), seconds=4.0, name=f"take {seed}")
    studio.refresh_takes()
    later = max(
        (entry for entry in studio.state.shelf.takes if entry.take is not None),
        key=lambda entry: entry.take.header.start_utc_ns,
    )
    after(studio, intents.OpenTake(later.path))
    studio.tick(0.1)
    assert studio.state.review is not None
    return studio


def reviewed(state: State) -> Review:
    assert state.review is not None
    return state.review


def test_a_part_is_measured_and_shown(opened: Studio) -> None:
    after(opened, intents.Seek(1.0), intents.MarkIn(), intents.MeasureHand())
    review = reviewed(opened.tick(0.1))
    assert review.measured is not None
    assert review.measured.visit.start_s == pytest.approx(1.0)
    html = view.short_html(review)
    assert "Index PIP flexion" in html
    assert "Another part counts now" not in html
    moved = reviewed(after(opened, intents.WholeTake()))
    assert "Another part counts now" in view.short_html(moved)


def test_an_earlier_take_of_the_hand_can_be_compared_with(opened: Studio) -> None:
    (words,) = view.earlier_takes(opened.state)
    assert words.endswith("take_1")
    after(opened, intents.CompareVisits(view.earlier_takes(opened.state)[words]))
    after(opened, intents.MeasureHand())
    review = reviewed(opened.tick(0.1))
    assert review.measured is not None
    assert review.measured.earlier is not None
    assert "no detectable change" in view.full_html(review.measured)
    assert reviewed(after(opened, intents.CompareVisits(None))).measured is None


def test_the_other_hand_can_be_compared_with(opened: Studio) -> None:
    assert view.other_hand(opened.state) == {}
    code = reviewed(opened.state).take.header.subject
    left = rehearse(seed=4, side="left")
    path = simulate(opened.state.sessions, left, seconds=4.0, code=code, name="left")
    opened.refresh_takes()
    (words,) = view.other_hand(opened.state)
    assert view.other_hand(opened.state)[words] == path
    after(opened, intents.CompareSides(path), intents.MeasureHand())
    review = reviewed(opened.tick(0.1))
    assert review.measured is not None
    assert "Of the other hand" in view.full_html(review.measured)
    assert "of the other hand" in view.short_html(review)
    assert reviewed(after(opened, intents.CompareSides(None))).measured is None


def test_a_report_comes_to_the_page_that_asked(opened: Studio) -> None:
    (download,) = after(opened, intents.MakeReport(7)).downloads
    assert download.page == 7
    assert download.name.endswith(".report.en.html")
    assert not isinstance(download.content, bytes)
    assert "Report of a hand" in download.content.read_text(encoding="utf-8")


def test_without_a_take_nothing_is_measured(studio: Studio) -> None:
    state = after(studio, intents.MeasureHand(), intents.MakeReport(1), intents.CompareVisits(None))
    assert state.review is None
    assert state.messages == ()
    assert view.earlier_takes(state) == {}


def test_rows_of_a_measured_take_are_told_with_their_reasons(take: Take, review: Review) -> None:
    html = view.full_html(measure(take))
    assert "needs a calibration of the hand" in html
    assert view.short_html(review) == ""


def test_postures_of_ones_own_are_counted_with_the_usual_ones_and_remembered(
    opened: Studio,
) -> None:
    after(opened, intents.MeasureHand())
    added = after(opened, intents.AddPosture("up", "wrist_flexion", "-5", ""))
    assert reviewed(added).measured is None  # it was measured without
    after(opened, intents.AddPosture("Index bent", "index_pip_flexion", "30", "90"))
    after(opened, intents.MeasureHand())
    review = reviewed(opened.tick(0.1))
    assert review.measured is not None
    counted = [one.about for one in review.measured.measures if one.kind == "time_in_posture"]
    assert counted[-2:] == ["up", "Index bent"]
    assert "wrist_flexed_15" in counted
    assert "Index bent" in view.full_html(review.measured)
    opened.store.flush()
    kept = SettingsStore.opened(opened.store.path).settings.postures
    assert [band.name for band in kept] == ["up", "Index bent"]
    assert view.own_postures(kept) == {
        "up: Wrist flexion above -5°": "up",
        "Index bent: Index PIP flexion 30 to 90°": "Index bent",
    }
    after(opened, intents.RemovePosture("up"))
    assert [band.name for band in opened.state.settings.postures] == ["Index bent"]


@pytest.mark.parametrize("ends", [("", ""), ("30", "10"), ("ten", ""), ("5", "5"), ("nan", "")])
def test_ends_that_are_none_are_refused_in_words(opened: Studio, ends: tuple[str, str]) -> None:
    state = after(opened, intents.AddPosture("up", "wrist_flexion", *ends))
    assert state.settings.postures == ()
    assert "no range of degrees" in state.messages[0].text
