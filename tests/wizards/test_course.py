"""The course: phases, what people say, what the device sends, and that cutting changes nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handstudio.calibration.course import HAND, QUICK_START, Step, course
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.errors import CalibrationError
from handstudio.layout import glove
from handstudio.samples import ImuSamples
from handstudio.wizards import saved, window
from handstudio.wizards.course import (
    Accept,
    Course,
    Cue,
    Event,
    GoByItself,
    Labelled,
    Leave,
    Lost,
    Next,
    Perform,
    Phase,
    Redo,
    Repeat,
    Samples,
    Skip,
    Standing,
    advance,
    begin,
)
from handstudio.wizards.sensed import READ_S, REST_MORE_S, SETTLE_S
from handstudio.wizards.state import COUNT_S

RATE_HZ = 100.0
LAYOUT = glove("right", ["SN1", "SN11"])
STILL, MOVES = 0.0, 1.0

ELBOW = Step("elbow:flexion", "swing", "elbow", "flexion", 2.0, 5.0, 15.0, False, "elbow:flexion")
WRIST = Step("wrist:flexion", "swing", "wrist", "flexion", 2.0, 5.0, 15.0, True, "wrist:flexion")
REST = Step("static", "rest", least_s=2.0, most_s=6.0, perform="static")
STEPS = (REST, ELBOW, WRIST)


class Judge:
    """The first sensor's rate is how far it moves: a rest wants none of it, a swing wants it."""

    wanted_s = 4.0

    def observe(
        self, step: Step, rest: ImuSamples | None, done: ImuSamples, layout: object
    ) -> Verdict:
        readings = []
        if step.kind == "swing":
            moved = float((done.gyr[:, 0, 0] == MOVES).sum() / RATE_HZ)
            readings.append(Reading("range", moved, self.wanted_s, "deg"))
            rested = 0.0 if rest is None else len(rest) / RATE_HZ
            still = rest is not None and not rest.gyr.any()
            readings.append(Reading("time", rested, 1.5, "s", about="static"))
            readings.append(Reading("stillness", 0.0 if still else 9.0, 1.0, "deg/s", False))
        else:
            readings.append(Reading("stillness", float(done.gyr.max()), 0.5, "deg/s", False))
        return Verdict(step.name, tuple(readings))

    def enough(self, verdict: Verdict, step: Step, seconds: float) -> bool:
        return seconds >= step.most_s or (seconds >= step.least_s and verdict.ok)


JUDGE = Judge()


class Device:
    """Sends what a test says, on its own clock."""

    def __init__(self, at_s: float = 10.0) -> None:
        self.at_us = round(at_s * 1e6)

    def sends(self, seconds: float, rate: float) -> ImuSamples:
        n = round(seconds * RATE_HZ)
        time_us = self.at_us + np.arange(1, n + 1, dtype=np.int64) * round(1e6 / RATE_HZ)
        self.at_us = int(time_us[-1])
        gyr = np.full((n, 2, 3), rate)
        flags = np.ones((n, 2), dtype=bool)
        return ImuSamples(time_us, gyr, np.ones((n, 2, 3)), gyr, flags, flags, ~flags)

    def silent(self, seconds: float) -> None:
        self.at_us += round(seconds * 1e6)


class Guide:
    """A course, and everything that was told."""

    def __init__(self, steps: Sequence[Step] = STEPS, *, performing: bool = False) -> None:
        self.course = begin("hand", tuple(steps), LAYOUT, RATE_HZ, performing=performing)
        self.device, self.told = Device(), []  # type: ignore[var-annotated]

    def hears(self, event: Event) -> Guide:
        self.course = advance(self.course, event, JUDGE)
        self.told += self.course.told
        return self

    def feels(self, seconds: float, rate: float) -> Guide:
        return self.hears(Samples(self.device.sends(seconds, rate)))

    @property
    def labels(self) -> list[Labelled]:
        return [each for each in self.told if isinstance(each, Labelled)]

    @property
    def cues(self) -> list[Cue]:
        return [each for each in self.told if isinstance(each, Cue)]

    @property
    def standings(self) -> list[Standing]:
        return [outcome.standing for outcome in self.course.outcomes]


def at_the_swing() -> Guide:
    """The rest is done; the elbow's step is shown."""
    guide = Guide().hears(Next()).feels(COUNT_S + 2.5, STILL)
    assert guide.course.phase is Phase.VERDICT
    return guide.hears(Next()).feels(0.1, STILL)


def swung() -> Guide:
    """And was done well."""
    guide = at_the_swing().hears(Next()).feels(COUNT_S + 2.1, STILL).feels(6.0, MOVES)
    assert guide.course.phase is Phase.VERDICT
    return guide


# --- phases ---------------------------------------------------------------------------------------


def test_a_step_waits_to_be_begun() -> None:
    guide = Guide().feels(60.0, STILL)
    assert guide.course.phase is Phase.INTRO
    assert guide.told == []


def test_three_two_one_then_rest_then_the_movement_then_the_verdict() -> None:
    guide = at_the_swing()
    guide.told.clear()
    phases, counts = [], []
    guide.hears(Next())
    for seconds, rate in ((COUNT_S + 2.1, STILL), (6.0, MOVES)):
        for _ in range(round(seconds * 10)):
            guide.feels(0.1, rate)
            phases.append(guide.course.phase)
            if guide.course.phase is Phase.COUNTDOWN:
                counts.append(guide.course.count)
    order = list(dict.fromkeys(phases))
    assert order == [Phase.COUNTDOWN, Phase.RESTING, Phase.DOING, Phase.VERDICT]
    assert sorted(set(counts), reverse=True) == [3, 2, 1]
    assert guide.cues == [Cue.TICK, Cue.TICK, Cue.TICK, Cue.START, Cue.STOP]
    static, swing = guide.labels
    assert (static.label, swing.label) == ("static", "elbow:flexion")
    assert 1.5e6 <= static.end_us - static.start_us <= 1.6e6
    assert swing.start_us > static.end_us
    assert swing.end_us - swing.start_us == pytest.approx(5e6, abs=0.3e6)
    assert guide.course.outcome.standing is Standing.GOOD


def test_it_stops_by_itself_at_the_latest_when_the_step_may_last_no_longer() -> None:
    guide = at_the_swing().hears(Next()).feels(COUNT_S + 2.1, STILL).feels(30.0, STILL)
    assert guide.course.outcome.standing is Standing.REFUSED
    assert guide.cues[-2:] == [Cue.STOP, Cue.REFUSED]
    swing = guide.labels[-1]
    assert swing.end_us - swing.start_us <= 15.1e6
    assert [reading.what for reading in guide.course.outcome.verdict.failing] == ["range"]


def test_a_rest_that_is_disturbed_is_waited_for() -> None:
    guide = at_the_swing().hears(Next()).feels(COUNT_S + 1.0, STILL).feels(0.5, MOVES)
    assert guide.course.phase is Phase.RESTING
    assert guide.course.live is not None
    guide.feels(2.2, STILL)
    assert guide.course.phase is Phase.DOING
    samples = guide.course.rest.samples
    assert samples is not None
    assert not samples.gyr.any()


def test_who_never_rests_goes_on_and_is_told_so() -> None:
    guide = at_the_swing().hears(Next()).feels(COUNT_S, STILL).feels(2.0 + REST_MORE_S + 0.5, MOVES)
    assert guide.course.phase is Phase.DOING
    guide.feels(16.0, MOVES)
    verdict = guide.course.outcome.verdict
    assert verdict is not None
    assert [reading.what for reading in verdict.failing] == ["stillness"]


def test_of_a_rest_the_newest_stretch_counts() -> None:
    guide = Guide().hears(Next()).feels(COUNT_S, STILL).feels(2.0, MOVES).feels(2.4, STILL)
    assert guide.course.outcome.standing is Standing.GOOD
    (label,) = guide.labels
    assert label.end_us - label.start_us == pytest.approx(2e6, abs=0.06e6)


# --- what people say ------------------------------------------------------------------------------


def test_a_refused_step_is_repeated_or_used_all_the_same() -> None:
    refused = at_the_swing().hears(Next()).feels(COUNT_S + 2.1, STILL).feels(16.0, STILL)
    course = refused.course
    for event in (Next(), Repeat()):
        again = advance(course, event, JUDGE)
        assert (again.phase, again.index) == (Phase.COUNTDOWN, 1)
    used = advance(course, Accept(), JUDGE)
    assert used.outcomes[1].standing is Standing.ACCEPTED
    assert used.outcomes[1].verdict is not None
    assert used.index == 2


def test_a_good_step_cannot_be_merely_accepted() -> None:
    guide = swung()
    assert advance(guide.course, Accept(), JUDGE).outcomes[1].standing is Standing.GOOD


def test_only_what_may_be_left_out_is_skipped() -> None:
    guide = at_the_swing().hears(Skip())
    assert guide.course.index == 1
    guide = swung().hears(Next()).hears(Skip())
    assert guide.standings == [Standing.GOOD, Standing.GOOD, Standing.SKIPPED]
    assert guide.course.phase is Phase.OVER


def test_one_step_is_done_again_and_the_others_stay() -> None:
    guide = swung().hears(Next())
    assert guide.course.index == 2
    guide.hears(Redo(0)).hears(Next()).feels(COUNT_S + 2.5, STILL)
    assert guide.standings == [Standing.GOOD, Standing.GOOD, Standing.OPEN]
    guide.hears(Next())
    assert guide.course.index == 2  # on with what is open


def test_a_step_is_done_again_after_the_end() -> None:
    guide = swung().hears(Next()).hears(Skip()).hears(Redo(1))
    assert (guide.course.phase, guide.course.index) == (Phase.INTRO, 1)
    assert guide.standings[0] is Standing.GOOD
    assert advance(guide.course, Redo(99), JUDGE).index == 1


def test_a_step_is_ended_by_hand() -> None:
    guide = at_the_swing().hears(Next()).feels(COUNT_S + 2.1, STILL).feels(4.2, MOVES).hears(Next())
    assert guide.course.outcome.standing is Standing.GOOD


def test_it_goes_on_by_itself_where_that_is_wanted() -> None:
    guide = Guide().hears(GoByItself(on=True)).feels(READ_S + COUNT_S + 3.0, STILL)
    assert guide.course.phase is Phase.VERDICT
    guide.feels(2.0, STILL)
    assert (guide.course.phase, guide.course.index) == (Phase.INTRO, 1)


def test_a_refused_step_does_not_go_on_by_itself() -> None:
    guide = Guide().hears(GoByItself(on=True)).feels(READ_S + COUNT_S, STILL).feels(60.0, MOVES)
    assert guide.course.phase is Phase.VERDICT
    assert guide.course.index == 0


@pytest.mark.parametrize("phase", list(Phase))
@pytest.mark.parametrize(
    "event", [Next(), Repeat(), Accept(), Skip(), Redo(0), Leave(), Lost(), GoByItself(on=True)]
)
def test_anything_may_be_said_at_any_time(phase: Phase, event: Event) -> None:
    course = replace(at_the_swing().course, phase=phase)
    after = advance(course, event, JUDGE)
    assert 0 <= after.index < len(STEPS)
    advance(after, Samples(Device(100.0).sends(1.0, STILL)), JUDGE)


# --- a device that performs, that is lost ---------------------------------------------------------


def test_a_wearer_who_performs_is_asked_and_waited_for() -> None:
    """What still rests after asking is the posture of before: the movement there comes first."""
    guide = Guide((ELBOW,), performing=True).feels(0.5, STILL).feels(COUNT_S + 1.0, STILL)
    assert [each for each in guide.told if isinstance(each, Perform)] == [Perform("elbow:flexion")]
    guide.feels(1.0, STILL)
    assert guide.course.phase is Phase.RESTING  # still as before: not begun yet
    guide.feels(0.8, MOVES).feels(2.0, STILL)
    assert guide.course.phase is Phase.DOING
    guide.feels(5.5, MOVES).feels(2.0, STILL)
    assert guide.course.phase is Phase.OVER


def test_a_wearer_who_is_there_already_is_not_waited_for_for_ever() -> None:
    guide = Guide((ELBOW,), performing=True).feels(0.5 + COUNT_S + SETTLE_S + 1.0, STILL)
    assert guide.course.phase is Phase.DOING


@pytest.mark.parametrize(
    ("seconds", "phase"), [(1.0, "countdown"), (4.0, "resting"), (7.0, "doing")]
)
def test_a_lost_device_begins_the_step_anew(seconds: float, phase: str) -> None:
    guide = at_the_swing().hears(Next()).feels(min(seconds, COUNT_S + 2.1), STILL)
    if seconds > COUNT_S + 2.1:
        guide.feels(seconds - COUNT_S - 2.1, MOVES)
    assert guide.course.phase.value == phase
    guide.hears(Lost())
    assert guide.course.phase is Phase.AWAY
    assert guide.hears(Next()).course.phase is Phase.AWAY
    guide.device.silent(30.0)
    guide.feels(0.1, STILL)
    assert (guide.course.phase, guide.course.trouble) == (Phase.INTRO, "away")
    guide.hears(Next()).feels(COUNT_S + 2.1, STILL).feels(6.0, MOVES)
    assert guide.course.outcome.standing is Standing.GOOD


def test_a_hole_in_the_data_begins_the_step_anew() -> None:
    guide = at_the_swing().hears(Next()).feels(COUNT_S + 2.1, STILL).feels(2.0, MOVES)
    guide.device.silent(0.2)
    assert guide.feels(1.0, MOVES).course.phase is Phase.DOING  # that short is no matter
    guide.device.silent(0.5)
    guide.feels(0.1, MOVES)
    assert (guide.course.phase, guide.course.trouble) == (Phase.COUNTDOWN, "gap")


def test_a_clock_that_starts_over_is_a_hole() -> None:
    guide = at_the_swing().hears(Next()).feels(COUNT_S + 2.1, STILL).feels(2.0, MOVES)
    guide.device.at_us = 0
    assert guide.feels(0.1, MOVES).course.phase is Phase.COUNTDOWN


# --- laws -----------------------------------------------------------------------------------------


@cache
def whole() -> ImuSamples:
    device = Device()
    parts = [(4.0, STILL), (3.0, MOVES), (COUNT_S + 9.0, STILL), (7.0, MOVES), (12.0, STILL)]
    return window.joined(tuple(device.sends(*part) for part in parts))


def fed(cuts: Sequence[int]) -> Guide:
    samples, guide = whole(), Guide().hears(GoByItself(on=True))
    edges = [0, *sorted(cuts), len(samples)]
    for start, end in pairwise(edges):
        guide.hears(Samples(samples[start:end]))
    return guide


@cache
def uncut() -> Guide:
    return fed([])


def same(a: Course, b: Course) -> bool:
    plain = ("index", "phase", "since_us", "now_us", "due_us", "live", "moved", "outcomes")
    return all(getattr(a, name) == getattr(b, name) for name in plain) and all(
        getattr(a, name).samples == getattr(b, name).samples for name in ("rest", "done")
    )


@settings(max_examples=20)
@given(st.lists(st.integers(0, 3500), max_size=12))
def test_cutting_the_samples_otherwise_changes_nothing(cuts: list[int]) -> None:
    at_once, cut = uncut(), fed([min(c, len(whole())) for c in cuts])
    assert same(at_once.course, cut.course)
    assert at_once.told == cut.told


def test_cutting_into_single_instants_changes_nothing() -> None:
    assert same(uncut().course, fed(range(len(whole()))).course)


@given(st.lists(st.integers(1, 400), min_size=1, max_size=60), st.sampled_from([100.0, 500.0, 1e3]))
def test_a_window_is_the_same_however_it_came_and_never_larger_than_its_bound(
    lengths: list[int], rate_hz: float
) -> None:
    device = Device()
    samples = device.sends(sum(lengths) / RATE_HZ, MOVES)
    at_once, cut = window.added(window.begun(rate_hz), samples), window.begun(rate_hz)
    at = 0
    for length in lengths:
        cut = window.added(cut, samples[at : at + length])
        at += length
    assert at_once.samples == cut.samples


def test_of_hours_only_so_much_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(window, "MOST", 500)
    device, kept = Device(), window.begun(100.0)
    whole, twice = window.begun(100.0), []
    for _ in range(90):
        piece = device.sends(1.0, MOVES)
        kept = window.added(kept, piece)
        twice.append(piece)
        assert kept.kept <= 500
    whole = window.added(whole, window.joined(tuple(twice)))
    assert whole.samples == kept.samples
    assert kept.seconds == pytest.approx(90.0, abs=0.5)


# --- leaving and coming back ----------------------------------------------------------------------


def test_a_course_that_was_left_goes_on_where_something_is_missing() -> None:
    left = swung().hears(Next()).feels(0.5, STILL).hears(Leave()).course
    text = saved.pack(left)
    fresh = begin("hand", STEPS, LAYOUT, RATE_HZ)
    back = saved.resumed(fresh, text, "it")
    # what every take begins with belongs to the take before; the elbow does not
    assert [o.standing for o in back.outcomes] == [Standing.OPEN, Standing.GOOD, Standing.OPEN]
    assert back.outcomes[1].verdict == left.outcomes[1].verdict
    assert (back.index, back.phase) == (0, Phase.INTRO)
    assert saved.pack(back) != text
    assert saved.pack(saved.resumed(fresh, saved.pack(back), "it")) == saved.pack(back)


def test_names_that_come_twice_are_kept_apart() -> None:
    steps = (*QUICK_START, ELBOW)
    course = begin("hand", steps, LAYOUT, RATE_HZ)
    back = saved.resumed(course, saved.pack(course), "it")
    assert len(back.outcomes) == len(steps)


@pytest.mark.parametrize("text", [b"", b"{}", b"\xff\xfe", b'{"course": "noise", "steps": []}'])
def test_what_is_no_course_is_refused(text: bytes) -> None:
    with pytest.raises(CalibrationError, match="not a course"):
        saved.resumed(begin("hand", STEPS, LAYOUT, RATE_HZ), text, "it")


def test_leaving_in_the_middle_begins_the_step_anew() -> None:
    guide = (
        at_the_swing().hears(Next()).feels(COUNT_S + 2.1, STILL).feels(2.0, MOVES).hears(Leave())
    )
    assert guide.course.phase is Phase.INTRO
    assert guide.course.done.samples is None


def test_the_whole_course_takes_less_than_six_minutes() -> None:
    steps = course("hand", glove())
    assert steps == HAND
    assert begin("hand", steps, glove(), RATE_HZ).seconds_left < 400.0
