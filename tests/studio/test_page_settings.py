"""What is chosen on the page: kept, spoken, shown; and the view of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from app import intents, words
from app.shown.look import ABOVE_SHEET, FIELD_RAD, View, camera_for
from app.shown.review import Review
from app.state import State
from app.studio import Studio
from app.views import calibration as calibration_view
from app.views import health as health_view
from app.views.page import HandView, camera_of, overlay_of, scene_of, status_of
from app.views.room import stand_of, standing
from app.work.jobs import Jobs
from handstudio.device.capture import Capture
from handstudio.device.orders import Newest, Phase
from handstudio.health.findings import PER_SENSOR, Finding, Kind
from handstudio.settings import SettingsStore

from .conftest import TICK_S, StillCapture, after


@pytest.fixture(autouse=True)
def _english_again() -> object:
    yield
    words.use_language("en")


def test_choices_survive_a_restart(studio: Studio, capture: StillCapture, tmp_path: Path) -> None:
    after(
        studio,
        intents.SetTheme(dark=False),
        intents.SetView(View.FOLLOW),
        intents.ToggleShown("axes"),
        intents.SetTakeName("pinch"),
        intents.SetLanguage("ja"),
        intents.ConnectDevice("tcp:1.2.3.4:5"),
    )
    studio.store.flush()
    store = SettingsStore.opened(tmp_path / "settings.json")
    again = Studio(cast("Capture", capture), cast("Jobs", None), store, State(tmp_path))
    settings = again.state.settings
    assert (settings.theme, settings.take_name) == ("light", "pinch")
    assert settings.shown.axes
    assert settings.last_address == "tcp:1.2.3.4:5"
    assert again.state.view is View.FOLLOW
    assert again.state.language == "ja"


def test_settings_that_are_broken_are_told_and_the_studio_starts(
    capture: StillCapture, tmp_path: Path
) -> None:
    path = tmp_path / "settings.json"
    path.write_text("{broken", encoding="utf-8")
    studio = Studio(
        cast("Capture", capture),
        cast("Jobs", None),
        SettingsStore.opened(path),
        State(tmp_path),
        "en",
    )
    assert "damaged" in studio.tick(TICK_S).messages[0].text


def test_the_language_is_the_one_chosen_else_the_pages_else_the_systems(
    capture: StillCapture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LC_ALL", "ja_JP.UTF-8")
    store = SettingsStore.opened(tmp_path / "settings.json")
    studio = Studio(cast("Capture", capture), cast("Jobs", None), store, State(tmp_path))
    assert studio.state.language == "ja"
    assert after(studio, intents.PagesOpen(1, ("en-GB", "ja"))).language == "en"
    assert after(studio, intents.PagesOpen(2, ("fr", "ja-JP"))).language == "ja"
    assert status_of(studio.state).word == "機器なし"
    assert after(studio, intents.SetLanguage("en")).language == "en"
    assert after(studio, intents.PagesOpen(2, ("ja",))).language == "en"


def test_the_language_asked_for_at_the_start_holds_until_another_is_chosen(
    studio: Studio,
) -> None:
    assert after(studio, intents.PagesOpen(1, ("ja",))).language == "en"
    assert after(studio, intents.SetLanguage("ja")).language == "ja"


@pytest.mark.parametrize("view", list(View))
def test_every_view_sees_the_whole_hand(review: Review, view: View, studio: Studio) -> None:
    shown = scene_of(replace(studio.state, review=review))
    assert isinstance(shown, HandView)
    camera = camera_for(view, shown.skeleton, shown.pose)
    distance = float(((camera.place - camera.target) ** 2).sum() ** 0.5)
    assert 0.25 < distance < 0.8
    assert abs(float((camera.up**2).sum()) - 1.0) < 1e-9


def test_an_open_takes_hand_stands_clear_of_the_sheet_below(review: Review, studio: Studio) -> None:
    state = replace(studio.state, review=review)
    shown = scene_of(state)
    assert isinstance(shown, HandView)
    for view in View:
        camera = camera_of(replace(state, view=view), shown)
        before = camera_for(view, shown.skeleton, standing(shown.pose, stand_of(state)))
        ahead = (camera.target - camera.place) / np.linalg.norm(camera.target - camera.place)
        towards = before.target - camera.place
        up = float(towards @ camera.up) - float(towards @ ahead) * float(ahead @ camera.up)
        up /= float(np.sqrt(1.0 - (ahead @ camera.up) ** 2))
        share = up / float(towards @ ahead) / (2.0 * np.tan(FIELD_RAD / 2))
        assert share == pytest.approx(ABOVE_SHEET)


def test_palm_and_back_are_opposite_and_the_thumb_is_at_the_side(
    review: Review, studio: Studio
) -> None:
    shown = scene_of(replace(studio.state, review=review))
    assert isinstance(shown, HandView)
    palm, back, thumb = (
        camera_for(view, shown.skeleton, shown.pose) for view in (View.PALM, View.BACK, View.THUMB)
    )
    assert palm.place - palm.target == pytest.approx(-(back.place - back.target))
    assert (thumb.place - thumb.target) @ (back.place - back.target) == pytest.approx(0.0, abs=1e-9)
    # the thumb's tip is nearer to the camera at its side than the little finger's
    tips = shown.pose.t_world_tip
    away = ((tips - thumb.place) ** 2).sum(axis=1)
    assert away[0] < away[4]


@pytest.mark.parametrize("kind", list(Kind))
def test_every_finding_says_what_it_is_and_what_to_do(kind: Kind) -> None:
    sensors = (0, 2) if kind in PER_SENSOR else ()
    advice = health_view.advice_of(Finding(kind, "act", sensors, 12.34, 5.0, 1.0), ("A", "B", "C"))
    assert advice.title
    assert advice.remedy.endswith(".")
    assert "12.3" in advice.figure
    assert ("A, C" in advice.title) == bool(sensors)


def test_what_must_be_acted_on_is_in_the_status_line(
    streaming: Studio, capture: StillCapture
) -> None:
    note = Finding(Kind.MAGNETIC, "note", (3,), 20.0, 15.0, 0.0)
    act = Finding(Kind.SILENT, "act", (4,), 100.0, 50.0, 0.0)
    capture.newest = replace(capture.newest, findings=(note,))
    assert not status_of(streaming.tick(TICK_S)).alarm
    capture.newest = replace(capture.newest, findings=(note, act))
    status = status_of(streaming.tick(TICK_S))
    assert status.alarm
    assert "SN5" in status.advice
    sheet = health_view.as_html(streaming.state)
    assert sheet.index("SN5") < sheet.index("SN4")  # what must be acted on comes first


def test_more_than_one_page_is_said(streaming: Studio) -> None:
    assert "pages" not in status_of(after(streaming, intents.PagesOpen(1))).advice
    assert "2 pages are open" in status_of(after(streaming, intents.PagesOpen(2))).advice


def test_a_page_that_is_late_is_told(streaming: Studio) -> None:
    assert "This page is late" not in health_view.as_html(after(streaming, intents.PageShown(40.0)))
    assert "This page is late" in health_view.as_html(after(streaming, intents.PageShown(400.0)))


@pytest.mark.parametrize("phase", list(Phase))
def test_where_there_is_no_hand_the_picture_says_why(
    studio: Studio, capture: StillCapture, phase: Phase
) -> None:
    capture.newest = Newest(phase, "virtual:")
    assert overlay_of(studio.tick(TICK_S))


def test_the_steps_of_calibration_tell_what_is_missing(
    studio: Studio, streaming: Studio, capture: StillCapture
) -> None:
    stands = [step.stand for step in calibration_view.steps_of(streaming.tick(TICK_S))]
    assert stands == ["done", "done", "done", "open", "open"]
    motion = capture.newest.motion
    assert motion is not None
    doubt = motion.doubt.copy()
    doubt[0, 4] = 1
    capture.newest = replace(capture.newest, motion=replace(motion, doubt=doubt))
    rest = calibration_view.steps_of(streaming.tick(TICK_S))[1]
    assert (rest.stand, rest.figure) == ("now", "19 of 20 sensors placed")
    assert "SN5" in rest.advice
