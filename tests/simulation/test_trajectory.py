import numpy as np
import pytest

from handstudio.hand.skeleton import JOINTS
from handstudio.simulation.trajectory import Trajectory

KEYS_S = np.array([0.0, 0.4, 1.1, 1.5, 2.3])


def wandering(periodic: bool) -> Trajectory:
    turns = np.random.default_rng(1).normal(size=(len(KEYS_S), len(JOINTS), 3))
    turns[-1] = turns[0]
    return Trajectory(KEYS_S, turns, periodic)


def test_keyframes_are_met_at_rest():
    motion = wandering(periodic=False).at(KEYS_S)
    np.testing.assert_allclose(motion.turns, wandering(periodic=False).turns, atol=1e-14)
    np.testing.assert_array_equal(motion.rates, 0.0)
    np.testing.assert_array_equal(motion.accelerations, 0.0)


def test_rates_and_accelerations_are_the_derivatives_of_the_turns():
    trajectory, h = wandering(periodic=False), 1e-3
    time_s = np.setdiff1d(np.arange(0.0, 2.3, 0.05).round(3), KEYS_S) + 0.01
    before2, before, at, after, after2 = (trajectory.at(time_s + k * h) for k in (-2, -1, 0, 1, 2))
    rates = (before2.turns - 8 * before.turns + 8 * after.turns - after2.turns) / (12 * h)
    accelerations = (before2.rates - 8 * before.rates + 8 * after.rates - after2.rates) / (12 * h)
    np.testing.assert_allclose(at.rates, rates, atol=1e-8 * np.abs(rates).max())
    np.testing.assert_allclose(
        at.accelerations, accelerations, atol=1e-8 * np.abs(accelerations).max()
    )


def test_a_periodic_motion_repeats_without_a_seam():
    trajectory = wandering(periodic=True)
    time_s = np.array([-0.3, 0.0, 0.2, 2.2999999, 2.3, 2.3000001, 9.0])
    once, later = trajectory.at(time_s), trajectory.at(time_s + 10 * trajectory.duration_s)
    np.testing.assert_allclose(once.turns, later.turns, atol=1e-12)
    np.testing.assert_allclose(once.accelerations, later.accelerations, atol=1e-9)
    np.testing.assert_allclose(once.turns[3:6], trajectory.turns[[0, 0, 0]], atol=1e-12)


def test_a_motion_that_is_not_periodic_stays_where_it_began_and_ended():
    motion = wandering(periodic=False).at(np.array([-5.0, 99.0]))
    np.testing.assert_allclose(motion.turns, wandering(periodic=False).turns[[0, -1]], atol=1e-14)
    np.testing.assert_array_equal(motion.rates, 0.0)


@pytest.mark.parametrize("time_s", [[0.1, 0.5], [0.0, 0.0], [0.0, 1.0, 0.5]])
def test_keyframes_out_of_order_are_refused(time_s):
    with pytest.raises(ValueError, match="Keyframes"):
        Trajectory(np.array(time_s), np.zeros((len(time_s), len(JOINTS), 3)))


def test_a_periodic_motion_that_does_not_close_is_refused():
    turns = np.zeros((2, len(JOINTS), 3))
    turns[1, 3, 0] = 0.1
    with pytest.raises(ValueError, match="end in the pose"):
        Trajectory(np.array([0.0, 1.0]), turns, periodic=True)
