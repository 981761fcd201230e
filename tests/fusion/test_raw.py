"""Raw: nothing but the gyroscope's Euler rates, with all that goes wrong with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.calibration.attitude import attitude
from handstudio.fusion.raw import RawFilter
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY, ImuSamples

FIELD = np.array([31.0, 0.0, -35.0])
RAW = RawFilter()


def turning(gyr: np.ndarray, q_world_sensor: np.ndarray, rate_hz: float) -> ImuSamples:
    """Sensors that read these rates and feel gravity and field as in these attitudes."""
    back = so3.conjugate(q_world_sensor)
    n, s = gyr.shape[:2]
    flags = np.ones((n, s), dtype=bool)
    return ImuSamples(
        time_us=np.round(np.arange(n) * 1e6 / rate_hz).astype(np.int64),
        gyr=gyr,
        acc=so3.rotate(back, np.array([0.0, 0.0, STANDARD_GRAVITY])),
        mag=so3.rotate(back, FIELD),
        fresh=flags,
        valid=flags,
        saturated=~flags,
    )


def swinging(rate_hz: float, seconds: float = 2.0) -> tuple[ImuSamples, np.ndarray]:
    """A sensor that sways about an oblique axis, away from the singularity, and its truth.

    Rates are those of the middle of the step that leads to each sample.
    """
    t = (np.arange(round(seconds * rate_hz)) + 1.0) / rate_hz
    axis = so3.rotate(so3.exp(np.array([0.2, 0.4, 0.1])), np.array([0.6, 0.0, 0.8]))
    truth = so3.multiply(so3.about_z(0.5), so3.exp(np.sin(2.0 * t)[:, None] * axis))
    speed = 2.0 * np.cos(2.0 * (t - 0.5 / rate_hz))
    gyr = speed[:, None, None] * axis
    return turning(gyr, truth[:, None], rate_hz), truth[:, None]


def summed(rate_hz: float) -> float:
    """Largest error [rad] over a known motion."""
    samples, truth = swinging(rate_hz)
    state = RAW.place(RAW.begin(1, rate_hz), 0, so3.about_z(0.5), np.zeros(3))
    out, _ = RAW.run(state, samples, np.ones(len(samples)), samples.valid)
    return float(so3.angle_between(out, truth).max())


def test_a_known_motion_is_followed_to_first_order():
    coarse, fine = summed(100.0), summed(1000.0)
    assert np.rad2deg(coarse) < 1.5
    assert coarse / fine == pytest.approx(10.0, rel=0.1)


def test_a_turn_about_the_vertical_of_a_level_sensor_is_exact():
    gyr = np.zeros((300, 1, 3))
    gyr[..., 2] = 7.0
    q = so3.about_z(7.0 * (np.arange(300) + 1.0) / 100.0)[:, None]
    state = RAW.place(RAW.begin(1, 100.0), 0, so3.about_z(0.0), np.zeros(3))
    samples = turning(gyr, q, 100.0)
    out, _ = RAW.run(state, samples, np.ones(300), samples.valid)
    assert so3.angle_between(out, q).max() < 1e-9


def test_once_placed_it_heeds_neither_accelerometer_nor_compass():
    samples, truth = swinging(100.0)
    state = RAW.place(RAW.begin(1, 100.0), 0, truth[0, 0], np.zeros(3))
    expected, _ = RAW.run(state, samples, np.ones(len(samples)), samples.valid)
    rng = np.random.default_rng(2)
    wild = replace(samples, acc=rng.normal(size=samples.acc.shape), mag=-samples.mag)
    out, _ = RAW.run(state, wild, np.ones(len(samples)), samples.valid)
    np.testing.assert_array_equal(out, expected)


def test_a_bias_that_rest_did_not_tell_is_summed_for_ever():
    q = np.tile([1.0, 0.0, 0.0, 0.0], (1000, 1, 1))
    left = np.deg2rad(0.5)
    samples = turning(np.full((1000, 1, 3), [0.0, 0.0, left]), q, 100.0)
    state = RAW.place(RAW.begin(1, 100.0), 0, q[0, 0], np.zeros(3))
    out, _ = RAW.run(state, samples, np.ones(1000), samples.valid)
    assert np.rad2deg(so3.angle_between(out[-1], q[-1])) == pytest.approx(5.0)


def test_unplaced_it_begins_where_accelerometer_and_compass_say():
    samples, truth = swinging(100.0)
    out, _ = RAW.run(RAW.begin(1, 100.0), samples, np.ones(len(samples)), samples.valid)
    assert so3.angle_between(out[0], truth[0]).max() < 1e-12
    assert np.rad2deg(so3.angle_between(out, truth).max()) < 1.5


def test_its_heading_begins_at_the_first_fresh_reading_of_the_compass():
    samples, truth = swinging(100.0)
    mag, fresh = samples.mag.copy(), samples.fresh.copy()
    fresh[:7] = False
    mag[7] = np.nan  # fresh, and no number
    samples = replace(samples, mag=mag, fresh=fresh)
    out, after = RAW.run(RAW.begin(1, 100.0), samples, np.ones(len(samples)), samples.valid)
    error = np.abs(so3.heading(so3.multiply(out, so3.conjugate(truth))))[:, 0]
    assert np.rad2deg(error[:8].min()) > 20.0
    assert np.rad2deg(error[8]) < 1.0
    assert after.headed.all()


def test_without_a_compass_it_begins_with_its_x_axis_to_the_north():
    q = so3.exp(np.random.default_rng(5).uniform(-2.0, 2.0, size=(1, 50, 3)))
    q[0, :2] = so3.IDENTITY, so3.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.pi)
    samples = turning(np.zeros((1, 50, 3)), q, 100.0)
    samples = replace(samples, fresh=~samples.fresh)
    out, _ = RAW.run(RAW.begin(50, 100.0), samples, np.ones(1), samples.valid)
    assert so3.angle_between(out, attitude(samples.acc)).max() < 1e-12


def test_after_a_restart_its_heading_is_found_anew():
    samples, truth = swinging(100.0)
    state = RAW.restart(RAW.place(RAW.begin(1, 100.0), 0, so3.about_z(2.0), np.zeros(3)))
    fresh = samples.fresh.copy()
    fresh[:4] = False
    out, _ = RAW.run(state, replace(samples, fresh=fresh), np.ones(len(samples)), samples.valid)
    assert np.rad2deg(so3.angle_between(out[4:], truth[4:]).max()) < 1.5


@pytest.mark.parametrize("degrees_per_s", [50.0, 300.0, 3000.0])
def test_it_survives_the_singularity(degrees_per_s):
    """Turned on from theta = 90 deg exactly, by all axes or by one."""
    gyr = np.zeros((400, 2, 3))
    gyr[..., 1] = np.deg2rad(degrees_per_s)
    gyr[:, 1, ::2] = 0.2
    at = so3.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.full(2, np.pi / 2))
    state = RAW.begin(2, 100.0)
    for sensor in range(2):
        state = RAW.place(state, sensor, at[sensor], np.zeros(3))
    samples = turning(gyr, np.broadcast_to(at, (400, 2, 4)), 100.0)
    out, after = RAW.run(state, samples, np.ones(400), samples.valid)
    np.testing.assert_allclose(np.linalg.norm(out, axis=-1), 1.0, atol=1e-9)
    assert np.abs(after.angles).max() < 1e4  # 1e-12 of a turn is still told apart


def test_a_turn_that_passes_near_the_singularity_costs_it_its_attitude():
    """Half a turn about its own y at 300 deg/s, from a roll that passes 1 deg or 45 deg beside."""
    n = 60
    gyr = np.zeros((n, 2, 3))
    gyr[..., 1] = np.deg2rad(300.0)
    rolled = so3.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.deg2rad([1.0, 45.0]))
    state = RAW.begin(2, 100.0)
    for sensor in range(2):
        state = RAW.place(state, sensor, rolled[sensor], np.zeros(3))
    samples = turning(gyr, np.broadcast_to(rolled, (n, 2, 4)), 100.0)
    out, _ = RAW.run(state, samples, np.ones(n), samples.valid)
    truth = so3.multiply(rolled, so3.exp(np.array([0.0, np.pi * n / 60, 0.0])))
    near, beside = np.rad2deg(so3.angle_between(out[-1], truth))
    assert near > 10.0
    assert beside < 5.0
