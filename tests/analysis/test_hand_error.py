"""Figures of an accuracy bench against errors put in by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.analysis.hand_error import (
    HandPoints,
    angle_errors,
    common_heading,
    hand_points,
    heading_scatter,
    point_errors,
    sensor_errors,
    with_heading,
)
from handstudio.hand.pose import posed
from handstudio.hand.skeleton import SEGMENTS, nominal_skeleton
from handstudio.maths import so3

N, S = 40, 4
X = np.array([1.0, 0.0, 0.0])
NAMES = ("SN1", "SN4", "SN11", "SN17")

rng = np.random.default_rng(6)
Q_REF = so3.normalize(rng.normal(size=(N, S, 4)))


def cost(q_est: np.ndarray) -> float:
    """Sum of sin²(error/2)."""
    return float(np.sum(np.sin(0.5 * so3.angle_between(Q_REF, q_est)) ** 2))


# --- the common heading -----------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [0.0, 5.0, -75.0, 179.0, 180.0])
def test_an_offset_that_all_share_is_found_and_nothing_is_left(degrees):
    off = with_heading(np.deg2rad(degrees), Q_REF)
    found = common_heading(Q_REF, off)
    assert np.cos(found + np.deg2rad(degrees)) == pytest.approx(1.0, abs=1e-12)
    assert so3.angle_between(with_heading(found, off), Q_REF).max() < 1e-7


@given(seed=st.integers(0, 10_000), size=st.floats(0.0, 2.0), nudge=st.floats(-3.1, 3.1))
def test_no_other_offset_brings_the_estimate_nearer(seed, size, nudge):
    noise = np.random.default_rng(seed).normal(size=(N, S, 3))
    off = with_heading(1.1, so3.multiply(so3.exp(size * noise), Q_REF))
    found = common_heading(Q_REF, off)
    best = cost(with_heading(found, off))
    assert best <= cost(with_heading(found + nudge, off)) + 1e-9


def test_the_sign_of_a_quaternion_and_its_length_do_not_matter():
    signs = rng.choice([-1.0, 0.9], size=(N, S, 1))
    off = with_heading(0.4, Q_REF)
    assert common_heading(1.1 * Q_REF, signs * off) == pytest.approx(-0.4, abs=1e-12)


def test_an_orientation_that_is_upside_down_says_nothing_about_the_heading():
    off = with_heading(0.3, Q_REF)
    half_turn = so3.from_axis_angle(X, np.pi)
    off[:, 0] = so3.multiply(half_turn, Q_REF[:, 0])
    assert common_heading(Q_REF, off) == pytest.approx(-0.3, abs=1e-12)


def test_what_is_not_known_is_left_out():
    off = with_heading(0.3, Q_REF)
    off[:5] = np.nan
    reference = Q_REF.copy()
    reference[5:9, 1] = np.nan
    off[5:9, 1] = so3.IDENTITY
    assert common_heading(reference, off) == pytest.approx(-0.3, abs=1e-12)
    with pytest.raises(ValueError, match="known"):
        common_heading(np.full_like(Q_REF, np.nan), Q_REF)


# --- sensors ----------------------------------------------------------------------------------


def test_each_sensor_has_its_own_error_after_what_all_share_is_out():
    tilt = np.deg2rad([0.0, 3.0, 8.0, 1.0])
    off = with_heading(-2.0, so3.multiply(so3.from_axis_angle(X, tilt), Q_REF))
    found = sensor_errors(NAMES, Q_REF, off)
    assert found.heading_offset == pytest.approx(2.0)
    totals = [error.total for error in found.errors]
    np.testing.assert_allclose(totals, tilt, atol=1e-7)
    assert [error.heading for error in found.errors] == pytest.approx([0.0] * S, abs=1e-7)
    assert found.mean == pytest.approx(np.deg2rad(3.0))
    assert found.worst == ("SN11", pytest.approx(np.deg2rad(8.0)))
    assert found.names == NAMES


def test_what_was_not_estimated_counts_for_no_sensor():
    off = so3.multiply(so3.from_axis_angle(X, np.deg2rad(4.0)), Q_REF)
    off[7, 2] = np.nan
    totals = [error.total for error in sensor_errors(NAMES, Q_REF, off).errors]
    np.testing.assert_allclose(totals, np.deg2rad(4.0))
    off[:, 2] = np.nan
    with pytest.raises(ValueError, match="no instant"):
        sensor_errors(NAMES, Q_REF, off)


def test_the_scatter_between_sensors_is_the_sd_of_their_mean_headings():
    headings = np.deg2rad([1.0, -2.0, 4.0, 0.5])
    wander = np.deg2rad(5.0) * np.sin(np.arange(N))[:, None]
    wander -= wander.mean()
    off = so3.multiply(so3.about_z(headings + wander), Q_REF)
    assert heading_scatter(Q_REF, off) == pytest.approx(np.std(headings), rel=1e-2)


def test_what_sensors_share_is_no_scatter_also_at_180_degrees():
    off = with_heading(np.pi, Q_REF)
    assert heading_scatter(Q_REF, off) == pytest.approx(0.0, abs=1e-7)
    apart = so3.multiply(so3.about_z(np.pi + np.deg2rad([2.0, -2.0, 2.0, -2.0])), Q_REF)
    assert np.rad2deg(heading_scatter(Q_REF, apart)) == pytest.approx(2.0, rel=1e-3)


def test_a_sensor_that_is_never_known_has_no_heading():
    off = Q_REF.copy()
    off[:, 1] = np.nan
    with pytest.raises(ValueError, match="a sensor"):
        heading_scatter(Q_REF, off)


# --- angles -----------------------------------------------------------------------------------


def test_errors_of_angles_go_the_shorter_way_round():
    reference = np.deg2rad([[179.0, 10.0], [-179.0, 20.0]])
    estimate = np.deg2rad([[-179.0, 13.0], [177.0, 16.0]])
    found = angle_errors(("turn", "flexion"), reference, estimate)
    expected = np.deg2rad([np.sqrt((4.0 + 16.0) / 2.0), np.sqrt((9.0 + 16.0) / 2.0)])
    np.testing.assert_allclose(found.rmse, expected)
    assert found.mean == pytest.approx(expected.mean())
    assert found.worst == ("flexion", pytest.approx(expected[1]))


def test_an_angle_that_is_never_known_is_told_as_such_and_counts_in_no_mean():
    reference = np.zeros((3, 3))
    estimate = np.array([[0.1, np.nan, 0.2], [0.1, np.nan, np.nan], [0.1, np.nan, 0.2]])
    found = angle_errors(("a", "b", "c"), reference, estimate)
    assert np.isnan(found.rmse[1])
    assert found.mean == pytest.approx(0.15)
    assert found.worst == ("c", pytest.approx(0.2))
    with pytest.raises(ValueError, match="no angle"):
        angle_errors(("b",), reference[:, 1:2], estimate[:, 1:2])


# --- points -----------------------------------------------------------------------------------

SKELETON = nominal_skeleton("right")


def attitudes() -> np.ndarray:
    return so3.exp(np.random.default_rng(2).normal(size=(N, len(SEGMENTS), 3)) * 0.3)


def test_right_points_have_no_error():
    points = hand_points(posed(SKELETON, attitudes()))
    errors = point_errors(points, points)
    assert errors.from_elbow == errors.in_hand == (0.0,) * 5


def test_a_hand_that_is_turned_and_shifted_as_a_whole_errs_from_the_elbow_alone():
    q = attitudes()
    reference = hand_points(posed(SKELETON, q))
    turn = so3.exp(np.array([0.02, -0.03, 0.05]))
    moved = posed(SKELETON, so3.multiply(turn, q))
    estimate = hand_points(moved)
    errors = point_errors(reference, estimate)
    expected = np.linalg.norm(
        so3.rotate(turn, reference.t_world_tip) - reference.t_world_tip, axis=-1
    )
    np.testing.assert_allclose(errors.from_elbow, np.sqrt((expected**2).mean(axis=0)), rtol=1e-9)
    assert min(errors.from_elbow) > 5e-3
    assert max(errors.in_hand) < 1e-12


def test_one_bent_finger_errs_alone_and_by_its_chord_in_both_frames():
    q = attitudes()
    bent = q.copy()
    segment = SEGMENTS.index("index_distal")
    axis = so3.rotate(q[:, segment], X)
    bent[:, segment] = so3.multiply(so3.from_axis_angle(axis, 0.2), q[:, segment])
    errors = point_errors(hand_points(posed(SKELETON, q)), hand_points(posed(SKELETON, bent)))
    chord = 2.0 * np.sin(0.1) * np.linalg.norm(SKELETON.t_distal_tip[1])
    expected = (0.0, chord, 0.0, 0.0, 0.0)
    np.testing.assert_allclose(errors.from_elbow, expected, atol=1e-12)
    np.testing.assert_allclose(errors.in_hand, expected, atol=1e-12)


def test_points_in_the_hand_are_written_with_each_clouds_own_hand():
    q_hand = so3.about_z(np.array([np.pi / 2]))
    tips = np.tile([1.0, 2.0, 3.0], (1, 5, 1))
    points = HandPoints(tips, q_hand, np.array([[1.0, 1.0, 3.0]]))
    np.testing.assert_allclose(points.t_hand_tip[0, 0], [1.0, 0.0, 0.0], atol=1e-12)


def test_instants_without_a_reference_do_not_count_and_a_tip_without_any_has_no_figure():
    tips = np.zeros((2, 5, 3))
    reference = HandPoints(tips.copy(), np.tile(so3.IDENTITY, (2, 1)), np.zeros((2, 3)))
    estimate = HandPoints(
        tips + np.array([3e-3, 0.0, 4e-3]), reference.q_world_hand, reference.t_world_hand
    )
    reference.t_world_tip[0, :] = np.nan
    reference.t_world_tip[:, 4] = np.nan
    errors = point_errors(reference, estimate)
    np.testing.assert_allclose(errors.from_elbow, [5e-3] * 4 + [np.nan])
    np.testing.assert_allclose(errors.in_hand, [5e-3] * 4 + [np.nan])
