"""Euler angles against quaternions, and their rates against numerical derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handstudio.calibration.attitude import attitude
from handstudio.fusion import euler
from handstudio.maths import so3

FIELD = np.array([31.0, 0.0, -35.0])
UP = np.array([0.0, 0.0, 9.8])

rng = np.random.default_rng(4)
QUATERNIONS = so3.normalize(rng.normal(size=(200, 4)))
STEEP = np.deg2rad(80.0)  # beyond it numerical derivatives are poor
ANGLES = rng.uniform(-1.0, 1.0, size=(3, 200)) * np.array([[np.pi], [STEEP], [np.pi]])
RATES = rng.normal(size=(3, 200)) * 3.0


def matrix(phi: float, theta: float, psi: float) -> np.ndarray:
    """(2.7) as it is printed."""
    c, s = np.cos(psi), np.sin(psi)
    z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    c, s = np.cos(theta), np.sin(theta)
    y = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    c, s = np.cos(phi), np.sin(phi)
    x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return z @ y @ x


# --- angles -----------------------------------------------------------------------------------


def test_angles_are_those_of_the_matrix_of_the_thesis():
    for angles in ANGLES.T[:20]:
        expected = matrix(*angles)
        np.testing.assert_allclose(
            so3.to_matrix(euler.to_quaternion(angles)), expected, rtol=0, atol=1e-12
        )


def test_angles_of_an_orientation_give_it_back():
    angles = euler.from_quaternion(QUATERNIONS)
    assert np.abs(angles[1]).max() <= np.pi / 2
    assert so3.angle_between(euler.to_quaternion(angles), QUATERNIONS).max() < 1e-12


@pytest.mark.parametrize("theta", [90.0, -90.0, 90.0 - 1e-7, -90.0 + 1e-9])
def test_where_phi_and_psi_cannot_be_told_apart_a_pair_that_gives_the_orientation_is_found(theta):
    phi, psi = np.linspace(-3.0, 3.0, 40), np.linspace(2.0, -2.5, 40)
    q = euler.to_quaternion(np.stack([phi, np.full(40, np.deg2rad(theta)), psi]))
    again = euler.to_quaternion(euler.from_quaternion(q))
    assert so3.angle_between(again, q).max() < 1e-7


def test_observed_angles_are_the_attitude_at_rest():
    back = so3.conjugate(QUATERNIONS)
    acc, mag = so3.rotate(back, UP), so3.rotate(back, FIELD)
    found = euler.to_quaternion(euler.observed(acc.T, mag.T))
    assert so3.angle_between(found, QUATERNIONS).max() < 1e-12
    assert so3.angle_between(found, attitude(acc, mag)).max() < 1e-12


def test_nothing_felt_is_still_a_number():
    zero = np.zeros((3, 1))
    assert np.isfinite(euler.observed(zero, zero)).all()


@given(
    angles=arrays(float, (3, 5), elements=st.floats(-9.0, 9.0)),
    turns=arrays(float, (3, 5), elements=st.integers(-3, 3)),
)
def test_a_difference_is_the_shorter_way_round_and_blind_to_whole_turns(angles, turns):
    of = euler.from_quaternion(QUATERNIONS[:5])
    gap = euler.difference(angles, of)
    assert np.abs(gap).max() <= np.pi + 1e-12
    shifted = euler.difference(angles + 2.0 * np.pi * turns, of)
    np.testing.assert_allclose(np.exp(1j * shifted), np.exp(1j * gap), atol=1e-12)
    q_of, q_to = euler.to_quaternion(of + gap), euler.to_quaternion(angles)
    assert so3.angle_between(q_of, q_to).max() < 1e-7


def test_a_state_past_the_vertical_is_compared_on_its_own_side():
    past = np.deg2rad(np.array([[10.0], [93.0], [20.0]]))
    same = euler.from_quaternion(euler.to_quaternion(past))
    assert np.abs(same - past).max() > 1.0
    np.testing.assert_allclose(euler.difference(same, past), 0.0, atol=1e-12)


# --- rates ------------------------------------------------------------------------------------


def test_rates_are_the_derivative_of_the_angles_of_a_sensor_that_turns():
    dt = 1e-6
    q = euler.to_quaternion(ANGLES)
    before = euler.from_quaternion(so3.multiply(q, so3.exp(-0.5 * dt * RATES.T)))
    after = euler.from_quaternion(so3.multiply(q, so3.exp(0.5 * dt * RATES.T)))
    derivative = euler.difference(after, before) / dt
    np.testing.assert_allclose(euler.rates(ANGLES, RATES), derivative, rtol=1e-6, atol=1e-6)


def test_rates_hold_past_the_vertical_too():
    past = ANGLES.copy()
    past[1] = np.pi - ANGLES[1]
    dt = 1e-6
    stepped = so3.multiply(euler.to_quaternion(past), so3.exp(dt * RATES.T))
    summed = euler.to_quaternion(past + euler.rates(past, dt * RATES))
    assert so3.angle_between(summed, stepped).max() < 1e-9


def test_slopes_are_the_derivatives_of_the_rates():
    rates, slopes = euler.rates_and_slopes(ANGLES, RATES)
    np.testing.assert_array_equal(rates, euler.rates(ANGLES, RATES))
    for j in range(2):
        nudge = np.zeros((3, 1))
        nudge[j] = 1e-6
        more, less = euler.rates(ANGLES + nudge, RATES), euler.rates(ANGLES - nudge, RATES)
        np.testing.assert_allclose(slopes[:, j], (more - less) / 2e-6, rtol=1e-6, atol=1e-5)
    turned = euler.rates(ANGLES + np.array([[0.0], [0.0], [1.0]]), RATES)
    np.testing.assert_array_equal(turned, rates)


@pytest.mark.parametrize("theta", [np.pi / 2, -np.pi / 2, np.pi / 2 + 1e-12, 0.4999999 * np.pi])
def test_at_the_singularity_rates_are_large_and_numbers(theta):
    angles = np.array([[0.3], [theta], [-1.0]])
    gyr = np.array([[1.0], [2.0], [3.0]])
    rates, slopes = euler.rates_and_slopes(angles, gyr)
    assert np.isfinite(slopes).all()
    assert 1e3 < np.abs(rates).max() < 1e4


def test_but_for_the_last_sixteenth_of_a_degree_the_equation_is_as_published():
    theta = np.deg2rad(90.0 - 0.06)
    phi, w = 0.3, np.array([1.0, 2.0, 3.0])
    sec, tan = 1.0 / np.cos(theta), np.tan(theta)
    printed = np.array(
        [
            [1.0, np.sin(phi) * tan, np.cos(phi) * tan],
            [0.0, np.cos(phi), -np.sin(phi)],
            [0.0, np.sin(phi) * sec, np.cos(phi) * sec],
        ]
    )
    rates = euler.rates(np.array([[phi], [theta], [0.5]]), w[:, None])
    np.testing.assert_allclose(rates[:, 0], printed @ w, rtol=1e-12)
