"""Rest: found at the first possible instant however the samples come, and no turn taken for it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handstudio.calibration.rest import REST_S, Rest, first_rest
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY, ImuSamples
from handstudio.simulation.imperfections import MPU9250, SensorKind, read, switched_on

RATE_HZ = 100
WINDOW = round(REST_S * RATE_HZ)
FIELD = np.array([31.0, 0.0, -35.0])

Q = so3.exp(np.array([0.4, -0.7, 1.9]))


def turning(omega_dps: np.ndarray, bias_dps: np.ndarray | None = None) -> ImuSamples:
    """One sensor that turns with these rates [deg/s] in its own frame, from the attitude Q."""
    omega = np.deg2rad(omega_dps)
    q = [Q]
    for step in omega[1:]:
        q.append(so3.multiply(q[-1], so3.exp(step / RATE_HZ)))
    back = so3.conjugate(np.array(q))
    bias = np.zeros(3) if bias_dps is None else np.deg2rad(bias_dps)
    n = len(omega)
    flags = np.ones((n, 1), dtype=bool)
    return ImuSamples(
        time_us=np.arange(n) * (1_000_000 // RATE_HZ),
        gyr=(omega + bias)[:, None],
        acc=so3.rotate(back, np.array([0.0, 0.0, STANDARD_GRAVITY]))[:, None],
        mag=so3.rotate(back, FIELD)[:, None],
        fresh=flags,
        valid=flags.copy(),
        saturated=~flags,
    )


def still(n: int, bias_dps: object = (0.0, 0.0, 0.0)) -> ImuSamples:
    return turning(np.zeros((n, 3)), np.asarray(bias_dps))


def noisy(exact: ImuSamples, rate_hz: int, seed: int, kind: SensorKind = MPU9250) -> ImuSamples:
    readings, _ = read(kind, seed, rate_hz, switched_on(exact.gyr.shape[1]), exact)
    si = readings.counts / 32768
    ranges = MPU9250.ranges
    return ImuSamples(
        exact.time_us,
        si[..., 3:6] * ranges.gyr,
        si[..., 0:3] * ranges.acc,
        si[..., 6:9] * ranges.mag,
        readings.fresh,
        exact.valid,
        exact.saturated,
    )


def part(samples: ImuSamples, before: ImuSamples) -> ImuSamples:
    names = ImuSamples.__slots__
    both = ([getattr(one, name) for one in (before, samples)] for name in names)
    return ImuSamples(*map(np.concatenate, both))


def found(samples: ImuSamples) -> tuple[int, Rest] | None:
    return first_rest(samples, 0, WINDOW, 0)


def found_in_pieces(samples: ImuSamples, cuts: list[int]) -> tuple[int, Rest] | None:
    """As a pipeline asks: with the last window of what came before at hand."""
    recent = samples[:0]
    for start, end in pairwise([0, *cuts, len(samples)]):
        known = len(recent)
        recent = part(samples[start:end], recent)
        rest = first_rest(recent, 0, WINDOW, known)
        if rest is not None:
            return start + rest[0] - known, rest[1]
        recent = recent[max(0, len(recent) - WINDOW + 1) :]
    return None


def restless(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-40.0, 40.0, size=(n, 3))


@settings(max_examples=30)
@given(st.lists(st.integers(0, 260), max_size=12).map(sorted), st.integers(0, 2))
def test_rest_is_found_at_the_same_instant_however_the_samples_are_cut(cuts, seed):
    moving = np.concatenate([restless(100, seed), np.zeros((160, 3))])
    samples = noisy(turning(moving), RATE_HZ, seed)
    whole, cut = found(samples), found_in_pieces(samples, cuts)
    assert whole is not None
    assert cut is not None
    assert cut[0] == whole[0] == 100 + WINDOW - 1
    np.testing.assert_array_equal(cut[1].q_world_sensor, whole[1].q_world_sensor)
    np.testing.assert_array_equal(cut[1].gyr_bias, whole[1].gyr_bias)


def test_a_still_sensor_rests_after_one_window_and_no_earlier():
    samples = still(2 * WINDOW)
    assert found(samples)[0] == WINDOW - 1
    assert found(samples[: WINDOW - 1]) is None
    assert found(samples[:WINDOW])[0] == WINDOW - 1
    assert first_rest(samples, 0, WINDOW, WINDOW + 7)[0] == WINDOW + 7
    assert first_rest(samples, 0, WINDOW, 2 * WINDOW) is None


def test_rest_tells_attitude_and_bias():
    _, rest = found(still(WINDOW, (1.0, -2.0, 0.5)))
    assert so3.angle_between(rest.q_world_sensor, Q) < 1e-9
    np.testing.assert_allclose(np.rad2deg(rest.gyr_bias), [1.0, -2.0, 0.5], atol=1e-12)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_largest_bias_of_real_units_is_no_turn(axis, sign):
    bias = np.zeros(3)
    bias[axis] = sign * 3.2
    unbiased = replace(MPU9250, gyr_bias_rms=0.0)
    samples = noisy(still(2 * WINDOW, bias), RATE_HZ, axis, unbiased)
    assert found(samples)[0] == WINDOW - 1


@pytest.mark.parametrize("rate_hz", [100, 1000])
def test_a_resting_sensor_of_our_kind_is_found_at_rest_at_once(rate_hz):
    window = round(REST_S * rate_hz)
    steady = still(window)
    exact = ImuSamples(
        np.arange(window) * (1_000_000 // rate_hz),
        *(np.repeat(getattr(steady, name), 20, axis=1) for name in ImuSamples.__slots__[1:]),
    )
    for seed in range(5):
        samples = noisy(exact, rate_hz, seed)
        ends = [first_rest(samples, sensor, window, 0) for sensor in range(20)]
        assert [end[0] for end in ends if end is not None] == [window - 1] * 20


@pytest.mark.parametrize("dps", [2.0, 3.0, 4.5])
def test_a_slow_steady_turn_that_tilts_is_not_rest(dps):
    level = so3.rotate(so3.conjugate(Q), np.array([0.6, 0.8, 0.0]))
    assert found(turning(np.tile(dps * level, (4 * WINDOW, 1)))) is None


def test_a_steady_turn_about_the_vertical_is_not_rest_if_no_bias_is_as_large():
    upright = so3.rotate(so3.conjugate(Q), np.array([0.0, 0.0, 1.0]))
    assert found(turning(np.tile(6.0 * upright, (4 * WINDOW, 1)))) is None


@pytest.mark.parametrize("signal", ["gyr", "acc"])
def test_shaking_is_not_rest(signal):
    samples = still(4 * WINDOW)
    size = {"gyr": np.deg2rad(2.0), "acc": 0.6}[signal]
    getattr(samples, signal)[:, 0, 1] += size * np.sin(np.arange(4 * WINDOW))
    assert found(samples) is None


def test_one_silent_instant_begins_the_wait_anew():
    samples = still(4 * WINDOW)
    samples.valid[30] = False
    assert found(samples)[0] == 30 + WINDOW


def test_a_jerk_begins_the_wait_anew():
    samples = still(4 * WINDOW)
    samples.gyr[WINDOW - 1, 0, 2] += np.deg2rad(10.0)
    assert found(samples)[0] == 2 * WINDOW - 1


def test_only_fresh_readings_of_the_compass_count():
    samples = still(WINDOW)
    fresh = samples.fresh.copy()
    fresh[::3] = False
    samples.mag[::3] = np.nan
    stale = ImuSamples(
        *(fresh if name == "fresh" else getattr(samples, name) for name in ImuSamples.__slots__)
    )
    assert so3.angle_between(found(stale)[1].q_world_sensor, Q) < 1e-9


def test_without_a_compass_the_tilt_is_found_all_the_same():
    samples = still(WINDOW)
    samples.fresh[:] = False
    samples.mag[:] = np.nan
    rest = found(samples)[1]
    acc = samples.acc[0, 0]
    np.testing.assert_allclose(
        so3.rotate(rest.q_world_sensor, acc), [0.0, 0.0, STANDARD_GRAVITY], atol=1e-12
    )


def test_sensors_are_looked_at_one_by_one():
    rest, motion = still(2 * WINDOW), turning(restless(2 * WINDOW))
    both = ImuSamples(
        rest.time_us,
        *(
            np.concatenate([getattr(motion, name), getattr(rest, name)], axis=1)
            for name in ImuSamples.__slots__[1:]
        ),
    )
    assert first_rest(both, 0, WINDOW, 0) is None
    assert first_rest(both, 1, WINDOW, 0)[0] == WINDOW - 1
