"""The thesis's pairs, on swings whose centre is known."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.calibration import one_sided, pairs
from handstudio.calibration.rigid_rotation import RigidRotation, gamma, joined, smoothed
from handstudio.errors import CalibrationError

from .rotations import RATE_HZ, Y, Z, swing, turning

P = np.array([0.087, -0.012, 0.021])


def about(axis: np.ndarray, place: np.ndarray = P, seconds: float = 8.0) -> RigidRotation:
    _, gyr, domega = turning((axis, swing(seconds, 0.9, 35.0)))
    acc = gamma(gyr, domega) @ place
    return RigidRotation(acc, gyr, domega, np.ones(len(gyr), dtype=bool), RATE_HZ)


def noisy(rotation: RigidRotation, seed: int) -> RigidRotation:
    rng = np.random.default_rng(seed)
    acc = rotation.acc + rng.normal(0.0, 0.05, rotation.acc.shape)
    gyr = rotation.gyr + rng.normal(0.0, 0.002, rotation.gyr.shape)
    return smoothed(acc, gyr, RATE_HZ)


def test_swings_turn_back_twice_a_period():
    assert len(pairs.turning_points(about(Y))) == 14


def test_ideal_swings_about_two_axes_give_the_place():
    found = pairs.centre(about(Y), about(Z))
    # at 100 Hz the instants are up to 5 ms from where the rate vanishes
    np.testing.assert_allclose(found.from_centre_m, P, atol=5e-4)
    assert not found.unseen.any()


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_sign_is_from_centre_to_sensor(sign):
    place = sign * P
    found = pairs.centre(about(Y, place), about(Z, place))
    np.testing.assert_allclose(found.from_centre_m, place, atol=5e-4)


def test_a_hinge_with_a_second_rotation_about_a_centre_in_line_gives_place_and_own_length():
    further = 2.0 * P
    found = pairs.centre(about(Y), about(Z, further), hinge=True)
    np.testing.assert_allclose(found.from_centre_m, P, atol=1e-3)


def test_with_noise_all_samples_are_closer_than_pairs():
    by_pairs, by_all = [], []
    for seed in range(10):
        parts = noisy(about(Y), 2 * seed), noisy(about(Z), 2 * seed + 1)
        by_pairs.append(pairs.centre(*parts).from_centre_m - P)
        by_all.append(one_sided.centre(joined(parts)).from_centre_m - P)
    errors = [float(np.sqrt(np.mean(np.square(e)))) for e in (by_pairs, by_all)]
    assert errors[1] < errors[0] < 3e-3


def test_the_jackknife_is_about_as_large_as_the_errors():
    found = [
        pairs.centre(noisy(about(Y), 2 * s), noisy(about(Z), 2 * s + 1)) for s in range(100, 120)
    ]
    scatter = np.std([f.from_centre_m for f in found], axis=0)
    told = np.sqrt(np.mean([f.sd_m**2 for f in found], axis=0))
    assert np.all(told > 0.4 * scatter)
    assert np.all(told < 4.0 * scatter + 5e-4)


def test_too_few_swings_are_refused():
    with pytest.raises(CalibrationError, match="turned back 1 times"):
        pairs.centre(about(Y), about(Z, seconds=0.7))
