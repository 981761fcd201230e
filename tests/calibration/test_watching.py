"""Steps of a calibration that are done well pass; done otherwise they fail, and say for what."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from handstudio.calibration.course import (
    COURSES,
    FIT,
    FLAT,
    NOISE,
    REST,
    SWINGS,
    TRYOUT,
    TUMBLE,
    TURN,
)
from handstudio.calibration.demands import demand_of
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.calibration.watching import enough, observe
from handstudio.layout import glove
from handstudio.samples import ImuSamples
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.subject import subject
from handstudio.simulation.worn import begin, sense, wear

STEP = {step.name: step for step in (FIT, REST, TURN, FLAT, TRYOUT, TUMBLE, NOISE, *SWINGS)}
LAYOUT = glove()
OTHERS = ("fit", "tryout", "tumble", "rest")
SOME = (
    "static",
    "heading_rotation",
    "flat_hand",
    "elbow:flexion",
    "elbow:rotation",
    "wrist:deviation",
    "ulnar_cmc:flexion",
    "thumb_cmc:abduction",
    "thumb_ip:flexion",
    "index_mcp:flexion",
    "middle_mcp:abduction",
    "ring_pip:flexion",
    "little_dip:flexion",
)


@cache
def parts(
    text: str, person: int = 3, side: str = "right", with_: str = "typical", rate_hz: int = 100
) -> dict[str, ImuSamples]:
    """What is read while somebody does this, by label."""
    who = subject(person, side)
    done = perform(text, Actor(who, person))
    worn = wear(who, glove(side), parse(with_), person)
    count = round(done.duration_s * rate_hz)
    time_us = np.arange(count) * (1_000_000 // rate_hz)
    samples = sense(worn, begin(worn), done, time_us, rate_hz)[0].samples
    return {
        s.name: samples[round(s.start_s * rate_hz) : round(s.end_s * rate_hz)] for s in done.spans
    }


def seen(name: str, manner: str = "", **how: object) -> Verdict:
    read = parts(f"{name}~{manner}" if manner else name, **how)
    rest = read["static"] if STEP[name].rest_s else None
    return observe(STEP[name], rest, read[name], LAYOUT)


def one_after_another(*pieces: ImuSamples) -> ImuSamples:
    """At 100 Hz, as if without a break."""
    joined = [np.concatenate([getattr(p, name) for p in pieces]) for name in ImuSamples.__slots__]
    return ImuSamples(np.arange(len(joined[0])) * 10_000, *joined[1:])


def reading(verdict: Verdict, what: str, about: str | None = None) -> Reading:
    return next(r for r in verdict.readings if r.what == what and about in (None, r.about))


def silenced(samples: ImuSamples, *sensors: str) -> ImuSamples:
    valid = samples.valid.copy()
    valid[:, [LAYOUT.names.index(sensor) for sensor in sensors]] = False
    gyr, acc = (np.where(valid[..., None], x, 0.0) for x in (samples.gyr, samples.acc))
    return replace(samples, valid=valid, gyr=gyr, acc=acc)


@pytest.mark.parametrize(
    ("name", "person"),
    [
        *((name, 3) for name in SOME),
        ("elbow:flexion", 8),
        ("wrist:deviation", 8),
        ("index_mcp:flexion", 8),
        ("middle_mcp:abduction", 8),
        ("little_dip:flexion", 8),
    ],
)
def test_what_is_done_well_passes(name, person):
    verdict = seen(name, person=person)
    assert verdict.ok, verdict.failing
    assert verdict.step == name


@pytest.mark.parametrize(
    ("name", "manner", "what"),
    [
        ("index_mcp:flexion", "slow", "pace"),
        ("index_mcp:flexion", "small", "range"),
        ("index_mcp:flexion", "wrong_joint", "others"),
        ("index_mcp:flexion", "restless", "stillness"),
        ("middle_mcp:abduction", "small", "second_axis"),
        ("elbow:flexion", "wrong_joint", "others"),
        ("thumb_ip:flexion", "wrong_joint", "others"),
        ("heading_rotation", "slow", "pace"),
        ("heading_rotation", "small", "turn"),
        ("heading_rotation", "wrong_joint", "together"),
        ("heading_rotation", "restless", "stillness"),
        ("static", "restless", "stillness"),
        ("flat_hand", "restless", "stillness"),
    ],
)
def test_what_is_done_otherwise_is_refused_for_that(name, manner, what):
    verdict = seen(name, manner)
    assert verdict.failing[0].what == what
    assert {reading.what for reading in verdict.failing} == {what}


def test_the_joint_that_moved_along_is_named():
    assert reading(seen("elbow:flexion", "wrong_joint"), "others").about == "wrist"
    assert reading(seen("heading_rotation", "wrong_joint"), "together").about == "wrist"
    assert reading(seen("thumb_ip:flexion", "wrong_joint"), "others").about == "thumb_mcp"


def test_what_moves_along_by_nature_is_no_fault():
    turned = seen("ring_pip:flexion")
    assert reading(turned, "others").about != "ring_dip"
    assert reading(seen("ulnar_cmc:flexion"), "others").about != "little_mcp"


def test_swinging_far_too_fast_is_told_as_such():
    pace = reading(seen("elbow:flexion", "fast~fast"), "pace")
    demand = demand_of(STEP["elbow:flexion"])
    assert not pace.ok
    assert not pace.at_least
    assert pace.value == pytest.approx(2.25 * demand.pace, rel=0.1)
    assert reading(seen("elbow:flexion", "fast"), "pace").ok


def test_bending_a_finger_is_not_moving_it_to_the_side():
    bent = parts("index_mcp:flexion")
    step = STEP["index_mcp:abduction"]
    verdict = observe(step, bent["static"], bent["index_mcp:flexion"], LAYOUT)
    others = reading(verdict, "others")
    assert not others.ok
    assert others.about == "index_mcp"


@pytest.mark.parametrize("kind", ["fit", "noise", "tryout"])
def test_a_hand_that_lies_flat_passes_for(kind):
    step = next(s for course in COURSES.values() for s in course if s.kind == kind)
    flat = parts("flat_hand")["flat_hand"]
    verdict = observe(step, None, flat, LAYOUT)
    assert {reading.what for reading in verdict.failing} <= {"time"}


@pytest.mark.parametrize("name", [*SOME[:4], "middle_mcp:abduction", *OTHERS])
def test_any_window_is_judged_and_time_only_grows(name):
    read = parts(name if name in SOME else "index_mcp:flexion")
    done, rest = read.get(name, read.get("index_mcp:flexion")), read.get("static")
    cuts = [0, 1, 2, 3, 5, 8, 20, 77, *range(100, len(done), 250), len(done)]
    verdicts = [observe(STEP[name], rest, done[:cut], LAYOUT) for cut in cuts]
    orders = {tuple(r.what for r in verdict.readings) for verdict in verdicts}
    assert len(orders) == 1
    for verdict in verdicts:
        assert all(
            np.isfinite(r.share) or r.what in ("stillness", "upright") for r in verdict.readings
        )
    if name != "tryout":
        times = [verdict.readings[-1].value for verdict in verdicts]
        assert times == sorted(times)
        assert times[0] == 0.0
        assert not verdicts[0].ok


def test_nothing_is_blamed_on_a_sensor_before_anything_was_heard():
    for step in STEP.values():
        verdict = observe(step, None, parts("static")["static"][:0], LAYOUT)
        assert {reading.about for reading in verdict.readings} <= {"", "static"}


@pytest.mark.parametrize("name", ["elbow:flexion", "index_mcp:flexion", "thumb_cmc:abduction"])
def test_a_left_hand_is_judged_as_the_right_one_it_mirrors(name):
    right, left = (seen(name, side=side, with_="mounting") for side in ("right", "left"))
    for one, other in zip(right.readings, left.readings, strict=True):
        assert (one.what, one.about) == (other.what, other.about)
        # compasses are not mirrored with the hand
        assert one.value == pytest.approx(other.value, rel=0.02, abs=1.5)


def test_a_left_hand_lies_as_flat_as_a_right_one():
    read = parts("flat_hand", side="left")["flat_hand"]
    assert observe(FLAT, None, read, glove("left")).ok


def test_a_thousand_readings_a_second_make_the_same_figures():
    step, first = STEP["index_pip:flexion"], []
    for rate in (100, 1000):
        read = parts(step.name, with_="plain", rate_hz=rate)
        first.append(observe(step, read["static"], read[step.name][: 5 * rate], LAYOUT))
    assert first[1].ok
    for one, other in zip(*(verdict.readings for verdict in first), strict=True):
        close = 0.05 if one.what == "stillness" else 1.0
        assert other.value == pytest.approx(one.value, rel=0.03, abs=close)


def test_a_hand_that_keeps_still_does_not_swing_fast():
    read = parts("index_mcp:flexion")
    verdict = observe(STEP["index_mcp:flexion"], read["static"], read["static"], LAYOUT)
    assert reading(verdict, "pace").value == 0.0
    assert reading(verdict, "range").value < 1.0
    assert reading(verdict, "others").ok or reading(verdict, "others").about == "index_mcp"


@pytest.mark.parametrize("name", ["fit", "static", "heading_rotation", "flat_hand"])
def test_a_silent_sensor_is_named(name):
    read = parts("flat_hand" if name == "fit" else name)
    done = silenced(read.get(name, read.get("flat_hand")), "SN16")
    first = observe(STEP[name], None, done, LAYOUT).failing[0]
    assert (first.what, first.about, first.value) == ("answering", "SN16", 0.0)


def test_a_joint_without_a_sensor_cannot_be_judged():
    read = parts("index_pip:flexion")
    done = silenced(read["index_pip:flexion"], "SN16")
    verdict = observe(STEP["index_pip:flexion"], read["static"], done, LAYOUT)
    first, *others = verdict.failing
    assert (first.what, first.about) == ("answering", "SN16")
    assert np.isnan(next(r.value for r in others if r.what == "range"))


def test_a_silent_sensor_elsewhere_does_not_matter():
    read = parts("index_pip:flexion")
    rest, done = (silenced(read[k], "SN7") for k in ("static", "index_pip:flexion"))
    assert observe(STEP["index_pip:flexion"], rest, done, LAYOUT).ok


def test_another_sensor_of_the_segment_stands_in():
    read = parts("elbow:flexion")
    rest, done = (silenced(read[k], "SN1") for k in ("static", "elbow:flexion"))
    verdict = observe(STEP["elbow:flexion"], rest, done, LAYOUT)
    assert verdict.ok
    assert reading(verdict, "range").value == pytest.approx(
        reading(seen("elbow:flexion"), "range").value, rel=0.03
    )


def test_instants_that_are_missing_here_and_there_are_bridged():
    read = parts("index_mcp:flexion")
    done = read["index_mcp:flexion"]
    valid = np.random.default_rng(1).random(done.valid.shape) > 0.02
    gyr = np.where(valid[..., None], done.gyr, 0.0)
    holes = replace(done, valid=valid, gyr=gyr)
    verdict = observe(STEP["index_mcp:flexion"], read["static"], holes, LAYOUT)
    assert verdict.ok, verdict.failing


@pytest.mark.parametrize("length", [None, 0, 40])
def test_a_swing_without_a_rest_before_it_is_refused_for_that(length):
    read = parts("index_mcp:flexion")
    rest = None if length is None else read["static"][:length]
    verdict = observe(STEP["index_mcp:flexion"], rest, read["index_mcp:flexion"], LAYOUT)
    assert [(r.what, r.about) for r in verdict.failing] == [("time", "static")]


@pytest.mark.parametrize("sensor", ["SN11", "SN15", "SN18"])
def test_a_sensor_that_lies_on_its_side_is_named(sensor):
    flat = parts("flat_hand")["flat_hand"]
    acc = flat.acc.copy()
    index = LAYOUT.names.index(sensor)
    acc[:, index] = acc[:, index] * [-1.0, 1.0, -1.0]
    first = observe(FIT, None, replace(flat, acc=acc), LAYOUT).failing[0]
    assert (first.what, first.about) == ("upright", sensor)


def test_a_steady_turn_is_not_rest():
    still = parts("static")["static"]
    about_the_vertical = still.gyr + np.deg2rad([0.0, 0.0, 12.0])
    assert not observe(REST, None, replace(still, gyr=about_the_vertical), LAYOUT).ok


def test_lying_still_in_many_directions_is_counted():
    whole = parts("tumble", with_="plain")["tumble"]
    counts = [
        reading(observe(TUMBLE, None, whole[: round(share * len(whole))], LAYOUT), "directions")
        for share in (0.02, 0.3, 1.0)
    ]
    assert counts[0].value == 1.0
    assert 3.0 < counts[1].value < 9.0
    assert counts[2].ok
    assert counts[2].value <= 22.0


def test_a_step_stops_by_itself_when_it_is_good_and_long_enough():
    step = STEP["index_mcp:flexion"]
    good, bad = seen(step.name), seen(step.name, "small")
    assert not enough(good, step, 0.9 * step.least_s)
    assert enough(good, step, step.least_s)
    assert not enough(bad, step, step.least_s)
    assert enough(bad, step, step.most_s)


def test_a_turn_does_not_stop_by_itself_before_the_rig_is_laid_back():
    turned, rest = parts("heading_rotation")["heading_rotation"], parts("static")["static"]
    for after in (rest, turned):  # some lift it more than once
        whole = one_after_another(turned, after)
        verdicts = {upto: observe(TURN, rest, whole[:upto], LAYOUT) for upto in range(10, 240, 5)}
        first = next(upto for upto, each in verdicts.items() if enough(each, TURN, upto / 100.0))
        assert 0.88 * len(turned) <= first <= len(turned) + 20
    assert verdicts[160].ok  # all there is to see of it, but for its end
    assert not verdicts[160].over


def test_a_rig_that_is_held_up_is_not_laid_back():
    up, rest = parts("heading_rotation")["heading_rotation"][:80], parts("static")["static"]
    assert not observe(TURN, rest, one_after_another(up, rest), LAYOUT).over


@pytest.mark.parametrize("name", ["index_mcp:flexion", "elbow:flexion", "thumb_cmc:abduction"])
def test_stillness_around_a_swing_does_not_make_it_slow(name):
    read = parts(name)
    done, rest = read[name], read["static"]
    usual = reading(seen(name), "pace").value
    for around in ((done, rest, rest), (rest, rest, done), (done, rest, done[:80])):
        verdict = observe(STEP[name], rest, one_after_another(*around), LAYOUT)
        assert reading(verdict, "pace").value == pytest.approx(usual, rel=0.02)


def test_a_look_at_the_result_lasts_as_long_as_somebody_looks():
    verdict = observe(TRYOUT, None, parts("flat_hand")["flat_hand"], LAYOUT)
    assert verdict.ok
    assert not enough(verdict, TRYOUT, 30.0)
    assert enough(verdict, TRYOUT, TRYOUT.most_s)


def test_every_swing_has_its_demands():
    for step in SWINGS:
        demand = demand_of(step)
        assert demand.slowest < demand.pace < demand.fastest
        assert 0.0 < demand.others < 1.0
