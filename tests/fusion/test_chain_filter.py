"""Filters 2, 3 and 4: what a chain knows that its sensors by themselves do not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from handstudio.fusion import euler
from handstudio.fusion.chain_filter import Filter2, Filter3, Filter4
from handstudio.fusion.chain_links import links_of
from handstudio.fusion.chain_state import averaged
from handstudio.fusion.filter1 import Filter1
from handstudio.hand_fit import fit_of, hand_mechanism
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.recording.material import material
from handstudio.samples import STANDARD_GRAVITY
from handstudio.setup import Setup
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.mounting import nominal_mounting
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject

FINGER = ("SN1", "SN11", "SN15", "SN16", "SN17")
FORK = ("SN1", "SN11", "SN15", "SN16", "SN12")  # two chains share forearm and hand

chained = pytest.mark.parametrize("fusion", [Filter2(), Filter3(), Filter4()], ids=lambda f: f.NAME)


@cache
def worn(names, motion="scissors&elbow_moving:all 15", seconds=8.0, rate_hz=100):
    """Exact readings, the truth, and the mechanism as it is; rates that a gyroscope integrates."""
    someone, layout = ideal_subject("right"), glove("right", names)
    performed = perform(motion, Actor(someone, 5, material()))
    time_us = 4_000_000 + np.arange(round(seconds * rate_hz)) * (1_000_000 // rate_hz)
    samples, truth = signals(someone, layout, performed, time_us)
    setup = Setup(layout, float(rate_hz))
    fit = fit_of(setup)
    places = nominal_mounting(layout, fit.skeleton).t_segment_sensor
    return samples, truth, hand_mechanism(layout, fit, places, np.zeros(len(names)))


def placed(fusion, q_world_sensor, bias=None, rate_hz=100.0):
    state = fusion.begin(len(q_world_sensor), rate_hz)
    for sensor, q in enumerate(q_world_sensor):
        state = fusion.place(state, sensor, q, np.zeros(3) if bias is None else bias)
    return state


def fused(fusion, state, samples, mechanism, heeded=None):
    heeded = samples.valid if heeded is None else heeded
    return fusion.run(state, samples, np.ones(len(samples)), heeded, mechanism)


def rms_deg(out, truth):
    return np.rad2deg(np.sqrt(np.mean(so3.angle_between(out, truth) ** 2, axis=0)))


# --- what it is for -----------------------------------------------------------------------------


@chained
def test_the_finger_of_a_hand_that_throws_is_followed_better_than_by_filter_1(fusion):
    """Which takes all that accelerates it for gravity."""
    samples, truth, mechanism = worn(FINGER, "ball_throw")
    bias = np.deg2rad(0.1) * np.random.default_rng(2).standard_normal((5, 3))
    off, errors = replace(samples, gyr=samples.gyr + bias), {}
    for each in (fusion, Filter1()):
        out, _ = fused(each, placed(each, truth.q_world_sensor[0]), off, mechanism)
        errors[type(each)] = rms_deg(out, truth.q_world_sensor)
    assert errors[type(fusion)].mean() < 0.5 * errors[Filter1].mean()


def test_at_rest_an_error_goes_where_gravity_and_compass_say():
    fusion = Filter4()
    samples, truth, mechanism = worn(FINGER)
    still = replace(
        samples,
        gyr=np.zeros_like(samples.gyr),
        acc=still_acc(truth.q_world_sensor[0], len(samples)),
        mag=np.broadcast_to(samples.mag[0], samples.mag.shape).copy(),
    )
    one = so3.multiply(so3.exp(np.array([0.1, -0.05, 0.0])), truth.q_world_sensor[0, 3])
    wrong = truth.q_world_sensor[0].copy()
    wrong[3] = one
    out, _ = fused(fusion, placed(fusion, wrong), still, mechanism)
    left = np.rad2deg(so3.angle_between(out, truth.q_world_sensor[0]))
    assert left[0, 3] > 5.0
    assert left[-1, 3] < 0.3 * left[0, 3]


def still_acc(q_world_sensor, n):
    up = so3.rotate(so3.conjugate(q_world_sensor), np.array([0.0, 0.0, STANDARD_GRAVITY]))
    return np.broadcast_to(up, (n, *up.shape)).copy()


def test_the_elbows_acceleration_is_estimated_4_37():
    """Sample by sample, while all attitudes are right."""
    fusion = Filter4()
    samples, truth, mechanism = worn(FINGER)
    along = truth.t_world_joint[:, 0]
    true = np.gradient(np.gradient(along, 0.01, axis=0), 0.01, axis=0)
    state, found = placed(fusion, truth.q_world_sensor[0]), []
    for k in range(300):
        _, state = fused(fusion, state, samples[k : k + 1], mechanism)
        found.append(state.elbow[0])
    off = np.sqrt(np.mean((np.array(found) - true[:300])[5:] ** 2, axis=0)) / STANDARD_GRAVITY
    assert np.sqrt(np.mean(true[5:300] ** 2)) / STANDARD_GRAVITY > 0.01
    assert off.max() < 0.03


# --- the same digits with a mechanism as without -------------------------------------------------


def with_gaps(samples):
    heeded = np.ones(samples.valid.shape, dtype=bool)
    heeded[10:20, 1] = heeded[40:, 3] = heeded[:5, 2] = False
    return heeded


@chained
def test_cutting_the_samples_of_chains_changes_no_digit(fusion):
    samples, _, mechanism = worn(FORK)
    samples, heeded = samples[:80], with_gaps(samples[:80])
    begun = fusion.begin(5, 100.0)
    whole, after = fused(fusion, begun, samples, mechanism, heeded)
    state, parts = begun, []
    for part in (slice(0, 0), slice(0, 1), slice(1, 15), slice(15, 41), slice(41, 80)):
        state = fusion.unpack(fusion.pack(state))
        out, state = fused(fusion, state, samples[part], mechanism, heeded[part])
        parts.append(out)
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert fusion.pack(state) == fusion.pack(after)


@chained
def test_a_silent_sensor_of_a_chain_is_held_and_what_it_says_does_not_matter(fusion):
    samples, truth, mechanism = worn(FORK)
    samples, heeded = samples[:80], with_gaps(samples[:80])
    state = placed(fusion, truth.q_world_sensor[0])
    out, _ = fused(fusion, state, samples, mechanism, heeded)
    np.testing.assert_allclose(out[10:20, 1], np.tile(out[9, 1], (10, 1)), atol=1e-12)
    np.testing.assert_allclose(out[40:, 3], np.tile(out[39, 3], (40, 1)), atol=1e-12)
    nan = {n: getattr(samples, n).copy() for n in ("gyr", "acc", "mag")}
    for signal in nan.values():
        signal[~heeded] = np.nan
    again, _ = fused(fusion, state, replace(samples, **nan), mechanism, heeded)
    np.testing.assert_array_equal(again, out)


def test_beyond_a_sensor_that_died_a_finger_is_still_told_by_gravity():
    fusion = Filter4()
    samples, truth, mechanism = worn(FINGER)
    heeded = samples.valid.copy()
    heeded[:, 2] = False
    bias = np.deg2rad(0.5) * np.random.default_rng(2).standard_normal((5, 3))
    off = replace(samples, gyr=samples.gyr + bias)
    out, _ = fused(fusion, placed(fusion, truth.q_world_sensor[0]), off, mechanism, heeded)
    assert rms_deg(out, truth.q_world_sensor)[3:].max() < 2.5


# --- headings -----------------------------------------------------------------------------------


def test_headings_that_compasses_scatter_by_are_handed_out_as_compasses_have_them():
    """Turned by the correction afterwards (4.22), it is all as with compasses that agree."""
    fusion = Filter4()
    samples, truth, mechanism = worn(FINGER)
    samples = samples[:200]
    by = np.array([0.0, 0.2, -0.15, 0.1, -0.05])
    q_start = truth.q_world_sensor[0]
    agreed, _ = fused(fusion, placed(fusion, q_start), samples, mechanism)
    # a compass that is off sees the field turned in the world
    field = so3.rotate(truth.q_world_sensor[:200], samples.mag)
    turned = so3.rotate(
        so3.conjugate(truth.q_world_sensor[:200]), so3.rotate(so3.about_z(by), field)
    )
    off = so3.multiply(so3.about_z(-by), q_start)
    scattered = replace(mechanism, heading_rad=by)
    out, _ = fused(fusion, placed(fusion, off), replace(samples, mag=turned), scattered)
    back = so3.multiply(so3.about_z(by), out)
    assert np.rad2deg(so3.angle_between(back, agreed).max()) < 0.01


def test_the_level_field_is_the_mean_of_half_a_second_after_placing_and_then_left():
    samples, truth, mechanism = worn(FINGER)
    fusion = Filter4()
    stronger = samples.mag * np.where(np.arange(len(samples)) < 50, 1.0, 2.0)[:, None, None]
    state = placed(fusion, truth.q_world_sensor[0])
    _, after = fused(fusion, state, replace(samples, mag=stronger)[:120], mechanism)
    field = so3.rotate(truth.q_world_sensor[:50], samples.mag[:50])
    expected = np.hypot(field[..., 0], field[..., 1]).mean(axis=0)
    np.testing.assert_allclose(after.level_ut[0], expected, rtol=0.01)
    assert not fusion.place(after, 2, truth.q_world_sensor[0, 2], np.zeros(3)).levels[0, 2]


def test_without_fresh_readings_a_common_heading_is_not_observed():
    """Gravity tells only how the sensors' headings differ."""
    samples, truth, mechanism = worn(FINGER)
    silent = replace(samples, fresh=np.zeros_like(samples.fresh))[:200]
    turned = so3.multiply(so3.about_z(np.array(0.5)), truth.q_world_sensor[0])
    out, _ = fused(Filter4(), placed(Filter4(), turned), silent, mechanism)
    off = so3.multiply(so3.about_z(np.array(0.5)), truth.q_world_sensor[:200])
    assert np.rad2deg(so3.angle_between(out, off).max()) < 1.0


# --- chains that share sensors ------------------------------------------------------------------


def test_a_shared_sensor_is_the_circular_mean_of_its_chains():
    angles = np.zeros((1, 2, 2, 3))
    angles[0, :, 0, 2] = np.deg2rad([179.0, -177.0])
    angles[0, :, 0, 0] = np.deg2rad([10.0, 20.0])
    angles[0, 1, 0, 0] += 4.0 * np.pi  # it went round twice
    angles[0, :, 1, 1] = [0.3, 0.5]
    means = averaged(angles, ((0, 1), (0, 2)))[0]
    np.testing.assert_allclose(np.rad2deg(means[0]), [15.0, 0.0, 181.0])
    np.testing.assert_allclose(means[1:, 1], [0.3, 0.5])


def test_chains_do_not_hear_of_each_other():
    """Averaged, not fed back: a finger is the same with and without the other one."""
    samples, truth, mechanism = worn(FORK)
    samples = samples[:50]
    fusion, start = Filter4(), truth.q_world_sensor[0]
    both, _ = fused(fusion, placed(fusion, start), samples, mechanism)
    moved = samples.acc.copy()
    moved[:, 4] += 1.0
    other, _ = fused(fusion, placed(fusion, start), replace(samples, acc=moved), mechanism)
    np.testing.assert_array_equal(both[:, 2:4], other[:, 2:4])
    assert np.any(both[:, 1] != other[:, 1])


def test_other_chains_take_over_what_is_known_of_each_sensor():
    samples, truth, mechanism = worn(FORK)
    fusion = Filter4()
    _, apart = fused(fusion, placed(fusion, truth.q_world_sensor[0]), samples[:50], None)
    silent = np.zeros_like(samples.valid[:1])
    out, joined = fused(fusion, apart, samples[50:51], mechanism, silent)
    assert joined.chains == links_of(mechanism).chains
    expected = euler.to_quaternion(np.moveaxis(apart.angles[:, 0], -1, 0))
    np.testing.assert_allclose(out[0], expected, atol=1e-12)
    _, again = fused(fusion, joined, samples[50:51], None, silent)
    np.testing.assert_allclose(again.covariance[:, :3, :3], apart.covariance[:, :3, :3], atol=1e-12)


# --- priority -----------------------------------------------------------------------------------


def test_filter_4_changes_priority_at_400_degrees_a_second_sensor_by_sensor():
    speed = np.deg2rad([[[399.0, 401.0, 10.0]]])
    from_root, of_neighbours = Filter4()._doubts(speed)
    np.testing.assert_allclose(from_root, [[[1.0, 100.0, 1.0]]])
    np.testing.assert_allclose(of_neighbours, [[[100.0, 1.0, 100.0]]])
    np.testing.assert_array_equal(Filter3()._doubts(speed), np.ones((2, 1, 1, 3)))


def test_filter_4_without_priority_is_filter_3():
    samples, truth, mechanism = worn(FINGER)
    samples = samples[:60]
    results = [
        fused(f, placed(f, truth.q_world_sensor[0]), samples, mechanism)[0]
        for f in (Filter4(priority=1.0), Filter3())
    ]
    np.testing.assert_array_equal(*results)


# --- the singularity ----------------------------------------------------------------------------


@chained
def test_finite_numbers_come_out_at_the_singularity_whatever_the_sensors_say(fusion):
    """x along the bone, straight up, shaken: phi and psi are anything, and stay numbers."""
    samples, _, mechanism = worn(FINGER)
    rng = np.random.default_rng(6)
    up = so3.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.full(5, np.pi / 2))
    noise = rng.standard_normal(samples.gyr.shape)
    shaken = replace(samples, gyr=8.0 * noise, acc=still_acc(up, len(samples)) + 20.0 * noise)
    out, after = fused(fusion, placed(fusion, up), shaken, mechanism)
    np.testing.assert_allclose(np.linalg.norm(out, axis=-1), 1.0, atol=1e-9)
    assert np.linalg.eigvalsh(after.covariance).min() > -1e-9
    assert np.einsum("cii->ci", after.covariance).max() < 12.0
