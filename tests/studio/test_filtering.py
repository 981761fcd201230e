"""Which filter is live, and when it changes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from app import intents
from app.devices.filtering import wanted_of
from app.studio import Studio
from app.views.filters import filter_words, preparing_of
from handstudio.device.orders import SetFilter
from handstudio.layout import Layout, SensorPlace
from handstudio.setup import FILTERS

from .conftest import TICK_S, StillCapture, after, recording


@dataclass
class Slow:
    """A preparation that is done when a test says so."""

    ready: bool = False
    failed: bool = False


def _told(capture: StillCapture) -> list[str]:
    filters = [order.filter for order in capture.orders if isinstance(order, SetFilter)]
    return [name for chosen in filters for name, known in FILTERS.items() if known == chosen]


def test_without_a_preparation_nothing_changes_by_itself(
    streaming: Studio, capture: StillCapture
) -> None:
    state = after(streaming, intents.SetFilter("tree"))
    assert _told(capture) == []
    assert preparing_of(state) == ""


def test_the_whole_hand_filter_comes_once_it_is_ready(
    streaming: Studio, capture: StillCapture
) -> None:
    preparation = Slow()
    streaming.prepare(preparation)
    assert "Preparing" in preparing_of(streaming.tick(TICK_S))
    assert _told(capture) == []
    preparation.ready = True
    assert preparing_of(streaming.tick(TICK_S)) == ""
    streaming.tick(TICK_S)
    assert _told(capture) == ["tree"]


def test_it_does_not_come_into_a_take(
    streaming: Studio, capture: StillCapture, tmp_path: Path
) -> None:
    streaming.prepare(Slow(ready=True))
    recording(capture, tmp_path / "take.mcap")
    streaming.tick(TICK_S)
    assert _told(capture) == []
    capture.newest = replace(capture.newest, recorder=None)
    streaming.tick(TICK_S)
    assert _told(capture) == ["tree"]


def test_the_one_that_was_chosen_is_used_at_once_and_kept(
    streaming: Studio, capture: StillCapture
) -> None:
    streaming.prepare(Slow())
    state = after(streaming, intents.SetFilter("raw"))
    assert _told(capture) == ["raw"]
    assert state.settings.filter == wanted_of(state) == "raw"
    assert after(streaming, intents.SetFilter("tree")).preparing == "yes"
    assert _told(capture) == ["raw", "vqf"], "until the tree is ready"


def test_sensors_on_no_hand_are_fused_each_by_itself(
    streaming: Studio, capture: StillCapture
) -> None:
    setup = capture.newest.setup
    assert setup is not None
    pair = Layout("unknown", (SensorPlace("A", "a"), SensorPlace("B", "b")), ())
    other = msgspec.structs.replace(setup, layout=pair)
    capture.newest = replace(capture.newest, setup=other, motion=None)
    streaming.prepare(Slow(ready=True))
    assert wanted_of(streaming.tick(TICK_S)) == "vqf"
    assert _told(capture) == []


def test_a_preparation_that_fails_is_said(streaming: Studio) -> None:
    streaming.prepare(Slow(failed=True))
    assert "cannot be prepared" in preparing_of(streaming.tick(TICK_S))


def test_every_filter_has_words() -> None:
    assert list(filter_words()) == list(FILTERS)
    assert len(set(filter_words().values())) == len(FILTERS)
