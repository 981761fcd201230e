from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.samples import FULL_SCALE, STANDARD_GRAVITY, ImuSamples
from handstudio.simulation.imperfections import (
    MPU9250,
    Readings,
    SensorKind,
    draw_biases,
    read,
    switched_on,
)

PERFECT = replace(
    MPU9250, gyr_density=0.0, acc_density=0.0, mag_noise_ut=0.0, gyr_bias_rms=0.0, acc_bias_rms=0.0
)
UNBIASED = replace(MPU9250, gyr_bias_rms=0.0, acc_bias_rms=0.0)


def felt(n: int, rate_hz: int, sensors: int = 2, value: float = 0.0) -> ImuSamples:
    vectors = np.full((n, sensors, 3), value)
    flags = np.ones((n, sensors), dtype=bool)
    time_us = np.arange(n) * 1_000_000 // rate_hz
    return ImuSamples(time_us, vectors, vectors, vectors, flags, flags, ~flags)


def counted(exact: ImuSamples, rate_hz: int, kind: SensorKind = MPU9250, seed: int = 5) -> Readings:
    return read(kind, seed, rate_hz, switched_on(exact.gyr.shape[1]), exact)[0]


@given(st.lists(st.integers(1, 150), min_size=1, max_size=6), st.sampled_from([100, 1000]))
def test_a_stream_reads_the_same_however_it_is_cut(cuts, rate_hz):
    exact = felt(sum(cuts), rate_hz)
    exact.mag[:] = np.arange(len(exact))[:, None, None]
    whole, state, start, parts = counted(exact, rate_hz), switched_on(2), 0, []
    for cut in cuts:
        part, state = read(MPU9250, 5, rate_hz, state, exact[start : start + cut])
        parts.append(part)
        start += cut
    np.testing.assert_array_equal(np.concatenate([p.counts for p in parts]), whole.counts)
    np.testing.assert_array_equal(np.concatenate([p.fresh for p in parts]), whole.fresh)


def test_a_seed_is_a_stream_to_the_bit_and_another_is_another():
    exact = felt(300, 100)
    first, again, other = (counted(exact, 100, seed=seed).counts for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.count_nonzero(first != other) > 0.9 * first.size
    # a test or a bug report may rest on a seed: its numbers do not change unnoticed
    assert first[0, 0, :6].tolist() == [-20, 82, 36, -3, 0, 5]


@pytest.mark.parametrize("rate_hz", [100, 1000])
def test_white_noise_has_the_density_put_in(rate_hz):
    n, sensors = 4000, 10
    counts = counted(felt(n, rate_hz, sensors), rate_hz, UNBIASED).counts / FULL_SCALE
    band = np.sqrt(rate_hz / 2)
    confidence = 5.0 / np.sqrt(2 * n * sensors * 3)
    acc = counts[..., 0:3] * MPU9250.ranges.acc
    gyr = counts[..., 3:6] * MPU9250.ranges.gyr
    # rounding adds a variance of a twelfth of a step squared
    expected_acc = np.hypot(MPU9250.acc_density * band, rounding(MPU9250.ranges.acc))
    expected_gyr = np.hypot(MPU9250.gyr_density * band, rounding(MPU9250.ranges.gyr))
    assert acc.std() == pytest.approx(expected_acc, rel=confidence)
    assert gyr.std() == pytest.approx(expected_gyr, rel=confidence)
    axes = gyr.reshape(n, -1)
    assert np.abs(np.corrcoef(axes, rowvar=False) - np.eye(axes.shape[1])).max() < 0.1
    lagged = np.corrcoef(axes[:-1, 0], axes[1:, 0])[0, 1]
    assert abs(lagged) < 5.0 / np.sqrt(n)


def rounding(limit: float) -> float:
    return limit / FULL_SCALE / np.sqrt(12.0)


def test_the_magnetometer_has_the_noise_put_in():
    mag = counted(felt(4000, 100, 10), 100).counts[..., 6:9] * (MPU9250.ranges.mag / FULL_SCALE)
    expected = np.hypot(MPU9250.mag_noise_ut, rounding(MPU9250.ranges.mag))
    assert mag.std() == pytest.approx(expected, rel=5.0 / np.sqrt(2 * mag.size))


def test_biases_have_the_size_put_in_and_stay():
    biases = draw_biases(MPU9250, sensors=3000, seed=1)
    confidence = 5.0 / np.sqrt(2 * 9000)
    assert np.rad2deg(biases.gyr.std()) == pytest.approx(1.18, rel=confidence)
    assert biases.acc.std() / STANDARD_GRAVITY == pytest.approx(0.010, rel=confidence)
    mean = counted(felt(4000, 100), 100).counts.mean(axis=0) / FULL_SCALE
    mine = draw_biases(MPU9250, sensors=2, seed=5)
    np.testing.assert_allclose(mean[:, 3:6] * MPU9250.ranges.gyr, mine.gyr, atol=1e-4)
    np.testing.assert_allclose(mean[:, 0:3] * MPU9250.ranges.acc, mine.acc, atol=3e-3)


@given(st.floats(-30.0, 30.0))
def test_counts_are_the_nearest(value):
    counts = counted(felt(1, 100, value=value), 100, PERFECT).counts[0, 0]
    ranges = PERFECT.ranges
    for part, limit in ((0, ranges.acc), (3, ranges.gyr), (6, ranges.mag)):
        step = limit / FULL_SCALE
        assert abs(counts[part] * step - value) <= 0.5 * step * (1 + 1e-9)


def test_beyond_the_range_readings_stay_at_its_ends():
    above = counted(felt(1, 100, value=1e5), 100).counts
    below = counted(felt(1, 100, value=-1e5), 100).counts
    assert (above == FULL_SCALE - 1).all()
    assert (below == -FULL_SCALE).all()


def test_the_magnetometer_reads_a_hundred_times_a_second_and_repeats():
    exact = felt(1000, 1000)
    readings = counted(exact, 1000)
    assert readings.fresh.sum(axis=0).tolist() == [100, 100]
    assert readings.fresh[0].all()
    stale = ~readings.fresh[1:, 0]
    changed = (np.diff(readings.counts[..., 6:9], axis=0) != 0).any(axis=(1, 2))
    assert not changed[stale].any()
    assert changed[~stale].mean() > 0.95
    assert counted(felt(50, 50), 50).fresh.all()
