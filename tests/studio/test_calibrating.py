"""Guided courses from the page: their take and labels, the virtual glove, leaving, the result."""

from __future__ import annotations

import json
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import msgspec
import numpy as np
import pytest

from app import intents
from app.guidance import courses
from app.guidance.calibrating import manner_of, performs
from app.sounds import Sound
from app.state import State
from app.studio import Studio
from app.views import calibration as calibration_view
from app.views import course as view
from app.views import recording as recording_view
from app.views.answers import answer_of
from app.views.steps import failing_of, sentence_of, title_of
from handstudio.calibrate import Calibrated
from handstudio.calibrate_sensors import SensorsFound
from handstudio.calibration.agreement import Agreement
from handstudio.calibration.allan import AxisNoise, Density
from handstudio.calibration.course import COURSES, SWINGS, Step
from handstudio.calibration.device import UNITY, DeviceCalibration, Residuals, SensorErrors
from handstudio.calibration.heading import HeadingAlignment
from handstudio.calibration.noise import Noise, SensorNoise
from handstudio.calibration.subject import Segment, SubjectCalibration
from handstudio.calibration.verdict import Reading, Verdict, What
from handstudio.check import Checked
from handstudio.device.orders import (
    Ask,
    HeadingTaken,
    Newest,
    Phase,
    ResetHeading,
    SetHeading,
    SetSensors,
    SetSubject,
    ShareSamples,
    StartTake,
    StopTake,
    TakeDone,
)
from handstudio.errors import CalibrationError, DeviceError, TakeError
from handstudio.layout import glove
from handstudio.protocol.commands import PERFORM
from handstudio.recording.calibrations import save_calibration
from handstudio.recording.device_calibrations import save_device_calibration
from handstudio.recording.notes import load_notes, notes_path
from handstudio.samples import ImuSamples
from handstudio.simulation.glove import description
from handstudio.wizards.course import Accept, GoByItself, Next, Redo, Repeat, Skip, Standing
from handstudio.wizards.course import Phase as At

from .conftest import TICK_S, StillCapture, StillRecorder, after, recording

ELBOW = Step("elbow:flexion", "swing", "elbow", "flexion", 2.0, 5.0, 15.0, True, "elbow:flexion")
REST = Step("static", "rest", least_s=2.0, most_s=6.0, perform="static")
STILL, MOVES = 0.0, 1.0


class Judge:
    """A rest wants no movement, a swing four seconds of it."""

    def observe(self, step: Step, rest: Any, done: ImuSamples, layout: Any) -> Verdict:
        rate = done.gyr[:, 0, 0]
        if step.kind == "rest":
            most = float(rate.max())
            return Verdict(step.name, (Reading("stillness", most, 0.5, "deg/s", False),))
        moved = Reading("range", float((rate == MOVES).sum() / 10.0), 40.0, "deg")
        return Verdict(step.name, (moved, Reading("time", 2.0, 1.5, "s", about="static")))

    def enough(self, verdict: Verdict, step: Step, seconds: float) -> bool:
        return seconds >= step.most_s or (seconds >= step.least_s and verdict.ok)


class Guided:
    """A studio with a course on, and a device that feels what a test says."""

    def __init__(self, studio: Studio, capture: StillCapture) -> None:
        self.studio, self.capture = studio, capture
        self.at_us, self.heard = 0, list[Sound]()

    def begin(self, course: str = "hand", *, anew: bool = False) -> State:
        state = after(self.studio, intents.BeginCourse(course, anew=anew))
        started = [order for order in self.capture.orders if isinstance(order, StartTake)]
        self.recorder = recording(self.capture, started[-1].path)
        self.recorder.first_us = self.at_us
        return self.studio.tick(TICK_S) if state.guided is not None else state

    def says(self, *events: Any) -> State:
        for event in events:
            self.studio.tick(1.0)
            state = after(self.studio, intents.Guide(event))
            self.heard += state.sounds
        return state

    def feels(self, seconds: float, rate: float) -> State:
        n = round(seconds * 100)
        time_us = self.at_us + np.arange(1, n + 1, dtype=np.int64) * 10_000
        self.at_us = int(time_us[-1])
        three, flags = np.full((n, 20, 3), rate), np.ones((n, 20), dtype=bool)
        run = ImuSamples(time_us, three, three, three, flags, flags, ~flags)
        self.capture.samples.append(run)
        state = self.studio.tick(TICK_S)
        self.heard += state.sounds
        return state

    def rests(self) -> State:
        """Does the rest well."""
        self.says(Next())
        return self.feels(6.0, STILL)

    def swings(self) -> State:
        """Does the swing well."""
        self.says(Next())
        self.feels(5.1, STILL)
        return self.feels(6.0, MOVES)

    def ends(self) -> State:
        """The take is whole."""
        self.recorder.path.touch()
        self.capture.newest = replace(self.capture.newest, recorder=None)
        self.capture.waiting.append(TakeDone(self.recorder.path))
        self.studio.tick(TICK_S)
        return self.studio.tick(TICK_S)


class Solver:
    """Computes the calibration at once, or fails."""

    share_done = 0.5

    def __init__(self, outcome: Any) -> None:
        self.outcome, self.asked, self.course = outcome, list[Path](), ""
        self.hand_type: int | None = None

    def solve(
        self, course: str, paths: Sequence[Path], sessions: Path, hand_type: int | None
    ) -> Future[Any]:
        self.course, self.asked, self.hand_type = course, list(paths), hand_type
        future: Future[Any] = Future()
        if isinstance(self.outcome, Exception):
            future.set_exception(self.outcome)
        elif self.outcome is not None:
            future.set_result(self.outcome)
        return future


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(courses, "steps_of", lambda _name, _layout: (REST, ELBOW))


@pytest.fixture
def guided(streaming: Studio, capture: StillCapture) -> Guided:
    streaming._guide.calibrator.judge = Judge()
    after(streaming, intents.SetSounds(on=True))
    return Guided(streaming, capture)


def standings(state: State) -> list[Standing]:
    course = state.guided.course if state.guided is not None else state.result.course  # type: ignore[union-attr]
    return [outcome.standing for outcome in course.outcomes]


def at(state: State) -> At:
    assert state.guided is not None
    return state.guided.course.phase


# --- the take -------------------------------------------------------------------------------------


def test_a_course_records_a_take_of_its_own(guided: Guided) -> None:
    state = guided.begin()
    shared, started = guided.capture.orders[-1], guided.capture.orders[-2]
    assert isinstance(started, StartTake)
    assert started.path.name == "calibration.mcap"
    assert started.subject == "S01"
    assert shared == ShareSamples(on=True)
    assert state.guided is not None
    assert state.guided.recording
    assert recording_view.sheet_of(state) == ""  # the course has a sheet of its own


def test_what_is_done_stands_in_the_notes_at_once(guided: Guided) -> None:
    guided.begin()
    guided.rests()
    (label,) = load_notes(guided.recorder.path).labels
    assert label.label == "static"
    assert label.end_s - label.start_s == pytest.approx(2.0, abs=0.06)
    guided.says(Next())
    guided.swings()
    notes = load_notes(guided.recorder.path)
    assert [each.label for each in notes.labels] == ["static", "static", "elbow:flexion"]
    assert notes.labels[2].start_s > notes.labels[1].end_s


def test_seconds_count_from_the_first_instant_of_the_take(guided: Guided) -> None:
    guided.at_us = 50_000_000
    guided.begin()
    guided.rests()
    (label,) = load_notes(guided.recorder.path).labels
    assert 3.0 < label.start_s < 4.0


def test_start_and_stop_are_heard(guided: Guided) -> None:
    guided.begin()
    guided.rests()
    assert guided.heard[0] is Sound.TICK
    assert Sound.START in guided.heard
    assert guided.heard[-1] is Sound.STOP
    guided.says(Next(), Next())
    guided.feels(30.0, STILL)
    assert guided.heard[-1] is Sound.ALARM


def test_nobody_chosen_is_asked_for_first(guided: Guided) -> None:
    state = after(guided.studio, intents.ChooseSubject(""), intents.BeginCourse("hand", page=4))
    assert (state.asking, state.asking_for) == (4, "hand")
    assert state.guided is None
    state = after(guided.studio, intents.SaveSubject("S02", "right", 180.0, then_begin="hand"))
    assert state.guided is not None


def test_without_a_device_or_during_a_take_none_is_begun(
    guided: Guided, capture: StillCapture, tmp_path: Path
) -> None:
    before = capture.newest
    capture.newest = Newest()
    guided.studio.tick(TICK_S)
    state = after(guided.studio, intents.BeginCourse("hand"))
    assert "no device" in state.messages[0].text
    capture.newest = before
    recording(capture, tmp_path / "S01" / "day" / "take.mcap")
    guided.studio.tick(TICK_S)
    state = after(guided.studio, intents.BeginCourse("hand"))
    assert "being recorded" in state.messages[0].text
    assert state.guided is None


def test_space_goes_on_and_pressing_a_button_with_it_counts_once(guided: Guided) -> None:
    guided.begin()
    guided.studio.tick(1.0)
    state = after(guided.studio, intents.GoOn(page=1), intents.Guide(Next()))
    assert at(state) is At.COUNTDOWN
    assert not any(isinstance(order, StopTake) for order in guided.capture.orders)


def test_the_take_that_ends_beneath_it_stops_the_course_and_nothing_else(guided: Guided) -> None:
    guided.begin()
    guided.rests()
    guided.says(Next())
    guided.swings()
    state = guided.ends()
    assert state.guided is not None
    assert state.guided.problem is not None
    sheet = view.sheet_of(state)
    assert sheet is not None
    assert "nothing is recorded" in sheet.content
    assert state.review is None
    takes = [order for order in guided.capture.orders if isinstance(order, StartTake)]
    state = guided.says(Next())
    again = [order for order in guided.capture.orders if isinstance(order, StartTake)]
    assert len(again) == len(takes) + 1
    # what every take begins with is to be done in this one too
    assert standings(state) == [Standing.OPEN, Standing.GOOD]


def test_a_take_that_never_begins_is_noticed(guided: Guided) -> None:
    after(guided.studio, intents.BeginCourse("hand"))
    for _ in range(20):
        state = guided.studio.tick(1.0)
    assert state.guided is not None
    assert state.guided.problem is not None


def test_a_device_that_is_lost_begins_the_step_anew(guided: Guided) -> None:
    guided.begin()
    guided.says(Next())
    guided.feels(1.0, STILL)
    guided.capture.newest = replace(guided.capture.newest, phase=Phase.LOST)
    state = guided.studio.tick(TICK_S)
    assert at(state) is At.AWAY
    guided.capture.newest = replace(guided.capture.newest, phase=Phase.STREAMING)
    guided.at_us += 20_000_000
    state = guided.feels(0.1, STILL)
    assert at(state) is At.INTRO


def test_other_takes_wait_while_a_course_is_on(guided: Guided, tmp_path: Path) -> None:
    guided.begin()
    for intent in (
        intents.OpenTake(tmp_path / "x.mcap"),
        intents.ChooseSubject("S09"),
        intents.DeleteSubject("S01", "S01"),
    ):
        state = after(guided.studio, intent)
        assert "course" in state.messages[0].text
    assert state.settings.subject == "S01"


# --- leaving and coming back ----------------------------------------------------------------------


def test_leaving_keeps_what_was_done(guided: Guided) -> None:
    guided.begin()
    guided.rests()
    guided.says(Next())
    guided.swings()
    state = after(guided.studio, intents.LeaveCourse())
    assert state.guided is None
    assert guided.capture.orders[-2:] == [ShareSamples(on=False), StopTake()]
    assert "waits" in state.messages[0].text
    state = guided.ends()
    assert state.review is None  # it is no take to be looked at now
    (stand,) = [stand for stand in state.stands if stand.name == "hand"]
    assert (stand.settled, stand.steps) == (1, 2)
    state = guided.begin()
    assert standings(state) == [Standing.OPEN, Standing.GOOD]


def test_beginning_anew_forgets_what_was_done(guided: Guided) -> None:
    guided.begin()
    guided.rests()
    guided.says(Next())
    guided.swings()
    after(guided.studio, intents.LeaveCourse())
    guided.ends()
    assert standings(guided.begin(anew=True)) == [Standing.OPEN, Standing.OPEN]


def test_a_broken_file_of_a_course_is_told_and_can_be_begun_anew(guided: Guided) -> None:
    guided.begin()
    guided.rests()
    after(guided.studio, intents.LeaveCourse())
    guided.ends()
    (file,) = guided.studio.state.sessions.glob("S01/*.course.json")
    assert json.loads(file.read_bytes())["takes"]
    file.write_bytes(b"{broken")
    state = after(guided.studio, intents.BeginCourse("hand"))
    assert state.guided is None
    assert "Begin the course anew" in state.messages[0].remedy
    assert guided.begin(anew=True).guided is not None


def test_stopping_the_take_leaves_the_course(guided: Guided) -> None:
    guided.begin()
    state = after(guided.studio, intents.ToggleRecording())
    assert state.guided is None
    assert isinstance(guided.capture.orders[-1], StopTake)


def test_labels_that_cannot_be_written_are_written_later(guided: Guided) -> None:
    guided.begin()
    place = notes_path(guided.recorder.path)
    place.mkdir()  # in the way
    state = guided.rests()
    assert any(message.alarm for message in state.messages)
    place.rmdir()
    for message in (Next(), Skip()):
        guided.says(message)
    assert [label.label for label in load_notes(guided.recorder.path).labels] == ["static"]


# --- the virtual glove ----------------------------------------------------------------------------


def test_a_virtual_glove_is_asked_and_the_course_runs_by_itself(
    guided: Guided, capture: StillCapture
) -> None:
    told = description("right", 7, 100, 1, "Virtual glove on person 7, hand 160 mm")
    address = "virtual:?subject=7&motion=static~sloppy"
    capture.newest = replace(capture.newest, description=told, address=address)
    guided.studio.tick(TICK_S)
    guided.begin()
    guided.feels(4.0, STILL)
    asks = [order for order in capture.orders if isinstance(order, Ask)]
    assert asks == [Ask(PERFORM, b"static~sloppy")]
    state = guided.feels(3.6, STILL)
    assert state.guided is not None
    assert state.guided.course.index == 1
    assert at(state) is not At.INTRO


def test_who_performs() -> None:
    virtual = description("right", 7, 100, 1, "Virtual glove")
    real = replace(virtual, name="HG-20", firmware="2.1")
    assert performs(Newest(address="tcp:127.0.0.1:5", description=virtual))
    assert not performs(Newest(address="replay:take.mcap", description=virtual))
    assert not performs(Newest(address="serial:/dev/ttyACM0", description=real))
    assert not performs(Newest())


def test_the_manner_of_a_virtual_person() -> None:
    assert manner_of(Newest(address="virtual:?motion=static~small~slow")) == "~small~slow"
    assert manner_of(Newest(address="virtual:?motion=static~small%2Bopen_close")) == ""
    assert manner_of(Newest(address="virtual:")) == ""
    assert manner_of(Newest(address="serial:/dev/ttyACM0")) == ""


# --- the result -----------------------------------------------------------------------------------


def calibrated(*to_repeat: str, plausible: float = 0.3) -> Calibrated:
    segment = Segment(
        "index_proximal",
        "SN15",
        (1.0, 0.0, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.0),
        (0.0, 0.1, 0.0),
        (0.001, 0.001, 0.001),
        0.0458,
        0.0006,
        "measured",
        "measured",
        plausible,
    )
    one = SubjectCalibration(
        "id", "2026-01-01T00:00:00Z", "1", "S01", "right", 0.187, 3, "VG-7", (segment,), ()
    )
    return Calibrated(one, (), to_repeat)


def finished(guided: Guided, outcome: Any, course: str = "hand") -> State:
    guided.studio._workshop.jobs = Solver(outcome)  # type: ignore[assignment]
    guided.begin(course)
    guided.rests()
    guided.says(Next())
    guided.swings()
    state = guided.says(Next())
    assert state.guided is None
    assert state.result is not None
    return guided.ends()


def test_after_the_last_step_the_calibration_is_computed_from_its_takes(guided: Guided) -> None:
    state = finished(guided, calibrated())
    assert guided.studio._workshop.jobs.asked == [guided.recorder.path]  # type: ignore[attr-defined]
    assert state.result is not None
    assert state.result.calibrated is not None
    sheet = view.sheet_of(state)
    assert sheet is not None
    assert "45.8 ± 0.6 mm" in sheet.content
    assert "Calibrated." in sheet.content
    assert after(guided.studio, intents.CloseResult()).result is None


@pytest.mark.parametrize("hand_type", [1, 2, 3])
def test_the_palm_is_divided_as_was_chosen(guided: Guided, hand_type: Any) -> None:
    state = after(guided.studio, intents.SetHandType(hand_type))
    assert view.palm_is_chosen(state)
    state = guided.begin()
    assert state.guided is not None
    assert state.guided.course.layout.hand_type == hand_type
    finished(guided, calibrated())
    assert guided.studio._workshop.jobs.hand_type == hand_type  # type: ignore[attr-defined]


def test_what_is_worth_repeating_is_offered_and_done_in_another_take(guided: Guided) -> None:
    state = finished(guided, calibrated("elbow:flexion", plausible=-4.2))
    sheet = view.sheet_of(state)
    assert sheet is not None
    assert "with doubts" in sheet.content
    assert "Elbow: flexion" in sheet.content
    (label, intent), *_ = sheet.others
    assert label == "Repeat Elbow: flexion"
    state = after(guided.studio, intent)
    assert state.guided is not None
    assert standings(state) == [Standing.OPEN, Standing.OPEN]


def test_while_it_is_computed_it_says_so_and_can_be_called_off(guided: Guided) -> None:
    guided.studio._workshop.jobs = Solver(None)  # type: ignore[assignment]
    guided.begin()
    for seconds in (guided.rests, lambda: guided.says(Next()), guided.swings):
        seconds()
    guided.says(Next())
    sheet = view.sheet_of(guided.studio.state)
    assert sheet is not None
    assert "Computing" in sheet.content
    assert sheet.others[0][1] == intents.CancelWork()


def test_a_job_that_fails_says_why(guided: Guided) -> None:
    state = finished(guided, CalibrationError("Too little of it.", "Swing more."))
    sheet = view.sheet_of(state)
    assert sheet is not None
    assert "Too little of it." in sheet.content
    assert "Swing more." in sheet.content


def test_a_take_that_cannot_be_written_ends_in_words(guided: Guided) -> None:
    guided.begin()
    guided.rests()
    guided.says(Next())
    guided.swings()
    guided.says(Next())
    guided.capture.newest = replace(guided.capture.newest, recorder=None)
    guided.capture.waiting.append(TakeError("The disk is full.", "Free some space."))
    state = guided.studio.tick(TICK_S)
    assert state.result is not None
    assert not state.result.solving
    assert state.result.error is not None


# --- heading, and words ---------------------------------------------------------------------------


def test_headings_are_taken_anew(streaming: Studio, capture: StillCapture) -> None:
    after(streaming, intents.ResetHeading(), intents.ResetHeading("SN7"))
    assert capture.orders == [ResetHeading(None), ResetHeading("SN7")]


def test_headings_taken_anew_are_told_when_they_were_and_not_when_it_was_refused(
    streaming: Studio, capture: StillCapture
) -> None:
    assert after(streaming, intents.ResetHeading()).messages == ()
    capture.waiting.append(DeviceError("No hand is shown yet.", "Connect a glove."))
    assert [m.text for m in streaming.tick(0.016).messages] == ["No hand is shown yet."]
    capture.waiting += [HeadingTaken(None), HeadingTaken("SN7")]
    told = [m.text for m in streaming.tick(0.016).messages]
    assert told == ["Heading taken anew: all sensors.", "Heading taken anew: SN7."]


def test_a_refused_step_says_figure_limit_and_what_to_do(guided: Guided) -> None:
    guided.begin()
    guided.rests()
    guided.says(Next(), Next())
    guided.feels(5.1, STILL)
    guided.feels(1.8, MOVES)
    state = guided.feels(20.0, STILL)
    sheet = view.sheet_of(state)
    assert sheet is not None
    assert "Swung by 18°, 40° wanted: swing further." in sheet.content
    assert sheet.first is not None
    assert [sheet.first[0], *(label for label, _ in sheet.others)] == [
        "Repeat",
        "Use it all the same",
        "Skip",
        "Leave",
    ]
    assert standings(guided.says(Accept())) == [Standing.GOOD, Standing.ACCEPTED]


def test_the_words_of_the_order() -> None:
    reading = Reading("second_axis", 18.2, 30.0, "deg")
    assert failing_of(reading) == "Second axis covered 18°, 30° wanted: repeat the sideways swing."


def test_a_finger_that_bends_where_it_should_go_sideways_is_not_told_to_be_another() -> None:
    reading = Reading("others", 39.0, 35.0, "%", False, "ring_mcp")
    assert failing_of(reading).startswith("Ring MCP moved along")
    assert failing_of(reading, "ring_mcp").startswith("It bent along by 39 %")


@pytest.mark.parametrize("what", get_args(What))
@pytest.mark.parametrize("at_least", [True, False])
def test_every_figure_has_words(what: Any, at_least: bool) -> None:
    words = failing_of(Reading(what, float("nan"), 1.0, "deg", at_least, "index_mcp"))
    assert "–" in words
    assert words.endswith(".")


def test_every_step_of_every_course_has_a_sentence_and_a_title() -> None:
    steps = {step.name: step for steps in COURSES.values() for step in steps}
    assert len(steps) > len(SWINGS)
    assert all(sentence_of(step).endswith(".") for step in steps.values())
    assert len({title_of(step) for step in steps.values()}) == len(steps)
    assert all("{" not in sentence_of(step) for step in steps.values())


def test_every_event_can_be_said(guided: Guided) -> None:
    guided.begin()
    for event in (GoByItself(on=True), Redo(1), Repeat(), Redo(0), Next()):
        assert guided.says(event).guided is not None
    assert isinstance(guided.recorder, StillRecorder)


# --- what comes of the other courses --------------------------------------------------------------


def alignment(*, ok: bool = True) -> HeadingAlignment:
    n = 20
    reading = Reading("turn", 60.0 if ok else 10.0, 45.0, "deg")
    return HeadingAlignment(
        names=glove().names,
        psi_cor=tuple(np.linspace(-0.1, 0.1, n).tolist()),
        psi_wg=(0.0,) * n,
        sd=(*((0.005,) * (n - 1)), float("inf")),
        residual=(0.01,) * n,
        together=(0.01,) * n,
        outlying=(False,) * n,
        turn=1.0,
        axis_tilt=0.0,
        verdict=Verdict("heading_rotation", (reading,)),
    )


@pytest.mark.parametrize("ok", [True, False])
def test_a_quick_start_sets_the_headings_where_it_was_done_well(guided: Guided, ok: bool) -> None:
    state = finished(guided, alignment(ok=ok), "quick_start")
    assert guided.studio._workshop.jobs.course == "quick_start"  # type: ignore[attr-defined]
    set_to = [o for o in guided.capture.orders if isinstance(o, SetHeading)]
    assert set_to == ([SetHeading(alignment().psi_cor)] if ok else [])
    sheet = view.sheet_of(state)
    assert sheet is not None
    assert ("Headings aligned." in sheet.content) is ok
    assert ("disagreed by 3.5° (SD); headings are now known to 0.3°" in sheet.content) is ok


def test_a_check_says_by_segment_whether_the_calibration_holds(guided: Guided) -> None:
    readings = tuple(
        Reading("against", value, 7.0, "deg", at_least=False, about=name)
        for name, value in (("hand", 3.2), ("index_proximal", 17.0))
    )
    checked = Checked(calibrated().calibration, Verdict("check", readings))
    sheet = view.sheet_of(finished(guided, checked))
    assert sheet is not None
    assert "does not hold any more" in sheet.content
    assert "2026-01-01" in sheet.content
    assert "17°" in sheet.content
    holds = Checked(calibrated().calibration, Verdict("check", readings[:1]))
    assert "It still holds." in answer_of(holds)


def test_a_check_needs_a_calibration(guided: Guided) -> None:
    state = after(guided.studio, intents.BeginCourse("check"))
    assert state.guided is None
    assert "no calibration" in state.messages[0].text


def test_sensors_are_shown_before_and_after(guided: Guided) -> None:
    one = SensorErrors("SN1", UNITY, (0.0,) * 3, UNITY, (0.0,) * 3, Residuals(0.01, 0.002), 20)
    device = DeviceCalibration("VG-1", "2026-01-01T00:00:00Z", "1", (), (one,))
    verdict = Verdict("tumble", (Reading("directions", 14.0, 9.0, ""),))
    shown = SensorsFound(
        device,
        verdict,
        ("SN1", "SN2"),
        (Agreement(0.31, 1.7), Agreement(float("nan"), float("nan"))),
        (Agreement(0.012, 0.11), Agreement(float("nan"), float("nan"))),
    )
    sheet = view.sheet_of(finished(guided, shown))
    assert sheet is not None
    assert "0.31 → 0.012 m/s²" in sheet.content
    assert "1.70 → 0.11°" in sheet.content
    refused = replace(shown, verdict=Verdict("tumble", (Reading("directions", 4.0, 9.0, ""),)))
    assert "stay as they were" in answer_of(refused)


def test_noise_is_shown_by_sensor() -> None:
    density = Density(0.0001, 0.00009, 0.00012, True)
    axis = AxisNoise((1.0,), (0.1,), (0.1,), (0.1,), density, Density(0.0, 0.0, 1e-6, False), 1.2)
    three = (axis, axis, axis)
    content = answer_of(Noise((SensorNoise("SN1", three, three),), ("SN2",), 100.0, (1200.0,)))
    assert "20 min at 100 Hz" in content
    assert "0.00573" in content  # 0.0001 rad in degrees
    assert "silent or stuck" in content


# --- the calibration in use -----------------------------------------------------------------------

MADE = "2026-01-01T00:00:00+00:00"


def kept(studio: Studio, id: str = "one", made: str = MADE, **values: Any) -> SubjectCalibration:
    one = msgspec.structs.replace(calibrated().calibration, id=id, made_utc=made, **values)
    save_calibration(studio.state.sessions, one)
    return one


def sent(guided: Guided) -> list[Any]:
    orders = [o for o in guided.capture.orders if isinstance(o, SetSubject)]
    return [order.calibration for order in orders]


def test_the_calibration_of_whoever_is_chosen_is_used(guided: Guided) -> None:
    one = kept(guided.studio)
    after(guided.studio, intents.ChooseSubject(""))
    state = after(guided.studio, intents.ChooseSubject("S01"))
    assert sent(guided) == [one]
    assert state.in_use.subject == one
    words = " ".join(step.figure for step in calibration_view.steps_of(state))
    assert "calibrated 2026-01-01 00:00" in words
    assert "glove VG-7" in words
    after(guided.studio, intents.ChooseSubject(""))
    assert sent(guided) == [one, None]


def test_none_can_be_used_and_the_one_before(guided: Guided) -> None:
    first = kept(guided.studio)
    second = kept(guided.studio, "two", "2026-01-02T00:00:00+00:00")
    after(guided.studio, intents.ChooseSubject(""))
    after(guided.studio, intents.ChooseSubject("S01"))
    state = after(guided.studio, intents.UseCalibration("none"))
    assert state.in_use.none
    assert "as asked" in " ".join(step.figure for step in calibration_view.steps_of(state))
    after(guided.studio, intents.UseCalibration("again"))
    after(guided.studio, intents.UseCalibration("previous"))
    assert sent(guided) == [second, None, second, first]
    state = after(guided.studio, intents.UseCalibration("previous"))
    assert "no calibration before" in state.messages[0].text
    assert state.in_use.subject == first


def test_a_broken_file_is_told_and_the_last_good_one_is_used(guided: Guided) -> None:
    one = kept(guided.studio)
    (file,) = guided.studio.state.sessions.glob("S01/calibration.right.json")
    file.write_bytes(b"{broken")
    after(guided.studio, intents.ChooseSubject(""))
    state = after(guided.studio, intents.ChooseSubject("S01"))
    assert any(message.alarm for message in state.messages)
    assert sent(guided) == [one]


def test_a_new_calibration_is_used_at_once(guided: Guided) -> None:
    new = calibrated()
    one = msgspec.structs.replace(new.calibration, made_utc=MADE)
    guided.studio._workshop.jobs = Solver(replace(new, calibration=one))  # type: ignore[assignment]
    guided.begin()
    guided.rests()
    guided.says(Next())
    guided.swings()
    guided.says(Next())
    save_calibration(guided.studio.state.sessions, one)  # as the job does
    guided.ends()
    assert sent(guided) == [one]


def test_the_errors_of_the_device_that_is_there_are_used(guided: Guided) -> None:
    setup = guided.capture.newest.setup
    assert setup is not None
    assert setup.device is not None
    device = DeviceCalibration(
        setup.device.serial_number, "2026-01-01T00:00:00.000+00:00", "1", (), ()
    )
    save_device_calibration(guided.studio.state.sessions, device)
    after(guided.studio, intents.ChooseSubject(""))
    state = guided.studio.tick(TICK_S)
    assert state.in_use.sensors == device
    assert SetSensors(device) in guided.capture.orders
