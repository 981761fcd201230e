"""Attitude at rest: any attitude is found again, as by formula so by construction."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from handstudio.calibration.attitude import attitude
from handstudio.maths import so3

GRAVITY = np.array([0.0, 0.0, 9.81])
FIELD = np.array([31.0, 0.0, -35.0])  # [µT], down in the north

turns = arrays(float, 3, elements=st.floats(-4.0, 4.0))


def felt(q_world_sensor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    back = so3.conjugate(q_world_sensor)
    return so3.rotate(back, GRAVITY), so3.rotate(back, FIELD)


def triad(acc: np.ndarray, mag: np.ndarray) -> np.ndarray:
    """The world's axes as the sensor sees them: up, north in the level plane, west."""
    up = acc / np.linalg.norm(acc)
    north = mag - (mag @ up) * up
    north /= np.linalg.norm(north)
    return so3.from_matrix(np.stack([north, np.cross(up, north), up]))


@given(turns)
@example(np.zeros(3))
@example(np.array([0.0, 0.5 * np.pi, 0.0]))  # nose down: roll and heading are one
@example(np.array([0.0, -0.5 * np.pi, 0.0]))
@example(np.array([np.pi, 0.0, 0.0]))
@example(np.array([0.0, 0.0, np.pi]))
def test_any_attitude_is_found_again(v):
    q = so3.exp(v)
    acc, mag = felt(q)
    assert so3.angle_between(attitude(acc, mag), q) < 1e-9
    assert so3.angle_between(triad(acc, mag), q) < 1e-9


@given(
    arrays(float, 3, elements=st.floats(-10.0, 10.0)).filter(lambda v: np.linalg.norm(v) > 0.1),
    arrays(float, 3, elements=st.floats(-50.0, 50.0)).filter(lambda v: np.linalg.norm(v) > 1.0),
)
def test_formula_and_construction_agree_on_any_reading(acc, mag):
    across = np.linalg.norm(np.cross(acc, mag)) / np.linalg.norm(acc) / np.linalg.norm(mag)
    if across > 1e-3:  # else the field is vertical and there is no north
        assert so3.angle_between(attitude(acc, mag), triad(acc, mag)) < 1e-9


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_the_angles_are_those_of_the_equations(phi, theta, psi):
    q = Rotation.from_euler("ZYX", [psi, theta, phi]).as_quat(scalar_first=True)
    ax, ay, az = felt(q)[0]
    assert np.arctan2(ay, az) == pytest.approx(phi, abs=1e-9)
    assert -np.arctan2(ax, np.hypot(ay, az)) == pytest.approx(theta, abs=1e-9)
    assert so3.angle_between(attitude(*felt(q)), q) < 1e-7


def test_how_strong_gravity_and_field_are_does_not_matter():
    acc, mag = felt(so3.exp(np.array([0.3, -0.9, 2.0])))
    np.testing.assert_allclose(attitude(0.1 * acc, 7.0 * mag), attitude(acc, mag), atol=1e-15)


@pytest.mark.parametrize("mag", [None, np.full(3, np.nan)], ids=["no compass", "no reading"])
def test_without_a_compass_the_sensors_x_axis_points_north(mag):
    for v in np.random.default_rng(1).uniform(-1.0, 1.0, size=(20, 3)):
        acc, _ = felt(so3.exp(v))
        q = attitude(acc, mag)
        np.testing.assert_allclose(so3.rotate(q, acc), GRAVITY, atol=1e-12)
        north = so3.rotate(q, np.array([1.0, 0.0, 0.0]))
        assert north[1] == pytest.approx(0.0, abs=1e-12)
        assert north[0] > 0.0


def test_many_at_once_are_those_of_each_and_a_silent_compass_harms_only_itself():
    q = so3.exp(np.random.default_rng(2).normal(size=(4, 5, 3)))
    acc, mag = felt(q)
    mag[1, 2] = np.nan
    many = attitude(acc, mag)
    for i in np.ndindex(4, 5):
        np.testing.assert_array_equal(many[i], attitude(acc[i], mag[i]))
    assert np.isfinite(many).all()
