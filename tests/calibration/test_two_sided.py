"""A joint between two moving sensors, on motions whose centre is known."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.calibration.rigid_rotation import RigidRotation, gamma, smoothed
from handstudio.calibration.two_sided import BothSides, by_norms, by_vectors
from handstudio.errors import CalibrationError
from handstudio.maths import so3

from .rotations import RATE_HZ, X, Y, Z, swing, turning

P_ONE, P_TWO = np.array([-0.12, 0.004, 0.018]), np.array([0.05, -0.01, 0.012])
HINGE = np.array([0.0, 0.96, 0.28])


SECONDS = 30.0
CARRIED = (
    (Z, swing(SECONDS, 0.23, 70.0)),
    (Y, swing(SECONDS, 0.37, 40.0, 1.0)),
    (X, swing(SECONDS, 0.31, 50.0, 2.0)),
)
BALL = ((Z, swing(SECONDS, 0.71, 30.0, 0.5)), (X, swing(SECONDS, 0.83, 40.0)))
BEND = ((HINGE, swing(SECONDS, 0.9, 40.0)),)


def moving(*joints: object) -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Orientations, readings (acc, gyr, domega) of both; the joint itself is swung about."""
    t = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    shaken = np.stack([2.0 * np.sin(5.0 * t), 1.5 * np.cos(4.0 * t), np.sin(3.0 * t)], axis=-1)
    force_world = shaken + np.array([0.0, 0.0, 9.80665])
    qs, readings = [], []
    for parts, place in ((CARRIED, P_ONE), ((*CARRIED, *joints), P_TWO)):
        q, gyr, domega = turning(*parts)
        acc = so3.rotate(so3.conjugate(q), force_world) + gamma(gyr, domega) @ place
        qs.append(q)
        readings.append((acc, gyr, domega))
    return qs, *readings


def ideal(reading: tuple[np.ndarray, np.ndarray, np.ndarray]) -> RigidRotation:
    return RigidRotation(*reading, np.ones(len(reading[0]), dtype=bool), RATE_HZ)


def measured(reading: tuple[np.ndarray, ...], rng: np.random.Generator) -> RigidRotation:
    acc = reading[0] + rng.normal(0.0, 0.1, 3) + rng.normal(0.0, 0.05, reading[0].shape)
    return smoothed(acc, reading[1] + rng.normal(0.0, 0.0009, reading[1].shape), RATE_HZ)


def astray(q: np.ndarray) -> np.ndarray:
    """Another world, and one that drifts by half a degree a second."""
    t = np.arange(len(q)) / RATE_HZ
    drift = so3.from_axis_angle(Z, np.deg2rad(0.5) * t)
    return so3.multiply(so3.from_axis_angle(HINGE, 2.0), so3.multiply(drift, q))


def found_by(form: str, one: RigidRotation, two: RigidRotation, qs: list[np.ndarray]) -> BothSides:
    return by_norms(one, two) if form == "norms" else by_vectors(one, two, qs[0], qs[1])


FORMS = pytest.mark.parametrize("form", ["norms", "vectors"])


@FORMS
def test_ideal_data_give_both_places_exactly_while_the_joint_moves(form):
    qs, one, two = moving(*BALL)
    found = found_by(form, ideal(one), ideal(two), qs)
    np.testing.assert_allclose(found.one.from_centre_m, P_ONE, atol=1e-8)
    np.testing.assert_allclose(found.two.from_centre_m, P_TWO, atol=1e-8)
    np.testing.assert_allclose(found.bias, 0.0, atol=1e-7)
    assert not found.one.unseen.any()
    assert not found.two.unseen.any()


def test_a_relative_orientation_is_enough():
    qs, one, two = moving(*BALL)
    q_one_two = so3.multiply(so3.conjugate(qs[0]), qs[1])
    found = by_vectors(ideal(one), ideal(two), so3.IDENTITY[None], q_one_two)
    np.testing.assert_allclose(found.two.from_centre_m, P_TWO, atol=1e-8)


def test_worlds_may_differ_and_drift_apart():
    qs, one, two = moving(*BALL)
    found = by_vectors(ideal(one), ideal(two), qs[0], astray(qs[1]))
    np.testing.assert_allclose(found.one.from_centre_m, P_ONE, atol=1e-5)
    np.testing.assert_allclose(found.two.from_centre_m, P_TWO, atol=1e-5)


@FORMS
def test_biases_of_the_accelerometers_are_found_along(form):
    qs, (acc, *rest), two = moving(*BALL)
    bias = np.array([0.1, -0.05, 0.2])
    found = found_by(form, ideal((acc + bias, *rest)), ideal(two), qs)
    np.testing.assert_allclose(found.bias, [bias, np.zeros(3)], atol=2e-3)
    np.testing.assert_allclose(found.one.from_centre_m, P_ONE, atol=2e-4)


@FORMS
def test_a_hinge_leaves_its_axis_open_on_both_sides_however_it_is_carried(form):
    qs, one, two = moving(*BEND)
    found = found_by(form, ideal(one), ideal(two), qs)
    across = np.eye(3) - np.outer(HINGE, HINGE)
    for side, place in ((found.one, P_ONE), (found.two, P_TWO)):
        assert abs(side.unseen @ HINGE) == pytest.approx(1.0, abs=1e-6)
        np.testing.assert_allclose(across @ side.from_centre_m, across @ place, atol=1e-6)
        assert np.sqrt(HINGE @ side.covariance @ HINGE) > 0.05
    # along the axis both go together: what differs between them is seen
    along = (found.one.from_centre_m - found.two.from_centre_m - P_ONE + P_TWO) @ HINGE
    assert along == pytest.approx(0.0, abs=1e-6)
    difference = np.concatenate([HINGE, -HINGE])
    assert difference @ found.covariance @ difference < 1e-8


@FORMS
def test_knocks_move_the_places_no_further_than_noise_does(form):
    rng = np.random.default_rng(7)
    qs, one, two = moving(*BALL)
    whole = measured(one, rng)
    struck = whole.acc.copy()
    struck[rng.choice(len(struck), 100, replace=False)] += rng.normal(0.0, 30.0, (100, 3))
    knocked = RigidRotation(struck, whole.gyr, whole.domega, whole.used, RATE_HZ)
    other = measured(two, rng)
    quiet, found = (found_by(form, first, other, qs) for first in (whole, knocked))
    for side, before in ((found.one, quiet.one), (found.two, quiet.two)):
        assert np.all(np.abs(side.from_centre_m - before.from_centre_m) < 2.0 * before.sd_m)
        assert np.all(side.sd_m < 1.5 * before.sd_m)
        assert np.all(before.sd_m < 3e-3)


@pytest.mark.parametrize(("form", "times"), [("norms", 40), ("vectors", 20)])
def test_the_places_lie_within_two_standard_deviations_in_95_of_100(form, times):
    qs, one, two = moving(*BALL)
    inside = []
    for seed in range(times):
        rng = np.random.default_rng(seed)
        found = found_by(form, measured(one, rng), measured(two, rng), qs)
        for side, place in ((found.one, P_ONE), (found.two, P_TWO)):
            inside.append(np.abs(side.from_centre_m - place) < 1.96 * side.sd_m)
    assert 0.88 < np.mean(inside) <= 0.99


def test_sensors_of_different_recordings_are_refused():
    _, one, two = moving(*BALL)
    shorter = tuple(part[:-1] for part in two)
    with pytest.raises(CalibrationError, match="Cut both from one recording"):
        by_norms(ideal(one), ideal(shorter))
