"""The window of time that all plots show, what they show, and parts that become takes."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app import intents
from app.shown import review as reviewing
from app.shown.channels import SIGNALS, SPEEDS, plots_of, sets_of, values_of
from app.shown.comparison import OF_TAKE
from app.shown.review import Review
from app.shown.review import opened as opened_review
from app.state import State
from app.studio import Studio
from app.views import lane, timeline
from app.views.page import caption_of, curves_of
from app.work.jobs import Stopped
from handstudio.analysis.grasps import GraspSegment, Recognised
from handstudio.analysis.pen_tip import Plane
from handstudio.analysis.stretches import Stretch
from handstudio.analysis.take_grasps import TakenGrasp
from handstudio.analysis.writing import Writing
from handstudio.arrays import Array
from handstudio.errors import HandstudioError
from handstudio.finds import Found
from handstudio.process import kept_motion, process, process_head
from handstudio.recording.notes import with_mark
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.recording.take_track import track_path
from handstudio.setup import Setup

from .conftest import TICK_S, StillCapture, after


def window(review: Review) -> tuple[float, float]:
    assert review.seen.time_s[0] == pytest.approx(review.from_s, abs=0.011)
    assert review.seen.time_s[-1] == pytest.approx(review.to_s, abs=0.011)
    return round(review.from_s, 6), round(review.to_s, 6)


def test_zooming_keeps_the_playhead_where_it_is(review: Review) -> None:
    there = reviewing.sought(review, 6.0)
    near = reviewing.zoomed(there, 4.0)
    assert window(near) == (4.5, 6.5)
    assert len(near.seen.time_s) == pytest.approx(201, abs=1)
    assert window(reviewing.zoomed(near, 0.25)) == window(review)
    closest = reviewing.zoomed(near, 1e6)
    assert closest.to_s - closest.from_s == pytest.approx(0.2)


def test_panning_ends_at_the_ends_of_the_take(review: Review) -> None:
    near = reviewing.zoomed(review, 4.0)
    assert window(near) == (0.0, 2.0)
    assert window(reviewing.panned(near, 0.5)) == (1.0, 3.0)
    assert window(reviewing.panned(near, -0.5)) == (0.0, 2.0)
    assert window(reviewing.panned(near, 100.0)) == (6.0, 8.0)


def test_the_part_fills_the_plots_and_the_whole_again(review: Review) -> None:
    part = reviewing.marked_out(
        reviewing.sought(reviewing.marked_in(reviewing.sought(review, 2.0)), 3.0)
    )
    near = reviewing.fitted(part)
    assert window(near) == (2.0, 3.0)
    assert window(reviewing.fitted(near)) == window(review)


def test_the_plots_turn_over_as_the_take_plays(review: Review) -> None:
    near = replace(reviewing.zoomed(review, 4.0), playing=True)
    assert window(reviewing.advanced(near, 1.9)) == (0.0, 2.0)
    turned = reviewing.advanced(near, 2.5)
    assert window(turned) == (2.3, 4.3)
    assert window(reviewing.sought(turned, 0.0)) == (0.0, 2.0)


def test_every_angle_that_is_measured_can_be_plotted(review: Review) -> None:
    layout = review.setup.layout
    for name in sets_of(layout):
        if name not in (SPEEDS, SIGNALS):
            count = sum(len(plot.curves) for plot in plots_of(layout, name))
            assert values_of(review.setup, review.motion[:3], name).shape == (3, count)
    shown = {
        (plot.title, curve.label)
        for name in ("thumb", "index", "middle", "ring", "little", "wrist")
        for plot in plots_of(layout, name)
        for curve in plot.curves
    }
    assert len(shown) == len(values_of(review.setup, review.motion[:1], "wrist")[0]) + 5 + 4 * 5


def opened(studio: Studio, path: Path) -> Review:
    after(studio, intents.OpenTake(path))
    for _ in range(3):
        studio.tick(TICK_S)
    assert studio.state.review is not None
    return studio.state.review


@pytest.fixture
def path(studio: Studio) -> Path:
    taken: Path = simulate(studio.state.sessions, rehearse(seed=3), seconds=6.0)
    studio.refresh_takes()
    return taken


def test_speeds_are_the_slopes_of_the_angles(studio: Studio, path: Path) -> None:
    opened(studio, path)
    angles = after(studio, intents.ChooseCurves("overview")).review
    speeds = after(studio, intents.ChooseCurves(SPEEDS)).review
    assert angles is not None
    assert speeds is not None
    time_s, values = angles.seen.time_s, angles.seen.values
    slopes = np.gradient(values, time_s, axis=0)
    np.testing.assert_allclose(speeds.seen.values[1:-1], slopes[1:-1], atol=1e-6)
    curves = curves_of(studio.state)
    assert curves is not None
    assert {plot.unit for plot in curves.plots} == {"°/s"}
    assert curves.sds is None


def test_signals_are_what_the_sensor_told(studio: Studio, path: Path) -> None:
    opened(studio, path)
    after(studio, intents.ChooseCurves(SIGNALS, "SN7"))
    studio.tick(TICK_S)
    review = studio.state.review
    assert review is not None
    runs, values = open_take(path).runs(), review.seen.values
    acc = np.concatenate([run.acc[:, 6] for run in runs])
    gyr = np.concatenate([run.gyr[:, 6] for run in runs])
    np.testing.assert_allclose(values[:, 3:6], acc, rtol=1e-6)
    np.testing.assert_allclose(values[:, :3], np.rad2deg(gyr), rtol=1e-6)
    curves = curves_of(studio.state)
    assert curves is not None
    assert [plot.unit for plot in curves.plots] == ["°/s", "m/s²", "µT"]
    assert curves.sensor == "SN7"


def test_live_plots_follow_the_choice_as_far_as_they_can(
    streaming: Studio, capture: StillCapture, review: Review
) -> None:
    after(streaming, intents.ChooseCurves("index"))
    capture.motions = [review.motion[:100]]
    curves = curves_of(streaming.tick(TICK_S))
    assert curves is not None
    assert curves.chosen == "index"
    assert len(curves.plots) == curves.values.shape[1]
    after(streaming, intents.ChooseCurves(SPEEDS))
    capture.motions = [review.motion[100:200]]
    live = curves_of(streaming.tick(TICK_S))
    assert live is not None
    assert live.chosen == "overview"


def test_a_part_becomes_a_take_of_the_library(studio: Studio, path: Path) -> None:
    opened(studio, path)
    after(studio, intents.Seek(1.0), intents.MarkIn(), intents.Seek(2.5), intents.MarkOut())
    state = after(studio, intents.TrimTake("reach"))
    assert any("reach" in message.text for message in state.messages)
    (entry,) = (entry for entry in state.shelf.takes if entry.name == "reach")
    motion = process(open_take(entry.path))
    assert len(motion) == 151
    np.testing.assert_array_equal(
        motion.q_world_sensor, process(open_take(path)).q_world_sensor[100:251]
    )


def test_two_takes_are_laid_over_each_other(studio: Studio, path: Path) -> None:
    other = simulate(studio.state.sessions, rehearse(seed=3), seconds=5.0, name="other")
    studio.refresh_takes()
    opened(studio, path)
    after(studio, intents.Compare(f"{OF_TAKE}{other}"))
    state = studio.tick(TICK_S)
    review = state.review
    assert review is not None
    assert review.comparison is not None
    assert "other" in caption_of(state)
    at_once = np.nanmax(review.seen.rms)  # the same performance, but for its length
    later = after(studio, intents.ShiftComparison(1.0)).review
    assert later is not None
    assert np.nanmax(later.seen.rms) > at_once + 5.0
    assert later.comparison is not None
    np.testing.assert_array_equal(
        later.comparison.at(2.0).time_us, later.comparison.motion.time_us[100:101]
    )


def test_the_first_seconds_are_there_before_the_rest(
    studio: Studio, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    take = open_take(path)
    order: list[object] = []
    monkeypatch.setattr(studio._workshop, "compute", order.append)
    after(studio, intents.OpenTake(path))
    for _ in range(200):
        state = studio.tick(TICK_S)
        if state.review is not None:
            break
        studio._workshop._aside.submit(int).result()
    assert order == [take]
    assert kept_motion(take) is None
    assert state.review is not None
    assert state.review.partial
    assert "first seconds" in caption_of(state)
    after(studio, intents.Seek(1.5))
    motion = process(take)
    studio._opening._computed(take)
    review = studio.state.review
    assert review is not None
    assert not review.partial
    assert (review.at_s, len(review.motion)) == (1.5, len(motion))


def test_a_rest_that_was_cancelled_is_no_longer_promised_and_can_be_had(
    studio: Studio, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    take, jobs = open_take(path), studio._workshop.jobs
    running: list[Future[None]] = []

    def wait(_path: Path, _setup: Setup | None = None) -> Future[None]:
        running.append(Future())
        return running[-1]

    with monkeypatch.context() as patched:
        patched.setattr(jobs, "process", wait)
        state = until(studio, intents.OpenTake(path), lambda state: state.review is not None)
        assert "is being computed" in caption_of(state)
        running[0].set_exception(Stopped("It was stopped.", "Nothing was changed."))
        state = until(studio, intents.Seek(0.5), lambda state: state.work is None)
        assert state.review is not None
        assert state.review.rest == "missing"
        assert "is not computed" in caption_of(state)
        assert "is not computed" in timeline.as_html(state.review)
        assert "is being computed" in caption_of(after(studio, intents.ComputeRest()))
        running[1].set_exception(HandstudioError("The job was killed.", "Try again."))
        state = studio.tick(TICK_S)
        assert state.messages[0].alarm
        assert "is not computed" in caption_of(state)
    state = until(studio, intents.ComputeRest(), lambda state: state.work is None)
    assert state.review is not None
    assert state.review.rest == "here"
    assert (state.review.at_s, len(state.review.motion)) == (0.5, len(process(take)))


def test_an_export_brings_the_rest_as_well(studio: Studio, path: Path) -> None:
    take = open_take(path)
    part = opened_review(take, process_head(take, 2.0))
    studio.state = replace(studio.state, review=replace(part, rest="missing"))
    state = until(
        studio, intents.Export(None, 1, "csv"), lambda state: state.review and not state.work
    )
    assert state.review is not None
    assert state.review.rest == "here"


def test_what_was_stopped_is_not_said_to_be_looked_through(
    studio: Studio, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stopped: Future[None] = Future()
    stopped.set_exception(Stopped("It was stopped.", "Nothing was changed."))
    monkeypatch.setattr(studio._workshop.jobs, "survey", lambda *_asked: stopped)
    assert "not looked through" in timeline.as_html(opened(studio, path))


def grasp(name: str, hold_s: float, release_s: float) -> TakenGrasp:
    known = Recognised(name, "", 0.97, 0.4, "tripod")
    segment = GraspSegment(known, hold_s - 0.3, hold_s, release_s, release_s + 0.3)
    return TakenGrasp(segment, None)


def wrote(time_s: Array, down: Array) -> Writing:
    flat = np.linspace([0.0, 0.0], [0.03, 0.0], len(time_s))
    plane = Plane(np.array([0.0, 0.0, 1.0]), -0.05)
    tip = np.concatenate([flat, np.full((len(flat), 1), -0.05)], axis=1)
    axes, origin = np.eye(3)[:2], np.array([0.0, 0.0, -0.05])
    return Writing(time_s, tip, tip, down, plane, axes, flat, origin, 0.0, 0.0, np.zeros(3))


def test_the_lane_names_grasps_and_writing_of_the_time_in_the_plots(review: Review) -> None:
    time_s = np.linspace(5.0, 7.0, 41)
    down = (time_s < 5.6) | (time_s > 6.4)
    held = (grasp("power_sphere", 1.0, 2.0), grasp("tripod", 3.0, 3.5))
    full = replace(review, found=Found((wrote(time_s, down),), held))
    strip = timeline.as_html(full)
    assert ">Power sphere 97 %</span>" in strip
    assert ">Tripod 97 %</span>" in strip
    assert ">writing</span>" in strip
    assert strip.count(lane.INK) == 4  # all of it and two strokes, and its name
    part = reviewing.marked_out(
        reviewing.sought(reviewing.marked_in(reviewing.sought(full, 2.5)), 4.5)
    )
    near = timeline.as_html(reviewing.fitted(part))
    assert ">Tripod 97 %</span>" in near
    assert ">Power sphere 97 %</span>" not in near
    assert "span" not in lane.as_html(replace(full, from_s=7.5, to_s=8.0))
    assert lane.as_html(replace(review, found=Found())) == ""


def test_the_strip_is_made_anew_only_where_more_is_known_of_the_take(review: Review) -> None:
    later = reviewing.sought(review, 3.0)
    for moved in (later, reviewing.zoomed(review, 2.0), reviewing.marked_in(later)):
        assert timeline.drawn_from(moved) == timeline.drawn_from(review)
        assert timeline.strip(moved) == timeline.strip(review)
        assert timeline.overlay(moved) != timeline.overlay(review)
    noted = replace(review, notes=with_mark(review.notes, 3.0, "here"))
    found = replace(review, found=Found((), (grasp("tripod", 3.0, 3.5),)))
    for other in (noted, found):
        assert timeline.drawn_from(other) != timeline.drawn_from(review)
        assert timeline.strip(other) != timeline.strip(review)


def test_the_strip_tells_what_to_look_at_twice(studio: Studio, path: Path) -> None:
    review = opened(studio, path)
    assert review.stretches is not None
    found = (
        Stretch("gap", 1.0, 1.2, (), 20.0),
        Stretch("impossible", 2.0, 2.5, ("index_dip_flexion",), 31.0),
    )
    strip = timeline.as_html(replace(review, stretches=found))
    assert "gap 20 instants missing · 1.00-1.20 s" in strip
    assert "hardly possible index_dip_flexion 31° beyond" in strip
    assert "nothing to look at twice" in timeline.as_html(replace(review, stretches=()))
    on = replace(review, stretches=None, ordered=frozenset(["stretches"]))
    assert "looking through" in timeline.as_html(on)


def test_a_take_is_looked_through_once(
    studio: Studio, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ordered: list[object] = []
    monkeypatch.setattr(studio._workshop, "look_through", lambda *asked: ordered.append(asked))
    opened(studio, path)
    after(studio, intents.ChooseCurves("index"), intents.ChooseCurves("thumb"))
    state: State = studio.tick(TICK_S)
    assert state.review is not None
    assert state.review.stretches is None
    assert len(ordered) == 1


def test_a_take_is_shared_and_added_elsewhere(studio: Studio, path: Path) -> None:
    opened(studio, path)
    state = until(studio, intents.ShareTake(page=4), lambda state: state.downloads)
    (download,) = state.downloads
    assert download.page == 4
    content = Path(download.content).read_bytes()  # type: ignore[arg-type]
    state = until(
        studio,
        intents.AddTake("sent.take.zip", content),
        lambda state: state.review is not None and state.review.take.path != path,
    )
    assert state.review is not None
    assert state.review.take.path.name == "sent.mcap"
    state = until(studio, intents.AddTake("/no/such/file"), lambda state: state.messages)
    assert state.messages[0].alarm


def until(studio: Studio, intent: intents.Intent, holds: Callable[[State], object]) -> State:
    state = after(studio, intent)
    for _ in range(500):
        if holds(state):
            return state
        time.sleep(0.01)
        state = studio.tick(TICK_S)
    raise AssertionError("it did not happen")


def test_grasps_and_writing_are_searched_for_at_the_first_opening_alone(
    studio: Studio, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened(studio, path)
    studio.tick(TICK_S)
    monkeypatch.setattr(studio._workshop, "find", None)
    after(studio, intents.ShowLive())
    assert opened(studio, path).found is not None


def test_a_track_that_cannot_be_read_is_told_once_and_the_hand_stays_at_its_elbow(
    studio: Studio, path: Path
) -> None:
    track_path(path).write_bytes(b"no archive")
    after(studio, intents.OpenTake(path))
    told = [said.text for _ in range(4) for said in studio.tick(TICK_S).messages]
    for name in ("index", "thumb"):
        told += [said.text for said in after(studio, intents.ChooseCurves(name)).messages]
        told += [said.text for said in studio.tick(TICK_S).messages]
    assert len([text for text in told if "the track cannot be read" in text]) == 1
    assert studio.state.review is not None
    assert studio.state.review.way is None
