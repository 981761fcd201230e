"""Placing, gaps, restarts and silence: named faults, against the truth of a simulated hand."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from handstudio import pipeline
from handstudio.calibration.correction import CorrectionFilter
from handstudio.calibration.rest import REST_S
from handstudio.errors import SetupError
from handstudio.fusion.raw import RawFilter
from handstudio.layout import Layout, SensorPlace
from handstudio.maths import so3
from handstudio.pipeline import BRIDGE_S, Doubt, Motion
from handstudio.samples import STANDARD_GRAVITY, Event, Gap, ImuSamples, Why
from handstudio.setup import Setup

PERIOD_US = 10_000
WINDOW = round(REST_S * 100)


def run(setup: Setup, *events: Event) -> Motion:
    return pipeline.run(setup, pipeline.begin(setup), events)[0]


def error_deg(motion: Motion, truth: np.ndarray) -> np.ndarray:
    return np.rad2deg(so3.angle_between(motion.q_world_sensor, truth))


def unplaced(motion: Motion) -> np.ndarray:
    return (motion.doubt & Doubt.UNPLACED).astype(bool)


# --- placing ----------------------------------------------------------------------------------


def test_sensors_are_placed_by_half_a_second_of_rest(performance):
    motion = run(performance.setup, performance.samples)
    placed = ~unplaced(motion)
    assert np.argmax(placed, axis=0).tolist() == [WINDOW - 1] * 4
    assert placed[WINDOW - 1 :].all()
    at_once = error_deg(motion, performance.truth.q_world_sensor)[WINDOW - 1]
    assert (at_once < 3.0).all()  # what compass and accelerometer of such a sensor are good for


def test_perfect_sensors_are_placed_perfectly_and_followed_closely(perfect):
    motion = run(perfect.setup, perfect.samples)
    error = error_deg(motion, perfect.truth.q_world_sensor)
    assert error[WINDOW - 1 : 120].max() < 1e-9
    # 430 deg/s at most, of which a rate read at the end of its step is late by half a step
    assert error[WINDOW - 1 :].max() < 5.0


def test_before_any_rest_there_is_an_orientation_and_a_doubt(performance):
    moving = performance.samples[130:180]
    motion = run(performance.setup, moving)
    assert unplaced(motion).all()
    assert np.isnan(motion.q_world_start).all()
    np.testing.assert_allclose(np.linalg.norm(motion.q_world_sensor, axis=-1), 1.0, atol=1e-9)


def test_the_start_is_the_first_rest_of_the_forearm_and_stays_over_gaps_and_restarts(
    performance, without
):
    samples = performance.samples
    later = replace(samples, time_us=samples.time_us + 1)
    motion = run(performance.setup, without(samples, 250, 380), Gap(Why.RESTART, 0, 1), later)
    start = motion.q_world_start
    assert np.isnan(start[: WINDOW - 1]).all()
    assert np.isfinite(start[WINDOW - 1 :]).all()
    assert (start[WINDOW - 1 :] == start[WINDOW - 1]).all()
    truth = performance.truth.q_world_sensor[0, 0]
    assert np.rad2deg(so3.angle_between(start[-1], truth)) < 3.0


def test_nothing_that_comes_out_is_nan_but_the_start_before_it_is_there(performance):
    samples = performance.samples
    mag = samples.mag.copy()
    mag[::3] = np.nan  # a compass that is slower than the rest, as imports have it
    slower = replace(samples, mag=mag, fresh=np.isfinite(mag).all(axis=-1))
    blind = replace(samples, mag=np.full_like(mag, np.nan), fresh=np.zeros_like(samples.fresh))
    for one in (slower, blind):
        motion = run(performance.setup, one)
        assert np.isfinite(motion.q_world_sensor).all()
        assert np.isfinite(motion.q_world_start[WINDOW - 1 :]).all()


# --- gaps -------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", [135, 150, 165, 220])
@pytest.mark.parametrize("lost", [1, 5, 10, 24])
def test_over_a_short_gap_orientations_are_carried_by_what_is_on_both_sides(
    perfect, without, first, lost
):
    setup, samples = perfect.setup, perfect.samples
    after = run(setup, without(samples, first, first + lost))[first:]
    unbroken = run(setup, samples)[first + lost :]
    assert not unplaced(after).any()
    flagged = (after.doubt & Doubt.AFTER_GAP).astype(bool)
    assert flagged[0].all()
    assert not flagged[1:].any()
    cost = error_deg(after, unbroken.q_world_sensor).max()
    # holding still would have cost 8, 24, 45 and 90 degrees
    assert cost < {1: 0.05, 5: 0.5, 10: 2.5, 24: 25.0}[lost]


def test_over_a_long_gap_nothing_is_carried_and_all_wait_for_a_rest(performance, without):
    setup, samples, truth = performance.setup, performance.samples, performance.truth
    first, last = 170, 170 + round(BRIDGE_S * 100) + 5
    motion = run(setup, without(samples, first, last))
    placed = ~unplaced(motion)
    assert placed[first - 1].all()
    assert (motion.doubt[first] & Doubt.AFTER_GAP).all()
    still_from = 350 - (last - first)  # the script's next rest
    assert not placed[first:still_from].any()
    # the motion ends softly, so its last instants already count as rest
    again = first + np.argmax(placed[first:], axis=0)
    assert (again > still_from + WINDOW - 20).all()
    assert (again < still_from + WINDOW).all()
    error = error_deg(motion[again.max() :], truth.q_world_sensor[again.max() + last - first :])
    assert error[:50].max() < 3.0
    assert error.max() < 7.0


@pytest.mark.parametrize(("lost", "bridged"), [(24, True), (25, False)])
def test_a_quarter_of_a_second_is_the_longest_gap_that_is_bridged(
    performance, without, lost, bridged
):
    motion = run(performance.setup, without(performance.samples, 150, 150 + lost))
    assert unplaced(motion)[150].any() != bridged


def test_a_rest_does_not_reach_over_a_gap(performance, without):
    motion = run(performance.setup, without(performance.samples, 30, 31))
    assert np.argmax(~unplaced(motion), axis=0).tolist() == [30 + WINDOW - 1] * 4


def turning(clock_us: np.ndarray, dps: float) -> tuple[Setup, ImuSamples]:
    """A sensor without a compass, level, that rests and then turns steadily about the vertical."""
    n = len(clock_us)
    flags = np.ones((n, 1), dtype=bool)
    gyr = np.zeros((n, 1, 3))
    gyr[WINDOW:, 0, 2] = np.deg2rad(dps)
    samples = ImuSamples(
        time_us=clock_us,
        gyr=gyr,
        acc=np.tile([0.0, 0.0, STANDARD_GRAVITY], (n, 1, 1)),
        mag=np.full((n, 1, 3), np.nan),
        fresh=~flags,
        valid=flags,
        saturated=~flags,
    )
    return Setup(Layout("unknown", (SensorPlace("IMU", "body"),), ()), 100.0), samples


@pytest.mark.parametrize("periods", [0.6, 1.0, 1.4, 1.7, 2.4, 3.0, 7.5, 20.3])
def test_a_step_of_any_length_turns_as_far_as_it_lasted(periods):
    clock_us = np.arange(200) * PERIOD_US
    clock_us[100:] += round((periods - 1.0) * PERIOD_US)
    setup, samples = turning(clock_us, dps=90.0)
    motion = run(setup, samples)
    turned = np.unwrap(so3.heading(motion.q_world_sensor[:, 0]))
    expected = np.deg2rad(90.0) * (clock_us - clock_us[WINDOW - 1]) * 1e-6
    np.testing.assert_allclose(np.rad2deg(turned - expected)[WINDOW:], 0.0, atol=0.05)


def test_a_clock_that_jitters_does_not_matter():
    """Imports have times of their own; the signals are what was true at them."""
    rng = np.random.default_rng(4)
    clock_us = np.arange(400) * PERIOD_US
    clock_us[WINDOW:] += rng.integers(-2000, 2000, 400 - WINDOW)
    setup, samples = turning(clock_us, dps=90.0)
    motion = run(setup, samples)
    turned = np.unwrap(so3.heading(motion.q_world_sensor[:, 0]))
    expected = np.deg2rad(90.0) * (clock_us - clock_us[WINDOW - 1]) * 1e-6
    np.testing.assert_allclose(np.rad2deg(turned - expected)[WINDOW:], 0.0, atol=0.2)


# --- restarts ---------------------------------------------------------------------------------


@pytest.mark.parametrize("elapsed_us", [2_500_000, 987_654_321])
def test_after_a_restart_the_time_axis_goes_on_by_the_hosts_clock(performance, elapsed_us):
    samples = performance.samples
    anew = replace(samples, time_us=samples.time_us + 123)  # a clock that began at its own 0
    motion = run(
        performance.setup,
        samples[:300],
        Gap(Why.RESTART, 0, elapsed_us),
        anew[:100],
        anew[100:200],
    )
    steps = np.diff(motion.time_us)
    assert steps[299] == elapsed_us
    assert (np.delete(steps, 299) == PERIOD_US).all()


@pytest.mark.parametrize("elapsed_us", [0, -5_000_000, 9_999])
def test_time_goes_forward_even_where_the_host_saw_none_pass(performance, elapsed_us):
    samples = performance.samples
    motion = run(performance.setup, samples[:300], Gap(Why.RESTART, 0, elapsed_us), samples[:100])
    assert (np.diff(motion.time_us) == PERIOD_US).all()


def test_restarts_add_up(performance):
    part = performance.samples[:10]
    away = Gap(Why.RESTART, 0, 1_000_000)
    motion = run(performance.setup, part, away, part, away, away, part)
    steps = np.diff(motion.time_us)
    assert steps[9] == 1_000_000
    assert steps[19] == 1_000_000  # two in a row with nothing between: the time since the last


def test_after_a_restart_all_wait_for_a_rest(performance):
    setup, samples, truth = performance.setup, performance.samples, performance.truth
    motion = run(setup, samples[:120], Gap(Why.RESTART, 0, 50_000), samples[130:])
    placed = ~unplaced(motion)
    assert placed[119].all()
    assert not placed[120:340].any()
    assert placed[400:].all()
    assert error_deg(motion[400:450], truth.q_world_sensor[410:460]).max() < 3.0


def test_a_restart_before_anything_else_is_no_more_than_a_beginning(performance):
    setup, samples = performance.setup, performance.samples[:100]
    motion = run(setup, Gap(Why.RESTART, 0, 1234), samples)
    expected = run(setup, samples)
    for name in Motion.__slots__:
        np.testing.assert_array_equal(getattr(motion, name), getattr(expected, name))


# --- silence and saturation -------------------------------------------------------------------


def silenced(samples: ImuSamples, sensor: int, instants: slice) -> ImuSamples:
    valid = samples.valid.copy()
    valid[instants, sensor] = False
    signals = {kind: getattr(samples, kind).copy() for kind in ("gyr", "acc", "mag")}
    for signal in signals.values():
        signal[instants, sensor] = 0.0
    return replace(samples, valid=valid, **signals)


def test_a_silent_sensor_is_held_and_flagged_and_harms_no_other(performance):
    setup, samples = performance.setup, performance.samples
    motion = run(setup, silenced(samples, 2, slice(140, 150)))
    expected = run(setup, samples)
    others = [0, 1, 3]
    np.testing.assert_array_equal(
        motion.q_world_sensor[:, others], expected.q_world_sensor[:, others]
    )
    np.testing.assert_array_equal(motion.doubt[:, others], expected.doubt[:, others])
    silent = (motion.doubt[:, 2] & Doubt.SILENT).astype(bool)
    assert np.flatnonzero(silent).tolist() == list(range(140, 150))
    assert (motion.q_world_sensor[140:150, 2] == motion.q_world_sensor[139, 2]).all()


def test_a_sensor_that_was_silent_for_long_is_in_doubt_until_it_rests(performance):
    """Its segment may have turned anywhere meanwhile, and nothing has noticed."""
    setup, samples, truth = performance.setup, performance.samples, performance.truth
    motion = run(setup, silenced(samples, 2, slice(130, 200)))
    doubt = unplaced(motion)[:, 2]
    error = error_deg(motion, truth.q_world_sensor)[:, 2]
    assert error[205] > 20.0
    assert doubt[200:350].all()
    assert not doubt[400:].any()
    assert error[400:].max() < 5.0
    assert not unplaced(motion)[WINDOW:, [0, 1, 3]].any()


def test_a_saturated_reading_is_flagged(performance):
    saturated = performance.samples.saturated.copy()
    saturated[200, 3] = True
    motion = run(performance.setup, replace(performance.samples, saturated=saturated))
    flagged = np.argwhere(motion.doubt & Doubt.SATURATED)
    assert flagged.tolist() == [[200, 3]]


# --- corrected outputs ------------------------------------------------------------------------


def test_correction_is_off_and_when_on_what_is_fused_is_what_it_puts_out(performance):
    setup, samples = performance.setup, performance.samples
    assert setup.correction is None
    correction = CorrectionFilter()
    on = msgspec.structs.replace(setup, correction=correction)
    state = correction.begin(len(setup.layout.sensors), setup.rate_hz)
    put_out, _ = correction.run(state, samples, np.ones(len(samples)))
    corrected = run(on, samples).q_world_sensor
    np.testing.assert_array_equal(corrected, run(setup, put_out).q_world_sensor)
    assert not np.array_equal(corrected, run(setup, samples).q_world_sensor)


def test_it_takes_noise_off_a_resting_sensor_and_lags_behind_a_moving_one(perfect):
    setup = msgspec.structs.replace(perfect.setup, filter=RawFilter())
    on = msgspec.structs.replace(setup, correction=CorrectionFilter())
    samples = perfect.samples
    shaken = 0.3 * np.random.default_rng(4).standard_normal(samples.gyr[:100].shape)
    noisy = replace(samples[:100], gyr=samples.gyr[:100] + shaken)
    steps = [_steps_deg(run(one, noisy)).mean() for one in (setup, on)]
    assert steps[1] < 0.6 * steps[0]
    behind = error_deg(run(on, samples), run(setup, samples).q_world_sensor)[130:190, 3]
    fast = np.rad2deg(np.linalg.norm(samples.gyr[130:190, 3], axis=-1))
    assert behind.max() == pytest.approx(0.015 * fast.max(), rel=0.3)  # 1 / lambda


def _steps_deg(motion: Motion) -> np.ndarray:
    q = motion.q_world_sensor[60:]
    return np.rad2deg(so3.angle_between(q[1:], q[:-1]))


def test_nothing_of_before_a_long_gap_is_in_what_is_corrected_after_it(performance):
    setup = msgspec.structs.replace(performance.setup, correction=CorrectionFilter())
    samples = performance.samples
    _, over = pipeline.run(setup, pipeline.begin(setup), [samples[:100], samples[150:160]])
    _, anew = pipeline.run(setup, pipeline.begin(setup), [samples[150:160]])
    np.testing.assert_array_equal(over.correction.level, anew.correction.level)
    later = replace(samples[150:160], time_us=samples.time_us[:10])
    restart = [samples[:100], Gap(Why.RESTART, 0, 10_000), later]
    _, over = pipeline.run(setup, pipeline.begin(setup), restart)
    np.testing.assert_array_equal(over.correction.level, anew.correction.level)


# --- states that are none ---------------------------------------------------------------------


def test_bytes_that_are_no_state_are_refused_with_a_way_to_go_on(performance):
    setup = performance.setup
    state = pipeline.begin(setup)
    packed = pipeline.pack(setup, state)
    later = msgspec.msgpack.encode({**msgspec.msgpack.decode(packed), "version": 99})
    for wrong in (b"", b"\xc1", packed[:-3], later):
        with pytest.raises(SetupError, match="--from-start"):
            pipeline.unpack(setup, wrong)
