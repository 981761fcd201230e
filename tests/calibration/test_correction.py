"""The correction is the thesis's Kalman filter at its steady gain: a one-pole low-pass, no more."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.signal import lfilter

from handstudio.calibration.correction import CorrectionFilter, CorrectionState, steady_gain
from handstudio.errors import SetupError
from handstudio.samples import ImuSamples

FILTER = CorrectionFilter()
DEG = np.pi / 180.0


def samples(n=60, sensors=3, seed=0) -> ImuSamples:
    rng = np.random.default_rng(seed)
    silent = np.zeros((n, sensors), dtype=bool)
    return ImuSamples(
        time_us=np.arange(n, dtype=np.int64) * 10_000,
        gyr=rng.standard_normal((n, sensors, 3)),
        acc=9.81 + rng.standard_normal((n, sensors, 3)),
        mag=np.full((n, sensors, 3), np.nan),
        fresh=silent,
        valid=~silent,
        saturated=silent,
    )


def with_damage(n=60) -> tuple[ImuSamples, np.ndarray]:
    """Sensors that answer late, not, and with no numbers; steps of all lengths."""
    whole, rng = samples(n), np.random.default_rng(1)
    valid = rng.uniform(size=(n, 3)) < [1.0, 0.7, 0.4]
    valid[:7, 2] = False
    gyr = whole.gyr.copy()
    gyr[20:23, 0] = np.nan
    return replace(whole, valid=valid, gyr=gyr), rng.uniform(0.5, 3.0, n)


def same(one: CorrectionState, other: CorrectionState) -> bool:
    return one.period_s == other.period_s and all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("level", "waited", "begun")
    )


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0])
@pytest.mark.parametrize("walk", [0.0, 2.5e-4, 0.3])
def test_the_kalman_filter_of_both_states_settles_at_the_steady_gain(rate_hz, walk):
    """(4.6) to (4.8) on (4.14), step by step, until the gain stands still."""
    q, white, h = 0.5, 6.5e-3, np.ones((1, 2))
    p, w, v = np.eye(2), np.diag([q, walk**2]) / rate_hz, white**2 * rate_hz
    for _ in range(5000):
        p = p + w
        k_inf = p @ h.T / (h @ p @ h.T + v)
        p = (np.eye(2) - k_inf @ h) @ p
    found = steady_gain(q, white, walk, rate_hz)
    np.testing.assert_allclose(found, k_inf[:, 0] * rate_hz, rtol=2e-3, atol=1e-9)
    assert found.bias == pytest.approx(found.signal * walk**2 / q)


def test_the_thesis_s_parameters_are_a_low_pass_of_about_10_hz():
    corners = [gain.decay / (2.0 * np.pi) for gain in FILTER.gains(100.0)]
    np.testing.assert_allclose(corners, [10.3, 9.1], atol=0.1)
    assert all(gain.share > 1.0 - 1e-6 for gain in FILTER.gains(100.0))


def test_it_is_the_matrix_exponential_of_the_thesis():
    """(4.16), both states, against one number an axis."""
    strange = CorrectionFilter(gyr_walk=0.4 * DEG)  # so that the bias has a share one can see
    read = samples(sensors=1)
    gain, _ = strange.gains(100.0)
    k = np.array([gain.signal, gain.bias])
    step = expm(-np.outer(k, np.ones(2)) * 0.01)
    x = k / gain.decay * read.gyr[0, 0, 0]
    out, _ = strange.run(strange.begin(1), read, np.ones(60))
    for n in range(1, 60):
        x = step @ x + k / gain.decay * (1.0 - np.exp(-gain.decay * 0.01)) * read.gyr[n, 0, 0]
        assert out.gyr[n, 0, 0] == pytest.approx(x[0], rel=1e-12)
    assert 0.1 < gain.bias / gain.signal < 0.5


def test_it_is_a_first_order_low_pass_and_leaves_a_constant_alone():
    read = samples(400)
    out, _ = FILTER.run(FILTER.begin(3), read, np.ones(400))
    for name, gain in zip(("gyr", "acc"), FILTER.gains(100.0), strict=True):
        pole, z = np.exp(-gain.decay * 0.01), getattr(read, name)
        expected, _ = lfilter([1.0 - pole], [1.0, -pole], z, axis=0, zi=pole * z[:1])
        np.testing.assert_allclose(getattr(out, name), gain.share * expected, rtol=1e-9, atol=1e-12)
    still = replace(read, gyr=np.full_like(read.gyr, 0.02))
    out, _ = FILTER.run(FILTER.begin(3), still, np.ones(400))
    np.testing.assert_allclose(out.gyr, 0.02, rtol=1e-6)  # a bias goes through whole


def test_a_missed_reading_is_a_longer_step():
    read = samples(3)
    valid = read.valid.copy()
    valid[1] = False
    missed, state = FILTER.run(FILTER.begin(3), replace(read, valid=valid), np.ones(3))
    two = replace(read[:2], gyr=read.gyr[::2], acc=read.acc[::2])
    longer, other = FILTER.run(FILTER.begin(3), two, np.array([1.0, 2.0]))
    np.testing.assert_allclose(missed.gyr[2], longer.gyr[1], rtol=1e-14)
    np.testing.assert_allclose(state.level, other.level, rtol=1e-14)
    np.testing.assert_array_equal(missed.gyr[1], read.gyr[1])


@settings(max_examples=30)
@given(st.lists(st.integers(0, 60), max_size=6))
def test_cutting_the_samples_anywhere_changes_no_digit_nor_does_saving(cuts):
    for read, stretch in (with_damage(), (samples(), np.ones(60))):
        whole, end = FILTER.run(FILTER.begin(3), read, stretch)
        state, parts = FILTER.begin(3), []
        edges = [0, *sorted(cuts), 60]
        for a, b in pairwise(edges):
            state = FILTER.unpack(FILTER.pack(state))
            part, state = FILTER.run(state, read[a:b], stretch[a:b])
            parts.append(part)
        for name in ("gyr", "acc"):
            joined = np.concatenate([getattr(part, name) for part in parts])
            np.testing.assert_array_equal(joined, getattr(whole, name))
        assert same(state, end)


def test_a_restart_settles_anew():
    read = samples()
    _, state = FILTER.run(FILTER.begin(3), read, np.ones(60))
    out, _ = FILTER.run(FILTER.restart(state), read, np.ones(60))
    np.testing.assert_allclose(out.gyr[0], read.gyr[0], rtol=1e-6)


def test_other_bytes_and_impossible_densities_are_refused():
    with pytest.raises(SetupError, match="not one of correction"):
        FILTER.unpack(b"\x80")
    with pytest.raises(SetupError, match="gyr_white of the correction cannot be 0"):
        CorrectionFilter(gyr_white=0.0)
