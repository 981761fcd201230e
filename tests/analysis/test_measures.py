"""Each measure on signals whose answer is known, and where it must not answer."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from handstudio.analysis.change import changes
from handstudio.analysis.cycles import cycle_measures, cycles_of
from handstudio.analysis.extremes import extremes
from handstudio.analysis.finger_scores import finger_scores, strickland_grade, tam_grade
from handstudio.analysis.independence import independence_measures
from handstudio.analysis.kapandji import PLACES, clearances, kapandji_measures
from handstudio.analysis.measure import Kind, Measure
from handstudio.analysis.posture_time import Band, posture_measures
from handstudio.analysis.range_of_motion import ranges_of_motion
from handstudio.analysis.series import AngleSeries
from handstudio.analysis.smoothness import ldlj, smoothness_measures, sparc
from handstudio.analysis.speed import speeds, velocity
from handstudio.analysis.tables import GROUPS, grouped, written
from handstudio.analysis.tremor import spectrum_of, tremor_measures
from handstudio.analysis.unbroken import unbroken
from handstudio.hand.pose import Pose, posed
from handstudio.hand.skeleton import FINGERS, SEGMENTS, nominal_skeleton
from handstudio.maths import so3

RATE = 100.0


def seconds(length: float) -> np.ndarray:
    return np.arange(round(length * RATE)) / RATE


def series(time_s: np.ndarray, level_deg: float = 1.0, **angles_deg: np.ndarray) -> AngleSeries:
    values = np.deg2rad(
        np.stack([np.broadcast_to(a, time_s.shape) for a in angles_deg.values()], 1)
    )
    count = len(angles_deg)
    return AngleSeries(
        time_s,
        tuple(angles_deg),
        values.astype(float),
        np.full(values.shape, np.deg2rad(0.5)),
        np.full(count, np.deg2rad(level_deg)),
        np.full(count, 0.03),
    )


def found(measures: list[Measure], kind: str, about: str | None = None) -> Measure:
    (one,) = (m for m in measures if m.kind == kind and about in (None, m.about))
    return one


# --- stretches and extremes -----------------------------------------------------------------------


def test_stretches_end_at_gaps_and_at_what_is_unknown():
    time_s = np.delete(seconds(1.0), slice(40, 50))
    values = np.zeros(90)
    values[70] = np.nan
    assert unbroken(time_s, values) == [slice(0, 40), slice(40, 70), slice(71, 90)]
    assert unbroken(time_s, values, 0.3) == [slice(0, 40), slice(40, 70)]
    assert unbroken(time_s[:1], values[:1]) == []


def test_a_spike_is_no_extreme_and_a_held_value_is():
    values = np.zeros(200)
    values[50:52] = 9.0
    values[100:105] = 1.0
    got = extremes(seconds(2.0), values)
    assert got is not None
    assert (got.least, got.most) == (0.0, 1.0)
    assert 100 <= got.most_at < 105
    assert extremes(seconds(2.0), np.full(200, np.nan)) is None


def test_the_turning_point_of_a_fast_swing_is_kept_within_two_hundredths():
    time_s = seconds(4.0)
    got = extremes(time_s, np.sin(2 * np.pi * 2.0 * time_s))
    assert got is not None
    assert 0.98 < got.most <= 1.0


# --- ranges of motion -----------------------------------------------------------------------------


def test_a_range_has_its_norm_uncertainty_and_time():
    time_s = seconds(4.0)
    swing = 40.0 - 50.0 * np.cos(2 * np.pi * 0.5 * time_s)
    measures = ranges_of_motion(series(time_s, index_mcp_flexion=swing))
    least, most, span = (found(measures, kind) for kind in ("least", "most", "range"))
    assert least.value == pytest.approx(-10.0, abs=0.1)
    assert most.value == pytest.approx(90.0, abs=0.1)
    assert span.value == pytest.approx(100.0, abs=0.2)
    assert (least.norm, most.norm, span.norm) == (-45.0, 90.0, 135.0)
    assert least.deviation == pytest.approx(35.0, abs=0.1)
    assert most.at_s == pytest.approx(1.0, abs=0.05) or most.at_s == pytest.approx(3.0, abs=0.05)
    assert most.sd == pytest.approx(np.sqrt(0.5**2 + 1.0 + (0.03 * 90.0) ** 2), rel=0.01)
    assert most.detectable == pytest.approx(1.96 * np.sqrt(2.0) * most.sd, rel=1e-6)
    assert least.detectable == pytest.approx(1.96 * np.sqrt(2.0) * 2.0, rel=1e-6)


def test_the_uncertainty_grows_with_the_filters():
    time_s, angle = seconds(2.0), np.linspace(0.0, 60.0, 200)
    sure = series(time_s, index_pip_flexion=angle)
    unsure = AngleSeries(
        sure.time_s, sure.names, sure.angles, 8.0 * sure.sd, sure.level_sd, sure.share_sd
    )
    sds = [found(ranges_of_motion(each), "least").sd for each in (sure, unsure)]
    assert sds[1] == pytest.approx(np.hypot(4.0, 1.0), rel=0.01)
    assert sds[0] == pytest.approx(np.hypot(0.5, 1.0), rel=0.01)
    untold = AngleSeries(
        sure.time_s, sure.names, sure.angles, np.full_like(sure.sd, np.inf), sure.level_sd,
        sure.share_sd,
    )  # fmt: skip
    assert sds[0] < found(ranges_of_motion(untold), "least").sd < sds[1]


@pytest.mark.parametrize(
    ("name", "values", "why"),
    [
        ("elbow_flexion", np.nan, "no_start"),
        ("wrist_flexion", np.nan, "in_doubt"),
        ("wrist_flexion", np.where(np.arange(100) % 3, 10.0, np.nan), "gaps"),
    ],
)
def test_an_angle_that_is_never_known_has_no_range_but_a_reason(name, values, why):
    (measure,) = ranges_of_motion(series(seconds(1.0), **{name: values}))
    assert (measure.value, measure.sd, measure.why) == (None, None, why)
    assert written(measure) == "–"


# --- scores ---------------------------------------------------------------------------------------


def test_scores_of_a_finger_take_what_it_lacks_from_what_it_bends():
    time_s = seconds(4.0)
    closed = 0.5 - 0.5 * np.cos(2 * np.pi * 0.25 * time_s)
    hand = series(
        time_s,
        index_mcp_flexion=-20.0 + 105.0 * closed,  # hyperextension counts as nothing
        index_pip_flexion=30.0 + 60.0 * closed,  # lacks 30
        index_dip_flexion=60.0 * closed,
    )
    scores = finger_scores(hand)
    tam, strickland = found(scores, "tam", "index"), found(scores, "strickland", "index")
    assert tam.value == pytest.approx(85.0 + 90.0 + 60.0 - 30.0, abs=0.3)
    assert tam.grade == "good"
    assert tam.details["deficit_deg"] == pytest.approx(30.0, abs=0.2)
    assert strickland.value == pytest.approx(100.0 * (90.0 + 60.0 - 30.0) / 175.0, abs=0.2)
    assert strickland.grade == "fair"
    assert tam.sd > found(ranges_of_motion(hand), "most", "index_dip_flexion").sd / np.sqrt(2.0)
    assert found(scores, "tam", "ring").why == "no_sensor"


def test_grades_change_where_their_source_says():
    grades = [tam_grade(share) for share in (1.0, 0.99, 0.75, 0.5)]
    assert grades == ["excellent", "good", "fair", "poor"]
    grades = [strickland_grade(share) for share in (0.85, 0.84, 0.69, 0.49)]
    assert grades == ["excellent", "good", "fair", "poor"]


def opposing(stage: int, side: str) -> Pose:
    """The flat hand with its thumb's tip where it touches a stage's place."""
    skeleton = nominal_skeleton(side)
    q = np.tile(so3.IDENTITY, (1, len(SEGMENTS), 1))
    pose = posed(skeleton, q)
    place = PLACES[stage - 1]
    k = SEGMENTS.index(place.segment)
    length = skeleton.length_m[k] * place.span[-1]
    at = pose.t_world_joint[0, k] + [0.0, length, 0.0]
    thick = (place.half + 0.045) * 0.187
    sideways = -1.0 if side == "right" else 1.0
    away = np.array([sideways, 0.0, 0.0]) if place.radial else np.array([0.0, 0.0, -1.0])
    tip = at + thick * away
    joints, tips = pose.t_world_joint.copy(), pose.t_world_tip.copy()
    tips[0, 0] = tip
    joints[0, SEGMENTS.index("thumb_distal")] = tip + 0.03 * away
    return Pose(q, joints, tips)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("stage", [1, 2, 3, 6, 8, 9, 10])
def test_the_thumb_touches_what_it_touches(stage, side):
    skeleton = nominal_skeleton(side)
    gap = clearances(opposing(stage, side), skeleton.length_m, 0.187, side)[0]
    assert gap[stage - 1] == pytest.approx(0.0, abs=0.001)
    time_s = seconds(0.5)
    count = len(time_s)
    score, pronation = kapandji_measures(
        time_s, np.tile(gap, (count, 1)), np.full(count, 0.6), np.full(count, 0.05)
    )
    assert score.value in (stage, stage + 1)  # the creases of 9 and 10 lie side by side
    assert score.low <= score.value <= score.high
    assert pronation.value == pytest.approx(np.rad2deg(0.6))


def test_a_thumb_that_touches_nothing_scores_zero():
    time_s = seconds(0.5)
    far = np.full((len(time_s), 10), 0.05)
    (score,) = kapandji_measures(time_s, far, np.zeros(len(time_s)), np.zeros(len(time_s)))
    assert (score.value, score.low, score.high, score.at_s) == (0.0, 0.0, 0.0, None)
    (unknown,) = kapandji_measures(time_s, far * np.nan, np.zeros(len(time_s)), np.zeros(50))
    assert (unknown.value, unknown.why) == (None, "in_doubt")


# --- repetitions, speed, smoothness ---------------------------------------------------------------


def test_repetitions_are_counted_between_rests_and_their_period_is_that_of_moving():
    time_s = seconds(13.0)
    moving = (time_s > 2.0) & (time_s < 12.0)
    swing = np.where(moving, 30.0 - 30.0 * np.cos(2 * np.pi * 0.5 * (time_s - 2.0)), 0.0)
    swing += 0.05 * np.random.default_rng(3).standard_normal(len(time_s))
    hand = series(time_s, wrist_flexion=swing)
    cycles = cycles_of(time_s, hand.of("wrist_flexion"))
    measures = cycle_measures(hand, "wrist_flexion", cycles)
    assert found(measures, "cycles").value == 5
    assert found(measures, "cycle_amplitude").value == pytest.approx(60.0, abs=0.3)
    assert found(measures, "cycle_period").value == pytest.approx(2.0, abs=0.01)
    assert found(measures, "cycle_period_cv").value < 1.0
    assert (cycles.ways[:, 0] > 195).all()  # the rest before the first is no part of it


def test_uneven_repetitions_vary_by_as_much_as_they_do():
    sizes = np.array([30.0, 40.0, 50.0, 40.0, 30.0, 50.0])
    time_s = seconds(6.0)
    swing = np.concatenate([0.5 * s * (1 - np.cos(2 * np.pi * seconds(1.0))) for s in sizes])
    hand = series(time_s, index_pip_flexion=swing)
    measures = cycle_measures(hand, "index_pip_flexion", cycles_of(time_s, np.deg2rad(swing)))
    varied = 100.0 * sizes.std(ddof=1) / sizes.mean()
    assert found(measures, "cycle_amplitude_cv").value == pytest.approx(varied, abs=0.5)


def test_small_swings_and_gaps_are_no_repetitions():
    time_s = seconds(8.0)
    small = np.deg2rad(4.0) * np.sin(2 * np.pi * time_s)
    assert len(cycles_of(time_s, small)) == 0
    large = 10.0 * small
    large[::40] = np.nan
    assert len(cycles_of(time_s, large)) == 0


def test_speed_of_a_swing_is_its_slope():
    time_s = seconds(5.0)
    swing = 45.0 * np.sin(2 * np.pi * 5.0 * time_s) / 5.0
    hand = series(time_s, index_mcp_flexion=swing)
    rates = velocity(time_s, hand.of("index_mcp_flexion"))
    assert np.nanmax(np.rad2deg(rates)) == pytest.approx(2 * np.pi * 45.0, rel=0.01)
    slow = series(time_s, index_mcp_flexion=45.0 * np.sin(2 * np.pi * 0.5 * time_s))
    rates = velocity(time_s, slow.of("index_mcp_flexion"))
    peak, mean = speeds(slow, "index_mcp_flexion", rates, 2.5)
    assert peak.value == pytest.approx(np.pi * 45.0, rel=0.01)
    assert mean.value == pytest.approx(2.0 * 45.0, rel=0.06)  # slower than 10 deg/s is no moving
    still = series(time_s, index_mcp_flexion=0.0 * time_s)
    _, none = speeds(
        still, "index_mcp_flexion", velocity(time_s, still.of("index_mcp_flexion")), 0.0
    )
    assert none.why == "no_movement"


def minimum_jerk(length: float) -> np.ndarray:
    share = seconds(length) / length
    return 30.0 * share**2 * (1.0 - share) ** 2 / length


@pytest.mark.parametrize("length", [0.8, 2.0])
def test_a_movement_of_least_jerk_is_as_smooth_as_is_known(length):
    speed = minimum_jerk(length)
    assert ldlj(speed, RATE) == pytest.approx(-np.log(204.8), abs=0.25)
    assert sparc(speed, RATE) == pytest.approx(-1.41, abs=0.03)


def test_a_movement_with_stops_is_less_smooth():
    stops = np.tile(minimum_jerk(0.5), 4)
    assert sparc(stops, RATE) < sparc(minimum_jerk(2.0), RATE) - 1.0
    assert ldlj(stops, RATE) < ldlj(minimum_jerk(2.0), RATE) - 3.0
    assert np.isnan(sparc(np.zeros(50), RATE))
    assert np.isnan(ldlj(np.zeros(50), RATE))


def test_smoothness_is_a_mean_over_ways_to_and_fro():
    time_s = seconds(10.0)
    values = np.deg2rad(30.0 - 30.0 * np.cos(2 * np.pi * 0.5 * time_s))
    rates = velocity(time_s, values)
    one, other = smoothness_measures("wrist_flexion", rates, cycles_of(time_s, values), RATE)
    assert (one.kind, other.kind) == ("sparc", "ldlj")
    assert one.details["movements"] >= 8
    assert one.sd < 0.05
    none, _ = smoothness_measures("wrist_flexion", rates * 0, cycles_of(time_s, values * 0), RATE)
    assert none.why == "no_movement"


# --- tremor ---------------------------------------------------------------------------------------


def test_a_tremor_is_found_with_its_frequency_and_size():
    time_s = seconds(20.0)
    noise = 0.01 * np.random.default_rng(5).standard_normal(len(time_s))
    held = 3.0 * np.sin(2 * np.pi * 0.1 * time_s)
    hand = series(time_s, wrist_flexion=held + 0.2 * np.sin(2 * np.pi * 5.3 * time_s) + noise)
    spectrum = spectrum_of(time_s, hand.of("wrist_flexion"))
    amplitude, frequency = tremor_measures(hand, "wrist_flexion", spectrum)
    assert amplitude.value == pytest.approx(0.2 / np.sqrt(2.0), rel=0.05)
    assert frequency.value == pytest.approx(5.3, abs=0.1)


@pytest.mark.parametrize("seed", range(8))
def test_noise_is_no_tremor(seed):
    time_s = seconds(10.0)
    noise = 0.01 * np.random.default_rng(seed).standard_normal(len(time_s))
    hand = series(time_s, wrist_flexion=noise)
    spectrum = spectrum_of(time_s, hand.of("wrist_flexion"))
    _, frequency = tremor_measures(hand, "wrist_flexion", spectrum)
    assert frequency.why == "no_peak"


def test_overtones_of_a_movement_are_no_tremor():
    time_s = seconds(12.0)
    square = 20.0 * np.sign(np.sin(2 * np.pi * 1.0 * time_s))
    hand = series(time_s, wrist_flexion=square)
    (amplitude,) = tremor_measures(
        hand, "wrist_flexion", spectrum_of(time_s, hand.of("wrist_flexion"))
    )
    assert amplitude.why == "moving"


@pytest.mark.parametrize(("length", "every", "why"), [(2.0, 0, "too_short"), (20.0, 100, "gaps")])
def test_too_little_for_a_spectrum_is_said(length, every, why):
    time_s = seconds(length)
    values = np.zeros(len(time_s))
    if every:
        values[::every] = np.nan
    hand = series(time_s, wrist_flexion=values)
    (measure,) = tremor_measures(
        hand, "wrist_flexion", spectrum_of(time_s, hand.of("wrist_flexion"))
    )
    assert measure.why == why


# --- independence, postures -----------------------------------------------------------------------


def moving_in_turn(spill: float) -> tuple[AngleSeries, list[tuple[float, float, str]]]:
    """Each finger four times, the others following by a share."""
    one = 30.0 - 30.0 * np.cos(2 * np.pi * 1.0 * seconds(4.0))
    time_s = seconds(16.0)
    fingers = FINGERS[1:]
    parts = {f: np.concatenate([one if f == g else spill * one for g in fingers]) for f in fingers}
    angles = {
        f"{f}_{joint}_flexion": parts[f] / 3.0 for f in fingers for joint in ("mcp", "pip", "dip")
    }
    labels = [(4.0 * n, 4.0 * n + 4.0, f"{f}_mcp:flexion") for n, f in enumerate(fingers)]
    return series(time_s, **angles), labels


@pytest.mark.parametrize("labelled", [True, False])
def test_fingers_that_follow_by_a_share_are_independent_by_the_rest(labelled):
    hand, labels = moving_in_turn(0.25)
    measures = independence_measures(hand, labels if labelled else ())
    for finger in FINGERS[1:]:
        assert found(measures, "individuation", finger).value == pytest.approx(0.75, abs=0.01)
        assert found(measures, "stationarity", finger).value == pytest.approx(0.75, abs=0.01)


def test_a_fist_says_nothing_of_independence_unless_it_was_meant_otherwise():
    hand, labels = moving_in_turn(1.0)
    assert {m.why for m in independence_measures(hand)} == {"no_movement"}
    measures = independence_measures(hand, labels)
    assert found(measures, "individuation", "index").value == pytest.approx(0.0, abs=0.01)


def test_time_in_a_posture_is_a_share_of_the_known_time():
    time_s = seconds(10.0)
    wrist = np.where(time_s < 2.0, 30.0, 0.0)
    wrist[time_s >= 8.0] = np.nan
    bands = (Band("bent", "wrist_flexion", above_deg=15.0), Band("there", "elbow_flexion", 1.0))
    bent, there = posture_measures(series(time_s, wrist_flexion=wrist), bands)
    assert bent.value == pytest.approx(25.0)
    assert bent.sd == 0.0
    assert there.why == "no_sensor"
    (ramp,) = posture_measures(series(time_s, wrist_flexion=np.linspace(0, 30, 1000)), bands[:1])
    assert ramp.value == pytest.approx(50.0, abs=0.2)
    assert ramp.sd == pytest.approx(100.0 * 1.2 / 30.0, abs=0.5)


# --- change, tables -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("now", "verdict"), [(80.0, "no detectable change"), (96.0, "more"), (64.0, "less")]
)
def test_a_change_counts_beyond_what_measuring_twice_would_give(now, verdict):
    before = Measure("most", "wrist_flexion", 80.0, "deg", sd=2.0, detectable=10.0)
    after = Measure("most", "wrist_flexion", now, "deg", sd=3.0, detectable=14.0)
    (change,) = changes([before], [after])
    assert change.verdict == verdict
    assert change.detectable == pytest.approx(np.sqrt((100.0 + 196.0) / 2.0))
    assert change.difference == now - 80.0


def test_what_has_no_limit_is_not_judged_and_what_is_missing_is_no_change():
    before = [Measure("sparc", "a", -2.0, ""), Measure("sparc", "b", None, "", why="gaps")]
    after = [Measure("sparc", "a", -1.5, ""), Measure("sparc", "b", -2.0, "")]
    (change,) = changes(before, after)
    assert (change.about, change.verdict) == ("a", "not judged")


def test_every_kind_has_a_place_in_a_table():
    kinds = [kind for kinds in GROUPS.values() for kind in kinds]
    assert sorted(kinds) == sorted(get_args(Kind))
    measures = [Measure(kind, "index", 1.0, "") for kind in kinds]
    assert [group.name for group in grouped(measures)] == list(GROUPS)
