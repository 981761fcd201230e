"""What the studio makes of intents and reports, without a page and without a device."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest

from app import intents
from app.studio import Studio
from app.views import page as view
from app.views.formats import contents, offered
from handstudio.device.orders import Ask, Connect, Newest, Phase, TakeDone
from handstudio.errors import DeviceError
from handstudio.export.formats import FORMATS
from handstudio.layout import Layout, SensorPlace, glove
from handstudio.process import process
from handstudio.recording.simulated import simulate
from handstudio.recording.take import Take

from .conftest import StillCapture, after


def test_blink_names_the_sensor_and_three_seconds(studio: Studio, capture: StillCapture) -> None:
    after(studio, intents.BlinkSensor("SN17"))
    assert capture.orders == [Ask(0x84, bytes([17, 0xB8, 0x0B]))]


def test_a_take_that_is_done_is_in_the_list_and_open(studio: Studio, capture: StillCapture) -> None:
    path = simulate(studio.state.sessions, seconds=3.0)
    capture.waiting.append(TakeDone(path))
    state = studio.tick(0.016)
    assert [entry.path for entry in state.shelf.takes] == [path]
    state = studio.tick(0.016)
    assert state.review is not None
    assert state.review.take.path == path
    assert "Replay" in view.caption_of(state)


def test_export_writes_the_file_and_sends_it_to_the_page_that_asked(studio: Studio) -> None:
    path = simulate(studio.state.sessions, seconds=3.0)
    after(studio, intents.OpenTake(path))
    state = after(studio, intents.Export("angles", page=5))
    assert [download.page for download in state.downloads] == [5]
    assert state.downloads[0].content.read_bytes().startswith(b'"time_s"')


def test_every_format_is_written_beside_the_take_and_sent(studio: Studio) -> None:
    path = simulate(studio.state.sessions, seconds=3.0)
    after(studio, intents.OpenTake(path))
    for name in ("glb", "mcap"):
        state = after(studio, intents.Export(None, page=5, format=name))
        (download,) = state.downloads
        assert download.content.parent == path.parent
        assert download.name.endswith(f".{name}")
        assert download.content.with_name(download.name + ".json").exists()
    studio.refresh_takes()
    assert [entry.path for entry in studio.state.shelf.takes] == [path]


def test_what_cannot_become_a_format_is_not_offered() -> None:
    hand, door = glove("left"), Layout("unknown", (SensorPlace("SN1", "leaf"),), ())
    assert [each.name for each in offered(hand).values()] == list(FORMATS)
    assert [each.name for each in offered(door).values()] == ["csv", "parquet", "sto", "mcap"]
    table = FORMATS["csv"]
    assert list(contents(table, hand).values()) == list(table.contents)
    assert list(contents(table, door).values()) == ["orientations"]
    assert contents(FORMATS["c3d"], hand) == {}


def test_export_holds_exactly_the_part_that_counts(studio: Studio) -> None:
    path = simulate(studio.state.sessions, seconds=4.0)
    after(studio, intents.OpenTake(path))
    after(studio, intents.Seek(1.0), intents.MarkIn())
    state = after(studio, intents.Seek(2.5), intents.MarkOut(), intents.Export("angles", page=1))
    rows = state.downloads[0].content.read_text(encoding="utf-8").splitlines()[1:]
    times = [float(row.split(",")[0]) for row in rows]
    assert times[0] == pytest.approx(1.0, abs=0.006)
    assert times[-1] == pytest.approx(2.5, abs=0.006)


def test_a_damaged_take_is_explained_and_the_studio_goes_on(studio: Studio) -> None:
    path = simulate(studio.state.sessions, seconds=3.0)
    path.write_bytes(path.read_bytes()[:5000])
    state = after(studio, intents.OpenTake(path))
    assert "handstudio recover" in state.messages[0].remedy
    assert after(studio, intents.SetTakeName("next")).settings.take_name == "next"


def test_what_the_capture_reports_is_said_once(studio: Studio, capture: StillCapture) -> None:
    capture.waiting.append(DeviceError("It is gone.", "Plug it in."))
    assert [m.text for m in studio.tick(0.016).messages] == ["It is gone."]
    assert studio.tick(0.016).messages == ()


def test_looking_for_devices_ends_and_always_offers_the_virtual_glove(studio: Studio) -> None:
    studio.send(intents.FindDevices())
    studio.state = replace(studio.state, devices=())
    deadline = time.monotonic() + 20.0
    while "virtual:" not in [found.address for found in studio.tick(0.016).devices]:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    assert not studio.state.searching


def test_connecting_leaves_the_take(studio: Studio, capture: StillCapture, take: Take) -> None:
    process(take)
    state = after(studio, intents.OpenTake(take.path))
    assert state.review is not None
    state = after(studio, intents.ConnectDevice("virtual:"))
    assert state.review is None
    assert isinstance(capture.orders[-1], Connect)


@pytest.mark.parametrize("phase", list(Phase))
def test_every_phase_has_a_word(studio: Studio, capture: StillCapture, phase: Phase) -> None:
    capture.newest = Newest(phase, "serial:/dev/ttyACM0")
    status = view.status_of(studio.tick(0.016))
    assert status.word
    assert status.alarm == (phase in (Phase.LOST, Phase.FAILED))
