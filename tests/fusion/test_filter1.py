"""Filter 1: right at rest, misled in motion, as the thesis found it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.fusion import euler
from handstudio.fusion.filter1 import Filter1
from handstudio.fusion.raw import RawFilter
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY, ImuSamples
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject

FIELD = np.array([31.0, 0.0, -35.0])
AXES = np.eye(3)


def resting(q_world_sensor: np.ndarray, n: int, rate_hz: float = 100.0) -> ImuSamples:
    """Sensors that rest in these attitudes, (s, 4)."""
    back = so3.conjugate(q_world_sensor)
    flags = np.ones((n, len(back)), dtype=bool)
    shape = (n, len(back), 3)
    up = so3.rotate(back, np.array([0.0, 0.0, STANDARD_GRAVITY]))
    return ImuSamples(
        time_us=np.round(np.arange(n) * 1e6 / rate_hz).astype(np.int64),
        gyr=np.zeros(shape),
        acc=np.broadcast_to(up, shape).copy(),
        mag=np.broadcast_to(so3.rotate(back, FIELD), shape).copy(),
        fresh=flags,
        valid=flags,
        saturated=~flags,
    )


def fuse(fusion, samples, placed=None, rate_hz=100.0, magnetometer_rate_hz=None):
    """From where sensors are placed, or from the first sample."""
    state = fusion.begin(samples.gyr.shape[1], rate_hz, magnetometer_rate_hz)
    for sensor, q in enumerate(() if placed is None else placed):
        state = fusion.place(state, sensor, q, np.zeros(3))
    return fusion.run(state, samples, np.ones(len(samples)), samples.valid)


def attitudes(count: int) -> np.ndarray:
    return so3.exp(np.random.default_rng(3).uniform(-1.2, 1.2, size=(count, 3)))


# --- at rest ----------------------------------------------------------------------------------


def test_at_rest_it_goes_to_what_accelerometer_and_compass_say():
    truth = attitudes(5)
    wrong = so3.multiply(truth, so3.exp(np.full((5, 3), 0.1)))
    out, _ = fuse(Filter1(), resting(truth, 4000), placed=wrong)
    left = np.rad2deg(so3.angle_between(out, truth))
    assert left[0].min() > 9.0
    assert left[-1].max() < 0.01


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0])
@pytest.mark.parametrize(
    ("axis", "time_constant_s"), [(0, 2.5 / 0.65), (1, 2.5 / 0.65), (2, 2.8 / 0.65)]
)
def test_an_error_decays_with_the_ratio_of_the_noises_at_any_rate(axis, time_constant_s, rate_hz):
    level = np.array([[1.0, 0.0, 0.0, 0.0]])
    wrong = so3.from_axis_angle(AXES[axis], np.deg2rad([20.0]))
    samples = resting(level, round(16.0 * rate_hz), rate_hz)
    compass = np.zeros_like(samples.fresh)
    compass[:: round(rate_hz / 100.0)] = True
    samples = replace(samples, fresh=compass)
    out, _ = fuse(Filter1(), samples, wrong, rate_hz, magnetometer_rate_hz=100.0)
    error = so3.angle_between(out, level)[:, 0]
    settled = round(12.0 * rate_hz)  # by then the covariance stands
    later = settled + round(3.0 * rate_hz)
    measured = 3.0 / np.log(error[settled] / error[later])
    assert measured == pytest.approx(time_constant_s, rel=0.02)


def test_its_noises_set_how_fast_it_follows():
    level = np.array([[1.0, 0.0, 0.0, 0.0]])
    wrong = so3.from_axis_angle(AXES[0], np.deg2rad([20.0]))
    left = {}
    for factor in (1.0, 100.0, 1000.0):
        out, _ = fuse(Filter1(gyr_factor=factor), resting(level, 400), wrong)
        left[factor] = np.rad2deg(so3.angle_between(out[-1], level[0])).item()
    assert left[1.0] > 12.0 > left[100.0] > 1.0 > left[1000.0]


def test_the_shorter_way_round_is_taken():
    """South is +180 deg and -180 deg at once."""
    truth = so3.about_z(np.deg2rad([179.0]))
    placed = so3.about_z(np.deg2rad([-179.0]))
    out, _ = fuse(Filter1(), resting(truth, 2000), placed)
    error = np.rad2deg(so3.angle_between(out, truth))
    assert (np.diff(error[:, 0]) <= 1e-9).all()
    assert error[-1] < 0.1


# --- the compass ------------------------------------------------------------------------------


def test_without_a_fresh_reading_the_heading_is_not_observed():
    level, placed = np.array([[1.0, 0.0, 0.0, 0.0]]), so3.about_z(np.array([0.7]))
    samples = resting(level, 500)
    for silent in (
        replace(samples, fresh=np.zeros_like(samples.fresh)),
        replace(samples, mag=np.full_like(samples.mag, np.nan)),
    ):
        out, _ = fuse(Filter1(), silent, placed)
        assert so3.angle_between(out, placed).max() < 1e-12


def test_a_reading_that_is_not_fresh_is_not_looked_at():
    truth = attitudes(2)
    samples = resting(truth, 300)
    fresh = np.zeros_like(samples.fresh)
    fresh[::10] = True
    told = []
    for nonsense in (np.nan, 1e4, 0.0):
        mag = np.where(fresh[..., None], samples.mag, nonsense)
        told.append(fuse(Filter1(), replace(samples, mag=mag, fresh=fresh))[0])
    np.testing.assert_array_equal(told[0], told[1])
    np.testing.assert_array_equal(told[0], told[2])


def test_the_first_reading_of_a_compass_that_comes_late_sets_the_heading():
    truth = so3.about_z(np.array([2.5]))
    samples = resting(truth, 300)
    fresh = samples.fresh.copy()
    fresh[:200] = False
    out, _ = fuse(Filter1(), replace(samples, fresh=fresh))
    error = np.rad2deg(so3.angle_between(out, truth))
    np.testing.assert_allclose(error[:200], np.rad2deg(2.5))
    assert error[200:].max() < 1e-3


# --- the filter -------------------------------------------------------------------------------


def textbook(fusion: Filter1, samples: ImuSamples, sensor: int, angles: np.ndarray) -> np.ndarray:
    """An extended Kalman filter in matrices (4.6 to 4.8, 4.23, 4.24), Jacobian by differences."""

    def stepped(x: np.ndarray, turn: np.ndarray) -> np.ndarray:
        return x + euler.rates(x[:, None], turn[:, None])[:, 0]

    dt = 0.01
    q = (fusion.gyr_noise * fusion.gyr_factor) ** 2 * dt * np.eye(3)
    noises = [fusion.inclination_noise, fusion.inclination_noise, fusion.heading_noise]
    r = np.diag(np.square(noises)) / dt
    p, x, out = np.deg2rad(1.0) ** 2 * np.eye(3), angles.copy(), []
    for k in range(len(samples)):
        turn = samples.gyr[k, sensor] * dt
        f = np.stack(
            [(stepped(x + h, turn) - stepped(x - h, turn)) / 2e-6 for h in 1e-6 * np.eye(3)], axis=1
        )
        x, p = stepped(x, turn), f @ p @ f.T + q
        z = euler.observed(samples.acc[k, sensor, :, None], samples.mag[k, sensor, :, None])[:, 0]
        seen = np.eye(3)[: 3 if samples.fresh[k, sensor] else 2]
        gain = p @ seen.T @ np.linalg.inv(seen @ p @ seen.T + seen @ r @ seen.T)
        x = x + gain @ seen @ np.angle(np.exp(1j * (z - x)))
        p = p - gain @ seen @ p
        out.append(x)
    return np.array(out)


def test_it_is_an_extended_kalman_filter():
    """Of sensors that turn about all axes, so near the singularity that angles are coupled."""
    rng = np.random.default_rng(9)
    truth = euler.to_quaternion(np.array([[0.3, -2.0], [1.2, -1.1], [1.0, 3.0]]))
    samples = resting(truth, 150)
    samples = replace(
        samples,
        gyr=rng.normal(size=samples.gyr.shape) * 3.0,
        acc=samples.acc + rng.normal(size=samples.acc.shape),
        fresh=rng.random(samples.fresh.shape) < 0.5,
    )
    loud = Filter1(gyr_factor=2000.0)  # so that a step shows
    out, _ = fuse(loud, samples, truth)
    start = euler.from_quaternion(truth)
    for sensor in range(2):
        expected = textbook(loud, samples, sensor, start[:, sensor])
        assert so3.angle_between(out[:, sensor], euler.to_quaternion(expected.T)).max() < 1e-7


# --- motion -----------------------------------------------------------------------------------


def test_dynamic_acceleration_misleads_it_as_the_thesis_found():
    """Shoved along x at 0.5 g for two seconds, a level sensor that does not turn is said to."""
    level = np.array([[1.0, 0.0, 0.0, 0.0]])
    samples = resting(level, 600)
    acc = samples.acc.copy()
    acc[200:400, 0, 0] = 0.5 * STANDARD_GRAVITY
    shoved = replace(samples, acc=acc)
    out, _ = fuse(Filter1(), shoved, level)
    error = np.rad2deg(so3.angle_between(out, level))[:, 0]
    assert error[:200].max() < 1e-9
    assert 5.0 < error[399] < np.rad2deg(np.arctan(0.5))
    assert (np.diff(error[400:]) < 0.0).all()  # and recovers once it rests
    raw, _ = fuse(RawFilter(), shoved, level)
    assert so3.angle_between(raw, level).max() < 1e-12


def test_of_a_hand_in_motion_fingertips_are_misled_more_than_the_forearm():
    layout = glove("right", ["SN1", "SN14", "SN17"])
    time_us = np.arange(3000) * 10_000
    exact, truth = signals(ideal_subject("right"), layout, showcase("right"), time_us)
    out, _ = fuse(Filter1(), exact, truth.q_world_sensor[0])
    error = so3.angle_between(out, truth.q_world_sensor)
    forearm, middle, index = np.rad2deg(np.sqrt((error**2).mean(axis=0)))
    assert forearm < min(middle, index)


def test_on_perfect_signals_without_acceleration_it_follows_a_turn():
    t = np.arange(2000) / 100.0
    angle = 0.8 * np.sin(1.5 * t)
    q = so3.exp(angle[:, None] * np.array([0.5, 0.4, 0.7]))[:, None]
    rate = np.gradient(angle, t)[:, None] * np.array([0.5, 0.4, 0.7])
    back = so3.conjugate(q)
    samples = replace(
        resting(q[0], 2000),
        gyr=rate[:, None],
        acc=so3.rotate(back, np.array([0.0, 0.0, STANDARD_GRAVITY])),
        mag=so3.rotate(back, FIELD),
    )
    out, _ = fuse(Filter1(), samples)
    assert np.rad2deg(so3.angle_between(out, q).max()) < 1.0


# --- the singularity --------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1.0, 10.0, 60.0])
@pytest.mark.parametrize("share", [0.0, 0.01, 1.0])
def test_it_survives_the_singularity(size, share):
    """Whatever is read at theta = 90 deg, state and covariance stay such as one can go on from."""
    rng = np.random.default_rng(8)
    straight_up = so3.from_axis_angle(AXES[1], np.full(10, np.pi / 2))
    samples = resting(straight_up, 1500)
    noise = rng.normal(size=samples.gyr.shape)
    samples = replace(
        samples,
        gyr=size * noise * np.array([0.01, 1.0, 0.01]),
        acc=samples.acc + 0.3 * rng.normal(size=noise.shape),
        fresh=rng.random(samples.fresh.shape) < share,
    )
    out, after = fuse(Filter1(), samples, straight_up)
    np.testing.assert_allclose(np.linalg.norm(out, axis=-1), 1.0, atol=1e-9)
    inclination = after.covariance[:, :2, :2]
    assert np.linalg.eigvalsh(after.covariance).min() > 0.0
    np.testing.assert_allclose(inclination, np.swapaxes(inclination, 1, 2), atol=1e-9)
    assert inclination.max() < 1.0


def test_lying_still_again_it_recovers_from_the_singularity():
    straight_up = so3.from_axis_angle(AXES[1], np.full(1, np.pi / 2))
    lying = so3.from_axis_angle(AXES[1], np.full(1, 0.2))
    turn = resting(straight_up, 200)
    gyr = np.zeros_like(turn.gyr)
    gyr[..., 1] = (0.2 - np.pi / 2) / 2.0  # two seconds
    _, state = fuse(Filter1(), replace(turn, gyr=gyr), straight_up)
    rest = resting(lying, 4000)
    out, _ = Filter1().run(state, rest, np.ones(4000), rest.valid)
    assert np.rad2deg(so3.angle_between(out[-1], lying[0])) < 0.1
