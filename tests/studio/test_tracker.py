"""The tracker on the page: how it does, in words, and the live hand in its room."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app import intents
from app.devices.tracking import facts_of, with_tracker
from app.shown.review import Review
from app.state import State, Tracking
from app.studio import Studio
from app.views.page import HandView, scene_of
from app.views.tracker import tracker_words
from handstudio.device.following import RootNow, RootPhase
from handstudio.device.live_tracker import LiveNow
from handstudio.device.orders import Connect, Newest, Phase
from handstudio.device.tracker import TrackerNow, TrackerPhase
from handstudio.errors import CalibrationError, DeviceError
from handstudio.maths import so3
from handstudio.recording.tracker_message import TrackerFacts
from handstudio.trackers.late_faults import Fate
from tests.studio.conftest import StillCapture, after, recording

FACTS = TrackerFacts("lsl:room", "hand")
THERE = TrackerNow(FACTS, TrackerPhase.STREAMING, ("hand",), 100)
LOST = DeviceError("No stream called {name!r} was found.", "", name="x")
WHY = CalibrationError("It turned too little.", "Turn it.")


@pytest.mark.parametrize(
    ("tracker", "root", "said"),
    [
        (TrackerNow(FACTS), RootNow(), "Looking"),
        (TrackerNow(FACTS, problem=LOST), RootNow(), "No stream called 'x'"),
        (replace(THERE, phase=TrackerPhase.GONE), RootNow(), "Gone"),
        (replace(THERE, unseen=True), RootNow(), "Not seen"),
        (replace(THERE, frozen=True), RootNow(), "Frozen"),
        (THERE, RootNow(), "motion is waited for"),
        (THERE, RootNow(RootPhase.LOOKING, 4.0), "turn hand and forearm about"),
        (THERE, RootNow(RootPhase.LOOKING, 20.0, WHY), "It turned too little. Turn it."),
        (THERE, RootNow(RootPhase.FOLLOWING, sensor="SN4", delay_s=0.05, sd_m=2e-3), "on SN4, 50"),
        (THERE, RootNow(RootPhase.FOLLOWING, sensor="SN4"), "is not known now"),
        (THERE, RootNow(RootPhase.FOLLOWING, trouble=Fate.JUMPED), "Elsewhere"),
        (THERE, RootNow(RootPhase.FOLLOWING, trouble=Fate.MIRRORED), "Mirrored"),
        (THERE, RootNow(RootPhase.FOLLOWING, trouble=Fate.TURNED), "Turned"),
    ],
)
def test_how_a_tracker_does_is_said(
    studio: Studio, tracker: TrackerNow, root: RootNow, said: str
) -> None:
    state = replace(studio.state, tracker=Tracking(LiveNow(tracker, root)))
    assert said in tracker_words(state)
    assert tracker_words(studio.state) == ""


def test_the_live_hand_stands_where_the_tracker_sees_it(studio: Studio, review: Review) -> None:
    setup, motion = review.setup, review.motion[-1:]
    newest = Newest(Phase.STREAMING, "virtual:", setup=setup, motion=motion)
    state: State = replace(studio.state, newest=newest)
    before = scene_of(state)
    room = so3.normalize(np.array([0.3, 0.8, -0.4, 0.1]))
    first, now = np.array([1.0, 2.0, 3.0]), np.array([1.1, 2.0, 3.0])
    root = RootNow(RootPhase.FOLLOWING, setup=setup, t_room_elbow=now, q_room_world=room)
    tracking = Tracking(LiveNow(THERE, root), anchor=(first, room))
    after_it = scene_of(replace(state, tracker=tracking))
    assert isinstance(before, HandView)
    assert isinstance(after_it, HandView)
    moved = so3.rotate(so3.conjugate(room), np.array([0.1, 0.0, 0.0]))
    np.testing.assert_allclose(
        after_it.pose.t_world_joint, before.pose.t_world_joint + moved, atol=1e-9
    )
    np.testing.assert_allclose(
        np.abs(np.sum(after_it.pose.q_world_segment * before.pose.q_world_segment, axis=-1)), 1.0
    )


def test_only_the_virtual_glove_streams_the_virtual_tracker() -> None:
    pytest.importorskip("pylsl")
    address = with_tracker("virtual:?subject=7", "virtual:hand")
    assert address.startswith("virtual:?subject=7&tracker=hand&tracker-name=")
    assert with_tracker("serial:/dev/ttyACM0", "virtual:hand") == "serial:/dev/ttyACM0"
    assert with_tracker("virtual:", "lsl:room") == "virtual:"
    assert facts_of("", "", "") is None
    assert facts_of("lsl:room", "wrist", "SN4") == TrackerFacts("lsl:room", "wrist", "SN4")


def test_the_virtual_glove_does_not_begin_anew_for_its_tracker_while_a_take_is_on(
    streaming: Studio, capture: StillCapture, tmp_path: Path
) -> None:
    pytest.importorskip("pylsl")
    recording(capture, tmp_path / "take.mcap")
    streaming.tick(0.1)
    state = after(streaming, intents.ChooseTracker("virtual:hand"))
    assert "a take is on" in state.messages[0].text
    assert state.settings.tracker == ""
    assert not any(isinstance(order, Connect) for order in capture.orders)
