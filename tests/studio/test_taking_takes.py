"""Recording from the page: who, the count, marks, and what ends a take by itself."""

from __future__ import annotations

import shutil
from collections import namedtuple
from dataclasses import replace
from pathlib import Path

import pytest

from app import intents
from app.shown import taking
from app.shown.taking import BLIP_S
from app.sounds import Sound
from app.studio import Studio
from app.views import recording as recording_view
from handstudio.device.orders import Phase, StartTake, StopTake
from handstudio.recording.notes import load_notes

from .conftest import TICK_S, StillCapture, after, recording

Usage = namedtuple("Usage", "total used free")


def test_the_first_take_asks_whose_hand_it_is(studio: Studio, streaming: Studio) -> None:
    state = after(streaming, intents.ChooseSubject(""), intents.ToggleRecording(page=7))
    assert state.asking == 7
    assert state.countdown is None
    assert after(streaming).asking is None  # asked once


def test_who_was_typed_is_kept_and_recorded(streaming: Studio, capture: StillCapture) -> None:
    after(streaming, intents.SaveSubject("P7", "left", 171.0, then_record=True))
    order = capture.orders[-1]
    assert isinstance(order, StartTake)
    assert order.subject == "P7"
    subject = streaming.tick(TICK_S).subject
    assert subject is not None
    assert (subject.side, subject.hand_length_mm) == ("left", 171.0)


def test_who_types_fast_records_too(streaming: Studio, capture: StillCapture) -> None:
    after(streaming, intents.ChooseSubject(""), intents.ToggleRecording(page=7))
    after(streaming, intents.SaveSubject("P7", "left", 171.0, then_record=True))
    assert isinstance(capture.orders[-1], StartTake)


def test_a_hand_of_no_length_is_brought_to_one_there_is(streaming: Studio) -> None:
    state = after(streaming, intents.SaveSubject("P8", "right", 1000.0))
    assert state.hand_length_mm == 240.0


def test_record_asks_for_a_new_file_each_time(streaming: Studio, capture: StillCapture) -> None:
    after(streaming, intents.SetTakeName("reach"), intents.ToggleRecording())
    first = capture.orders[-1]
    assert isinstance(first, StartTake)
    assert first.path.name == "reach.mcap"
    first.path.parent.mkdir(parents=True, exist_ok=True)
    first.path.touch()
    streaming.tick(1.0)
    after(streaming, intents.ToggleRecording())
    second = capture.orders[-1]
    assert isinstance(second, StartTake)
    assert second.path.name == "reach-2.mcap"


def test_a_visit_that_is_named_is_a_folder(streaming: Studio, capture: StillCapture) -> None:
    after(streaming, intents.SetVisit("week 3"), intents.ToggleRecording())
    order = capture.orders[-1]
    assert isinstance(order, StartTake)
    assert order.path.parent.name == "week_3"


def test_a_name_of_nothing_is_explained_not_recorded(
    streaming: Studio, capture: StillCapture
) -> None:
    state = after(streaming, intents.SetTakeName("  /// "), intents.ToggleRecording())
    assert capture.orders == []
    assert state.messages[0].alarm
    assert "Type a name" in state.messages[0].remedy


def test_without_a_device_nothing_is_counted(studio: Studio) -> None:
    state = after(studio, intents.ToggleRecording())
    assert state.countdown is None
    assert "Device" in state.messages[0].remedy


def test_it_counts_ticks_and_begins(streaming: Studio, capture: StillCapture) -> None:
    after(streaming, intents.SetCountdown(2))
    streaming.send(intents.ToggleRecording())
    heard, shown = [], []
    for _ in range(30):
        state = streaming.tick(0.1)
        heard += state.sounds
        shown.append(state.countdown.shown if state.countdown else 0)
        if any(isinstance(order, StartTake) for order in capture.orders):
            break
    assert heard == [Sound.TICK, Sound.TICK, Sound.START]
    assert shown[0] == 2
    assert shown[-2:] == [1, 0]


def test_the_count_can_be_called_off(streaming: Studio, capture: StillCapture) -> None:
    after(streaming, intents.SetCountdown(3), intents.ToggleRecording())
    # the space bar also presses a button that has the focus: twice at once is once
    assert after(streaming, intents.GoOn(page=1)).countdown is not None
    streaming.tick(1.0)
    state = after(streaming, intents.GoOn(page=1))
    assert state.countdown is None
    for _ in range(50):
        streaming.tick(0.1)
    assert capture.orders == []


def test_a_device_that_goes_while_it_is_counted_begins_no_take(
    streaming: Studio, capture: StillCapture
) -> None:
    after(streaming, intents.SetCountdown(3), intents.ToggleRecording())
    capture.newest = replace(capture.newest, phase=Phase.LOST)
    assert streaming.tick(TICK_S).countdown is not None  # it may only be late
    state = streaming.tick(BLIP_S)
    assert state.countdown is None
    assert state.messages[0].alarm
    assert capture.orders == []


def test_a_device_that_is_late_is_waited_for(streaming: Studio, capture: StillCapture) -> None:
    capture.newest = replace(capture.newest, phase=Phase.LOST)
    streaming.tick(TICK_S)
    state = after(streaming, intents.SetCountdown(0), intents.ToggleRecording())
    assert state.countdown is not None
    assert state.messages == ()
    assert streaming.tick(0.5).countdown is not None
    assert capture.orders == []
    capture.newest = replace(capture.newest, phase=Phase.STREAMING)
    assert streaming.tick(TICK_S).countdown is None
    assert isinstance(capture.orders[-1], StartTake)


def test_space_ends_the_take_that_is_on(
    streaming: Studio, capture: StillCapture, tmp_path: Path
) -> None:
    recording(capture, tmp_path / "S01" / "day" / "take.mcap")
    streaming.tick(TICK_S)
    state = after(streaming, intents.GoOn(page=1))
    assert isinstance(capture.orders[-1], StopTake)
    assert state.sounds == (Sound.STOP,)


def test_marks_are_written_while_the_take_is_on(
    streaming: Studio, capture: StillCapture, tmp_path: Path
) -> None:
    recorder = recording(capture, tmp_path / "S01" / "day" / "take.mcap")
    motion = capture.newest.motion
    assert motion is not None
    recorder.first_us = int(motion.time_us[-1]) - 2_500_000
    streaming.tick(TICK_S)
    state = after(streaming, intents.PutMark("here"), intents.PutMark())
    assert state.marks == 2
    assert state.sounds == (Sound.MARK, Sound.MARK)
    notes = load_notes(recorder.path)
    assert [mark.at_s for mark in notes.marks] == [pytest.approx(2.5)] * 2


def test_silence_is_kept_where_it_is_wanted(streaming: Studio, capture: StillCapture) -> None:
    state = after(streaming, intents.SetSounds(on=False), intents.ToggleRecording())
    assert state.sounds == ()


def test_the_last_page_that_stays_closed_ends_the_take(
    streaming: Studio, capture: StillCapture, tmp_path: Path
) -> None:
    recording(capture, tmp_path / "S01" / "day" / "take.mcap")
    after(streaming, intents.PagesOpen(0))
    streaming.tick(taking.ALONE_LIMIT_S - 1.0)
    assert capture.orders == []
    state = streaming.tick(2.0)
    assert isinstance(capture.orders[-1], StopTake)
    assert "no page" in state.messages[0].text


def test_a_full_disk_is_warned_of_and_ends_the_take(
    streaming: Studio, capture: StillCapture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording(capture, tmp_path / "S01" / "day" / "take.mcap")
    free = [300_000_000]
    monkeypatch.setattr(shutil, "disk_usage", lambda _place: Usage(1, 1, free[0]))
    warned = streaming.tick(5.0)
    assert "getting full: 300 MB left" in warned.messages[0].text
    assert streaming.tick(5.0).messages == ()  # said once
    assert capture.orders == []
    free[0] = 20_000_000
    ended = streaming.tick(5.0)
    assert "is full: 20 MB left" in ended.messages[0].text
    assert isinstance(capture.orders[-1], StopTake)


def test_no_take_begins_on_a_full_disk(
    streaming: Studio, capture: StillCapture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _place: Usage(1, 1, 1_000_000))
    streaming.tick(5.0)
    state = after(streaming, intents.ToggleRecording())
    assert "is full" in state.messages[0].text
    assert capture.orders == []


def test_the_sheet_says_how_the_take_stands(
    streaming: Studio, capture: StillCapture, tmp_path: Path
) -> None:
    assert recording_view.sheet_of(streaming.tick(TICK_S)) == ""
    recording(capture, tmp_path / "S01" / "day" / "take.mcap")
    sheet = recording_view.sheet_of(streaming.tick(TICK_S))
    for words in ("0:12.3", "take · S01", "1.0 MB", "Trust: hand length only", "free"):
        assert words in sheet
    capture.newest = replace(capture.newest, phase=Phase.LOST)
    assert "Trust: interrupted" in recording_view.sheet_of(streaming.tick(TICK_S))
