"""Ways to a joint: what holds for all of them, and what each is for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.estimate import JointEstimate, apart_m, independent
from handstudio.trackers.helical import helical_axes
from handstudio.trackers.least_variance import variance
from handstudio.trackers.methods import METHODS, Method, estimated, method_named
from handstudio.trackers.pair import Pair, joined, pair_of
from handstudio.trackers.plane import Plane, middle_plane
from handstudio.trackers.rolling import NOTHING, Known, rolling
from handstudio.trackers.steady_axis import steady_axis
from handstudio.trackers.study import study
from handstudio.trackers.track import Track

from .hinges import AXIS, CENTRE_LOWER, CENTRE_UPPER, Hinge, hinge

ALL = list(METHODS.values())
NAMES = list(METHODS)


def pair_from(bent: Hinge) -> Pair:
    rest = bent.upper.time_us < 3_000_000
    return pair_of(bent.upper, bent.lower, rest, ~rest)


@pytest.fixture(scope="module")
def exact() -> Pair:
    return pair_from(hinge())


@pytest.fixture(scope="module")
def pair(noisy: Hinge) -> Pair:
    return pair_from(noisy)


def _estimate(pair: Pair, method: Method) -> JointEstimate:
    if method.name == "rolling":
        return rolling(pair, middle_plane(pair), NOTHING)
    return estimated(pair, method, width=AXIS)


@pytest.mark.parametrize("method", ALL, ids=NAMES)
def test_a_hinge_is_found_exactly_but_for_the_place_along_it(exact: Pair, method: Method) -> None:
    found = _estimate(exact, method)
    upper, lower = found.p_upper - CENTRE_UPPER, found.p_lower - CENTRE_LOWER
    axis = hinge().axis_upper
    axis_lower = so3.rotate(so3.conjugate(exact.rest_q_upper_lower), axis)
    within = 1e-4 if method.name == "rolling" else 2e-5  # it is tied, weakly, to what is usual
    assert np.linalg.norm(upper - axis * (axis @ upper)) < within
    assert np.linalg.norm(lower - axis_lower * (axis_lower @ lower)) < within
    assert np.degrees(np.arccos(min(1.0, abs(found.axis_upper @ axis)))) < 0.01
    assert found.axis_upper @ axis > 0.0


@pytest.mark.parametrize("method", ALL, ids=NAMES)
def test_noise_of_a_tracker_moves_a_hinge_by_less_than_a_third_of_a_millimetre(
    pair: Pair, noisy: Hinge, method: Method
) -> None:
    off = _estimate(pair, method).p_upper - noisy.centre_upper
    across = off - noisy.axis_upper * (noisy.axis_upper @ off)
    assert np.linalg.norm(across) < 3e-4


@pytest.mark.parametrize("method", ALL, ids=NAMES)
def test_where_the_tracker_stands_does_not_matter(noisy: Hinge, method: Method) -> None:
    q, t = so3.exp(np.array([0.4, -1.0, 0.7])), np.array([0.5, -0.2, 0.3])

    def moved(track: Track) -> Track:
        return replace(
            track,
            t_room_terminal=t + so3.rotate(q, track.t_room_terminal),
            q_room_terminal=so3.multiply(q, track.q_room_terminal),
        )

    here = estimated(pair_from(noisy), method, width=AXIS)
    there = replace(noisy, upper=moved(noisy.upper), lower=moved(noisy.lower))
    other = estimated(pair_from(there), method, width=so3.rotate(q, AXIS))
    np.testing.assert_allclose(other.p_upper, here.p_upper, atol=3e-6)
    np.testing.assert_allclose(other.upper_covariance, here.upper_covariance, atol=1e-8)


@pytest.mark.parametrize("name", ["rolling", "symmetric"])
def test_what_is_not_known_is_said_to_be_not_known(pair: Pair, name: str) -> None:
    """Along a hinge nobody can tell; across it all can."""
    found = _estimate(pair, METHODS[name])
    axis = found.axis_upper
    along = np.sqrt(axis @ found.upper_covariance @ axis)
    across = np.sqrt(np.sort(np.linalg.eigvalsh(found.upper_covariance))[1])
    assert along > 3e-3
    assert across < 1.5e-3
    assert along > 4.0 * across


@pytest.mark.parametrize("name", ["plane", "symmetric"])
def test_the_uncertainty_told_is_the_scatter_seen(name: str) -> None:
    errors, told = [], []
    for seed in range(12):
        bent = hinge(3e-4, np.deg2rad(0.2), seed=seed, seconds=8.0, rate_hz=40.0)
        found = estimated(pair_from(bent), METHODS[name])
        across = np.eye(3) - np.outer(bent.axis_upper, bent.axis_upper)
        errors.append(np.sum((across @ (found.p_upper - bent.centre_upper)) ** 2))
        told.append(np.trace(across @ found.upper_covariance @ across))
    ratio = np.mean(errors) / np.mean(told)
    assert 0.4 < ratio < 2.5  # of 24 degrees of freedom, five sixths of the time


@pytest.mark.parametrize("name", ["rolling", "steady", "helical"])
def test_a_joint_that_is_hardly_bent_is_refused(name: str) -> None:
    pair = pair_from(hinge(1e-4, np.deg2rad(0.1), far=0.05))
    with pytest.raises(TrackError) as told:
        estimated(pair, METHODS[name])
    assert "Bend it further" in told.value.remedy


def test_the_axis_classes_hold_every_large_turn_once(pair: Pair) -> None:
    axes = steady_axis(pair, width=AXIS)
    assert axes.counts.sum() == np.isfinite(axes.along).sum()
    assert axes.counts.max() == axes.used.sum()
    assert len(axes.counts) == 100
    assert axes.fullest == 99
    assert axes.share(0.99) > 0.95
    low, high = axes.between
    assert np.all((axes.along[axes.used] >= low) & (axes.along[axes.used] <= high))


def test_small_turns_have_no_axis(pair: Pair) -> None:
    axes = steady_axis(pair, width=AXIS, small=np.deg2rad(20.0))
    assert np.isnan(axes.along[axes.angle < np.deg2rad(20.0)]).all()
    assert not axes.used[axes.angle < np.deg2rad(20.0)].any()


def test_an_axis_aside_is_in_another_class(pair: Pair) -> None:
    aside = so3.rotate(so3.exp(np.array([0.0, 0.0, np.arccos(0.975)])), AXIS)
    assert abs(steady_axis(pair, width=aside).between[0] - 0.97) < 0.015


def test_coordinates_in_a_plane_and_back() -> None:
    rng = np.random.default_rng(3)
    plane = Plane(*rng.standard_normal((3, 3)))
    v = rng.standard_normal(3)
    foot = plane.foot(v)
    np.testing.assert_allclose(plane.at(plane.coordinates(foot)), foot, atol=1e-12)
    np.testing.assert_allclose(plane.sides @ (v - foot), 0.0, atol=1e-12)


def test_three_points_in_a_row_are_no_plane() -> None:
    with pytest.raises(TrackError, match="lie in a row"):
        Plane(np.zeros(3), np.ones(3), 2.0 * np.ones(3))


def test_no_point_of_the_plane_has_less_variance(pair: Pair) -> None:
    plane = middle_plane(pair)
    found = estimated(pair, METHODS["plane"]).p_upper
    least = variance(pair.t_upper_lower, found)
    for w in 2e-4 * np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1]]):
        assert variance(pair.t_upper_lower, found + w @ plane.sides / 0.01) > least


def test_a_joint_that_rolls_under_sliding_skin_is_found_by_ours_and_not_by_a_hinge() -> None:
    """The centre wanders by 1.5 mm/rad in one terminal's frame, by 1 in the other's."""
    bent = hinge(5e-5, np.deg2rad(0.05))
    pair = pair_from(bent)
    flexion = pair.turn @ bent.axis_upper
    mean = float(flexion.mean())
    along = pair.rest_t_upper_lower / np.linalg.norm(pair.rest_t_upper_lower)
    along_lower = so3.rotate(so3.conjugate(pair.rest_q_upper_lower), along)
    upper = -1.5e-3 * (flexion - mean)[:, None] * along
    lower = 1.0e-3 * (flexion - mean)[:, None] * along_lower
    slid = pair.t_upper_lower + upper - so3.rotate(pair.q_upper_lower, lower)
    pair = replace(pair, t_upper_lower=slid)
    palm = np.cross(bent.axis_upper, along)
    depth = float(palm @ bent.centre_upper)
    ours = rolling(pair, middle_plane(pair), Known(depth_m=abs(depth)))
    hinged = estimated(pair, METHODS["symmetric"])
    across = np.eye(3) - np.outer(bent.axis_upper, bent.axis_upper)
    off, worse = (
        float(np.linalg.norm(across @ (each.p_upper - bent.centre_upper)))
        for each in (ours, hinged)
    )
    assert off < 1e-3
    assert worse > 2e-3
    assert apart_m(ours, pair) < 3e-4


def test_frames_in_which_a_terminal_was_pushed_do_not_move_ours(noisy: Hinge) -> None:
    def knocked(track: Track) -> Track:
        t, q = track.t_room_terminal.copy(), track.q_room_terminal.copy()
        for start in (200, 330, 520, 800):
            t[start : start + 25] += [0.003, 0.004, -0.003]
            tilt = so3.exp(np.array([0.1, -0.15, 0.2]))
            q[start : start + 25] = so3.multiply(q[start : start + 25], tilt)
        return replace(track, t_room_terminal=t, q_room_terminal=q)

    clean, pushed = (
        rolling(pair_from(each), None, NOTHING)
        for each in (noisy, replace(noisy, lower=knocked(noisy.lower)))
    )
    across = np.eye(3) - np.outer(noisy.axis_upper, noisy.axis_upper)
    assert np.linalg.norm(across @ (pushed.p_upper - clean.p_upper)) < 4e-4


def test_finite_helical_axes_of_a_hinge_all_are_its_axis(exact: Pair) -> None:
    axes = helical_axes(exact)
    axis = hinge().axis_upper
    np.testing.assert_allclose(np.abs(axes.direction @ axis), 1.0, atol=1e-9)
    np.testing.assert_allclose(axes.slide, 0.0, atol=1e-12)
    off = axes.point - CENTRE_UPPER
    off = off - (off @ axis)[:, None] * axis
    np.testing.assert_allclose(off, 0.0, atol=1e-9)


def test_exchanging_the_terminals_exchanges_what_is_found(pair: Pair) -> None:
    twice = pair.swapped().swapped()
    np.testing.assert_allclose(twice.t_upper_lower, pair.t_upper_lower, atol=1e-12)
    np.testing.assert_allclose(twice.rest_q_room_upper, pair.rest_q_room_upper, atol=1e-12)
    here = estimated(pair, METHODS["plane"])
    there = estimated(pair.swapped(), METHODS["plane"])
    np.testing.assert_allclose(here.p_upper, there.p_lower, atol=2e-5)


def test_five_takes_tell_more_than_one() -> None:
    takes = [pair_from(hinge(1e-4, np.deg2rad(0.1), seed=seed, seconds=6.0)) for seed in range(5)]
    one, five = (estimated(each, METHODS["plane"]) for each in (takes[0], joined(takes)))
    assert len(joined(takes)) == sum(map(len, takes))
    assert np.all(np.diff(joined(takes).time_us) > 0)
    assert five.sd_m < 0.6 * one.sd_m


def test_slow_wander_counts_as_few_observations() -> None:
    rng = np.random.default_rng(4)
    white = rng.standard_normal((2000, 3))
    slow = np.repeat(rng.standard_normal((100, 3)), 20, axis=0)
    assert 1000 < independent(white) <= 2000
    assert 50 < independent(slow) < 200


def test_a_method_that_does_not_exist_is_refused() -> None:
    with pytest.raises(TrackError, match="is no way to find a joint"):
        method_named("magic")


def test_a_study_says_all_that_a_page_draws(noisy: Hinge) -> None:
    found = study(noisy.upper, noisy.lower, width=AXIS)
    assert list(found.found) == NAMES
    assert found.class_counts.sum() > 0
    assert found.axis_cloud.shape == (len(found.angle_cloud), 3)
    assert np.all(found.axis_cloud @ AXIS > 0.0)
    for each in found.found.values():
        between = np.linalg.norm(each.from_upper_m - each.lower_from_upper_m)
        assert between == pytest.approx(each.apart_m, abs=1e-3)
