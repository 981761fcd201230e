"""What every filter promises, held against each that a setup can name."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handstudio.errors import SetupError
from handstudio.fusion.filter import Filter, WholeFilter
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.samples import FULL_SCALE, STANDARD_GRAVITY, ImuSamples
from handstudio.setup import FILTERS
from handstudio.simulation.imperfections import MPU9250, read, switched_on
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject

RATE_HZ = 200.0
N = 300
SENSORS = 3
FIELD = np.array([31.0, 0.0, -35.0])
LATE = np.deg2rad(1.5)

SLOW = {"filter2", "filter3", "filter4"}
"""Filters in numpy with matrices a step: fewer examples of them."""

CUTS = st.lists(st.integers(0, N), max_size=6).map(sorted)
filters = pytest.mark.parametrize("name", sorted(FILTERS))


@pytest.fixture(scope="module")
def samples() -> ImuSamples:
    """Forearm, hand and a fingertip of a fist, as real sensors read it; compass at 100 Hz."""
    layout = glove("right", ["SN1", "SN11", "SN17"])
    time_us = 4_700_000 + np.arange(N) * 5000
    exact, _ = signals(ideal_subject("right"), layout, showcase("right"), time_us)
    readings, _ = read(MPU9250, 3, 200, switched_on(SENSORS), exact)
    si, ranges = readings.counts / FULL_SCALE, MPU9250.ranges
    return replace(
        exact,
        acc=si[..., 0:3] * ranges.acc,
        gyr=si[..., 3:6] * ranges.gyr,
        mag=si[..., 6:9] * ranges.mag,
        fresh=readings.fresh,
    )


@pytest.fixture(scope="module")
def stretch() -> np.ndarray:
    """Some steps are longer or shorter than nominal."""
    return np.random.default_rng(1).choice([0.8, 1.0, 1.0, 1.0, 1.4], N)


@pytest.fixture(scope="module")
def heeded() -> np.ndarray:
    """The second sensor is silent now and then, the third at the start."""
    heeded = np.ones((N, SENSORS), dtype=bool)
    heeded[40:55, 1] = heeded[200:, 1] = heeded[:10, 2] = False
    return heeded


def resting(q_world_sensor: np.ndarray, n: int, gyr: np.ndarray | None = None) -> ImuSamples:
    """Sensors that rest in these attitudes and read this rate."""
    back = so3.conjugate(q_world_sensor)
    shape = (n, *q_world_sensor.shape[:-1])
    flags = np.ones(shape, dtype=bool)
    up = so3.rotate(back, np.array([0.0, 0.0, STANDARD_GRAVITY]))
    return ImuSamples(
        time_us=np.arange(n) * 5000,
        gyr=np.broadcast_to(np.zeros(3) if gyr is None else gyr, (*shape, 3)).copy(),
        acc=np.broadcast_to(up, (*shape, 3)).copy(),
        mag=np.broadcast_to(so3.rotate(back, FIELD), (*shape, 3)).copy(),
        fresh=flags,
        valid=flags,
        saturated=~flags,
    )


def fuse(fusion: Filter[Any], state: Any, samples: ImuSamples) -> tuple[np.ndarray, Any]:
    """At nominal steps, every reading heeded."""
    return fusion.run(state, samples, np.ones(len(samples)), samples.valid)


# --- the same digits however it is called -----------------------------------------------------


@filters
def test_it_is_a_filter_and_a_value(name):
    assert isinstance(FILTERS[name], Filter)
    assert hash(FILTERS[name]) == hash(type(FILTERS[name])())


@pytest.mark.parametrize("name", sorted(set(FILTERS) - SLOW))
@settings(max_examples=25)
@given(cuts=CUTS)
def test_cutting_the_samples_or_putting_the_state_away_changes_no_digit(
    name, cuts, samples, stretch, heeded
):
    cut_and_put_away(FILTERS[name], cuts, samples, stretch, heeded)


@pytest.mark.parametrize("name", sorted(SLOW))
@settings(max_examples=8)
@given(cuts=CUTS)
def test_cutting_what_slow_filters_fuse_changes_no_digit_either(
    name, cuts, samples, stretch, heeded
):
    cuts = [cut // 3 for cut in cuts]
    cut_and_put_away(FILTERS[name], cuts, samples[:100], stretch[:100], heeded[:100])


def cut_and_put_away(fusion, cuts, samples, stretch, heeded):
    whole, after = fusion.run(fusion.begin(SENSORS, RATE_HZ), samples, stretch, heeded)
    state, parts = fusion.begin(SENSORS, RATE_HZ), []
    for start, end in pairwise([0, *cuts, len(samples)]):
        packed = fusion.pack(state)
        state = fusion.unpack(packed)
        assert fusion.pack(state) == packed
        piece = slice(start, end)
        fused, state = fusion.run(state, samples[piece], stretch[piece], heeded[piece])
        parts.append(fused)
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert fusion.pack(state) == fusion.pack(after)


@filters
def test_no_call_alters_the_state_it_is_given(name, samples):
    fusion = FILTERS[name]
    _, state = fuse(fusion, fusion.begin(SENSORS, RATE_HZ), samples[:50])
    before = fusion.pack(state)
    fuse(fusion, state, samples[50:])
    fusion.place(state, 1, so3.exp(np.ones(3)), np.ones(3))
    fusion.restart(state)
    assert fusion.pack(state) == before


@filters
def test_nothing_in_nothing_out(name, samples):
    fusion = FILTERS[name]
    _, state = fuse(fusion, fusion.begin(SENSORS, RATE_HZ), samples[:50])
    none, after = fuse(fusion, state, samples[:0])
    assert none.shape == (0, SENSORS, 4)
    assert fusion.pack(after) == fusion.pack(state)


@filters
def test_what_comes_out_are_rotations(name, samples, stretch, heeded):
    fusion = FILTERS[name]
    fused, _ = fusion.run(fusion.begin(SENSORS, RATE_HZ), samples, stretch, heeded)
    np.testing.assert_allclose(np.linalg.norm(fused, axis=-1), 1.0, atol=1e-12)


# --- silence ----------------------------------------------------------------------------------


@filters
def test_where_a_reading_is_not_heeded_the_orientation_is_held(name, samples, stretch, heeded):
    fusion = FILTERS[name]
    begun = fusion.begin(SENSORS, RATE_HZ)
    fused, _ = fusion.run(begun, samples, stretch, heeded)
    for sensor in range(SENSORS):
        for k in np.flatnonzero(~heeded[1:, sensor]) + 1:
            turned = so3.angle_between(fused[k, sensor], fused[k - 1, sensor])
            # one that sees all together still makes use of the reading before
            assert turned < (LATE if isinstance(fusion, WholeFilter) else 1e-12)
    moved = np.any(fused[1:] != fused[:-1], axis=-1)
    assert moved[heeded[1:]].all()


@filters
def test_what_an_unheeded_reading_says_does_not_matter(name, samples, stretch, heeded):
    fusion = FILTERS[name]
    signals = {kind: getattr(samples, kind).copy() for kind in ("gyr", "acc", "mag")}
    for signal in signals.values():
        signal[~heeded] = np.nan
    begun = fusion.begin(SENSORS, RATE_HZ)
    expected, _ = fusion.run(begun, samples, stretch, heeded)
    fused, _ = fusion.run(begun, replace(samples, **signals), stretch, heeded)
    np.testing.assert_array_equal(fused, expected)


# --- placing ----------------------------------------------------------------------------------

ATTITUDES = so3.exp(np.random.default_rng(7).uniform(-2.0, 2.0, size=(6, 3)))
BIAS = np.deg2rad([2.5, -1.0, 3.2])


@filters
def test_a_placed_sensor_that_rests_stays_where_it_was_placed(name):
    fusion = FILTERS[name]
    state = fusion.begin(len(ATTITUDES), RATE_HZ)
    for sensor, q in enumerate(ATTITUDES):
        state = fusion.place(state, sensor, q, BIAS)
    fused, _ = fuse(fusion, state, resting(ATTITUDES, 800, BIAS))
    assert np.rad2deg(so3.angle_between(fused, ATTITUDES).max()) < 1e-3


@filters
def test_placing_holds_before_the_first_reading_is_heeded(name):
    fusion, q = FILTERS[name], ATTITUDES[0]
    state = fusion.place(fusion.begin(2, RATE_HZ), 1, q, BIAS)
    samples = resting(ATTITUDES[:2], 5)
    fused, _ = fusion.run(state, samples, np.ones(5), np.zeros((5, 2), dtype=bool))
    assert so3.angle_between(fused[:, 1], q).max() < 1e-12


@filters
def test_placing_one_sensor_alters_no_other(name, samples):
    fusion = FILTERS[name]
    _, state = fuse(fusion, fusion.begin(SENSORS, RATE_HZ), samples[:50])
    expected, _ = fuse(fusion, state, samples[50:])
    fused, _ = fuse(fusion, fusion.place(state, 1, ATTITUDES[0], BIAS), samples[50:])
    np.testing.assert_array_equal(fused[:, [0, 2]], expected[:, [0, 2]])
    assert np.any(fused[:, 1] != expected[:, 1])


@filters
def test_a_restart_forgets_the_attitude_and_keeps_the_bias(name, samples):
    fusion = FILTERS[name]
    state = fusion.begin(SENSORS, RATE_HZ)
    for sensor in range(SENSORS):
        state = fusion.place(state, sensor, ATTITUDES[sensor], BIAS)
    _, state = fuse(fusion, state, samples[:50])
    biased = replace(samples, gyr=samples.gyr + BIAS)
    again, _ = fuse(fusion, fusion.restart(state), biased)
    anew, _ = fuse(fusion, fusion.begin(SENSORS, RATE_HZ), samples)
    # a filter that goes on learning biases knows them better the second time
    assert so3.angle_between(again, anew).max() < (
        LATE if isinstance(fusion, WholeFilter) else 1e-9
    )


@filters
def test_a_restarted_sensor_that_is_silent_still_shows_its_last_orientation(name, samples):
    fusion = FILTERS[name]
    fused, state = fuse(fusion, fusion.begin(SENSORS, RATE_HZ), samples[:50])
    silent = np.zeros((5, SENSORS), dtype=bool)
    held, _ = fusion.run(fusion.restart(state), samples[50:55], np.ones(5), silent)
    assert so3.angle_between(held, fused[-1]).max() < 1e-12


# --- what it is for ---------------------------------------------------------------------------


@filters
def test_a_sensor_at_rest_is_found_in_its_attitude_within_seconds(name):
    fusion = FILTERS[name]
    fused, _ = fuse(fusion, fusion.begin(6, RATE_HZ), resting(ATTITUDES, 400))
    assert np.rad2deg(so3.angle_between(fused[-1], ATTITUDES).max()) < 0.1


@filters
def test_a_longer_step_turns_farther(name):
    fusion = FILTERS[name]
    rate = np.array([0.0, 0.0, 1.0])  # about the vertical: gravity says nothing against it
    level = so3.about_z(np.array([0.3]))
    samples = replace(resting(level, 2, rate), fresh=np.zeros((2, 1), dtype=bool))
    state = fusion.place(fusion.begin(1, RATE_HZ), 0, level[0], np.zeros(3))
    fused, _ = fusion.run(state, samples, np.array([1.0, 3.0]), samples.valid)
    turned = so3.angle_between(fused[1:, 0], fused[:-1, 0])
    np.testing.assert_allclose(turned, 3.0 / RATE_HZ, rtol=1e-3)


@filters
@pytest.mark.parametrize("packed", [b"", b"\xc1", b"\x80", b'{"kind":"?"}'])
def test_bytes_that_are_no_state_are_refused(name, packed):
    with pytest.raises(SetupError, match="filter state"):
        FILTERS[name].unpack(packed)


@filters
def test_the_state_of_another_filter_is_refused(name, samples):
    fusion = FILTERS[name]
    packed = fusion.pack(fusion.begin(1, RATE_HZ))
    assert name.encode() in packed
    with pytest.raises(SetupError, match="filter state"):
        fusion.unpack(packed.replace(name.encode(), b"x" * len(name)))
