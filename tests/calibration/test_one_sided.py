"""A centre at rest from all samples, on rotations whose centre is known."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.calibration.one_sided import centre
from handstudio.calibration.rigid_rotation import (
    RigidRotation,
    free_of_gravity,
    gamma,
    joined,
    skew,
    smoothed,
)
from handstudio.calibration.robust_fit import UNSEEN_SD_M
from handstudio.errors import CalibrationError
from handstudio.maths import so3

from .rotations import RATE_HZ, Y, Z, swing, turning

P = np.array([0.041, -0.008, 0.013])
HINGE = np.array([0.6, 0.0, 0.8])


def two_axes(seconds: float = 20.0):
    return turning((Z, swing(seconds, 0.7, 35.0)), (Y, swing(seconds, 1.1, 40.0, 0.3)))


def ideal(gyr: np.ndarray, domega: np.ndarray, place: np.ndarray = P) -> RigidRotation:
    acc = gamma(gyr, domega) @ place
    return RigidRotation(acc, gyr, domega, np.ones(len(gyr), dtype=bool), RATE_HZ)


def measured(rng: np.random.Generator, correlated: float = 0.0) -> RigidRotation:
    """With an MPU-9250's noise, a bias, and what else accelerations err by over a swing."""
    _, gyr, domega = two_axes()
    acc = gamma(gyr, domega) @ P + rng.normal(0.0, 0.1, 3)
    acc = acc + rng.normal(0.0, 0.025, acc.shape)
    slow = rng.normal(0.0, correlated, acc.shape) if correlated else np.zeros_like(acc)
    for i in range(1, len(slow)):
        slow[i] = 0.95 * slow[i - 1] + np.sqrt(1.0 - 0.95**2) * slow[i]
    return smoothed(acc + slow, gyr + rng.normal(0.0, 0.0009, gyr.shape), RATE_HZ)


# --- kernels ------------------------------------------------------------------------------------


def test_skew_is_the_cross_product():
    u, v = np.random.default_rng(1).normal(size=(2, 5, 3))
    np.testing.assert_allclose(np.einsum("nij,nj->ni", skew(u), v), np.cross(u, v), atol=1e-15)


def test_gamma_is_the_acceleration_of_a_point_on_a_turning_body():
    q, gyr, domega = two_axes(2.0)
    world = so3.rotate(q, P)
    acc_world = np.gradient(np.gradient(world, 1 / RATE_HZ, axis=0), 1 / RATE_HZ, axis=0)
    acc = so3.rotate(so3.conjugate(q), acc_world)
    np.testing.assert_allclose((gamma(gyr, domega) @ P)[5:-5], acc[5:-5], atol=0.03)


def test_a_sensor_at_rest_is_free_of_gravity_whatever_its_attitude():
    q = so3.normalize(np.random.default_rng(2).normal(size=(9, 4)))
    acc = so3.rotate(so3.conjugate(q), np.array([0.0, 0.0, 9.80665]))
    np.testing.assert_allclose(free_of_gravity(acc, q), 0.0, atol=1e-12)


def test_smoothing_bends_rate_slope_and_acceleration_alike():
    _, gyr, domega = two_axes()
    found = smoothed(gamma(gyr, domega) @ P, gyr, RATE_HZ)
    assert not found.used[:9].any()
    assert found.used[20:-20].all()
    np.testing.assert_allclose(found.domega[found.used], domega[found.used], rtol=0.01, atol=0.3)
    np.testing.assert_allclose(centre(found).from_centre_m, P, atol=2e-4)


def test_what_a_filter_made_of_bad_samples_is_not_used():
    _, gyr, domega = two_axes()
    acc, good = gamma(gyr, domega) @ P, np.ones(len(gyr), dtype=bool)
    acc[500], good[500] = 1e3, False
    found = smoothed(acc, gyr, RATE_HZ, good=good)
    assert not found.used[491:510].any()
    assert np.abs(found.acc[found.used]).max() < 10.0


# --- place --------------------------------------------------------------------------------------


def test_ideal_data_give_the_place_exactly():
    found = centre(ideal(*two_axes()[1:]))
    np.testing.assert_allclose(found.from_centre_m, P, atol=1e-9)
    assert found.residual < 1e-9
    assert not found.unseen.any()


def test_a_hinge_leaves_its_axis_open_and_says_so():
    _, gyr, domega = turning((HINGE, swing(8.0, 1.0, 40.0)))
    found = centre(ideal(gyr, domega))
    assert abs(found.unseen @ HINGE) == pytest.approx(1.0, abs=1e-9)
    across = np.eye(3) - np.outer(HINGE, HINGE)
    np.testing.assert_allclose(across @ found.from_centre_m, across @ P, atol=1e-9)
    assert found.from_centre_m @ HINGE == pytest.approx(0.0, abs=1e-9)
    assert HINGE @ found.covariance @ HINGE == pytest.approx(UNSEEN_SD_M**2)
    assert found.condition > 1e6


def test_a_second_axis_closes_what_a_hinge_leaves_open():
    parts = [turning((axis, swing(8.0, 1.0, 40.0))) for axis in (HINGE, Y)]
    found = centre(joined([ideal(gyr, domega) for _, gyr, domega in parts]))
    np.testing.assert_allclose(found.from_centre_m, P, atol=1e-9)
    assert not found.unseen.any()


def test_excitation_is_told_by_axis():
    found = centre(ideal(*turning((Y, swing(8.0, 1.0, 40.0)))[1:])).excitation
    np.testing.assert_allclose(np.abs(found.axes[0]), Y, atol=1e-12)
    assert np.rad2deg(found.swing[0]) == pytest.approx(80.0, abs=0.5)
    assert found.rate[0] == pytest.approx(np.deg2rad(40.0) * 2 * np.pi / np.sqrt(2), rel=0.01)
    np.testing.assert_allclose(found.rate[1:], 0.0, atol=1e-6)


def test_knocks_move_the_place_by_less_than_a_millimetre():
    rng = np.random.default_rng(5)
    whole = measured(rng)
    struck = whole.acc.copy()
    struck[rng.choice(len(struck), 100, replace=False)] += rng.normal(0.0, 30.0, (100, 3))
    knocked = RigidRotation(struck, whole.gyr, whole.domega, whole.used, RATE_HZ)
    np.testing.assert_allclose(centre(knocked).from_centre_m, P, atol=1e-3)


@pytest.mark.parametrize("correlated", [0.0, 0.3])
def test_the_place_lies_within_two_standard_deviations_in_95_of_100(correlated):
    inside = []
    for seed in range(60):
        found = centre(measured(np.random.default_rng(seed), correlated))
        inside.append(np.abs(found.from_centre_m - P) < 1.96 * found.sd_m)
    # 180 verdicts, not all independent; 20 blocks make deviations a little small
    assert 0.89 < np.mean(inside) < 0.99


def test_a_sensor_that_hardly_turns_is_refused():
    with pytest.raises(CalibrationError, match="Move the joint further and faster"):
        centre(ideal(*turning((Y, swing(8.0, 0.2, 1.0)))[1:]))


def test_a_recording_that_is_too_short_is_refused():
    with pytest.raises(CalibrationError, match="Record for longer"):
        smoothed(np.zeros((10, 3)), np.zeros((10, 3)), RATE_HZ)
