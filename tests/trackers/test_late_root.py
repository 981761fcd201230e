"""A sensor's place in the room: laws, equivalences, named faults."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from handstudio.errors import CalibrationError
from handstudio.maths import so3
from handstudio.trackers.late_align import align
from handstudio.trackers.late_faults import Fate, told_faults
from handstudio.trackers.late_path import Path
from handstudio.trackers.late_root import Felt, RootFilter, begin, run
from handstudio.trackers.track import Track

DELAY_S = 0.05
LEVER = np.array([0.012, -0.004, 0.008])
UPSIDE_DOWN = so3.multiply(so3.exp(np.array([np.pi, 0.0, 0.0])), so3.about_z(0.4))
ROOM = so3.multiply(so3.about_z(2.2), so3.exp(np.array([0.1, -0.2, 0.0])))  # not even level
ORIGIN = np.array([0.5, 0.2, -0.3])


@dataclass
class Watched:
    felt: Felt
    track: Track
    t_true: np.ndarray


def test_cutting_anywhere_changes_no_digit() -> None:
    it = _watched(3.0)
    filter = _known()
    whole, _ = run(filter, begin(filter), it.felt, it.track)
    state, found, fates = begin(filter), [], []
    for cut, after in ((0, 101), (101, 102), (102, 300)):
        us = it.felt.time_us
        mine = (it.track.time_us > (us[cut - 1] if cut else -1)) & (
            it.track.time_us <= us[after - 1]
        )
        placed, state = run(filter, state, it.felt[cut:after], _part(it.track, mine))
        found.append(placed.t_room_sensor)
        fates.append(placed.fates)
    np.testing.assert_array_equal(np.concatenate(found), whole.t_room_sensor)
    np.testing.assert_array_equal(np.concatenate(fates), whole.fates)


def test_remembered_integrals_equal_integrating_again() -> None:
    it, path = _watched(1.0), Path()
    for k in range(100):
        q = tuple(it.felt.q_world_sensor[k].tolist())
        path.add(k * 0.01, q, it.felt.acc[k])
    fine = np.linspace(0.2, 0.7, 5001)
    force = so3.rotate(it.felt.q_world_sensor, it.felt.acc)
    at = np.stack([np.interp(fine, np.arange(100) * 0.01, force[:, i]) for i in range(3)], -1)
    speed = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (at[1:] + at[:-1]), axis=0)]) * 1e-4
    faster, further = path.between(0.2, 0.7)
    np.testing.assert_allclose(faster[:, 3], speed[-1], atol=1e-6)
    np.testing.assert_allclose(further[:, 3], np.trapezoid(speed, fine, axis=0), atol=1e-6)


def test_an_alignment_finds_delay_mounting_and_room() -> None:
    it = _watched(10.0)
    found = align(it.felt.time_us, it.felt.q_world_sensor, it.track)
    assert found.delay_s == pytest.approx(DELAY_S, abs=0.0005)
    assert np.rad2deg(so3.angle_between(found.q_sensor_terminal, UPSIDE_DOWN)) < 0.5
    assert np.rad2deg(so3.angle_between(found.q_room_world, ROOM)) < 0.5
    assert found.correlation > 0.95


def test_a_tracker_of_another_clock_is_aligned() -> None:
    it = _watched(10.0)
    track = replace(it.track, time_us=it.track.time_us - 3_200_000)
    found = align(it.felt.time_us, it.felt.q_world_sensor, track, search_s=(-5.0, 5.0))
    assert found.delay_s == pytest.approx(DELAY_S - 3.2, abs=0.0005)


def test_a_terminal_that_sits_on_something_else_is_refused() -> None:
    it, other = _watched(10.0), _watched(10.0, seed=8)
    with pytest.raises(CalibrationError, match="does not turn as the sensor does"):
        align(it.felt.time_us, it.felt.q_world_sensor, other.track)


def test_turning_about_one_axis_is_not_enough() -> None:
    it = _watched(10.0, axes=1)
    with pytest.raises(CalibrationError, match="one axis only"):
        align(it.felt.time_us, it.felt.q_world_sensor, it.track)


def test_place_and_heading_are_found_to_a_millimetre_and_half_a_degree() -> None:
    it = _watched(5.0)
    placed, state = run(_known(), begin(_known()), it.felt, it.track)
    assert _rms_mm(placed, it, 200) < 1.5
    assert np.rad2deg(so3.angle_between(placed.q_room_world[-1], ROOM)) < 0.5
    assert state.delay_s == pytest.approx(DELAY_S, abs=0.001)
    held = it.track.t_room_terminal[np.searchsorted(it.track.time_us, it.felt.time_us) - 1]
    assert np.sqrt(np.mean((held - it.t_true)[200:] ** 2)) > 0.02  # what a late pose is off by


def test_an_unknown_lever_is_found_within_a_few_millimetres() -> None:
    it = _watched(6.0)
    filter = replace(_known(), t_sensor_terminal=(0.0, 0.0, 0.0), lever_sd=0.03)
    _, state = run(filter, begin(filter), it.felt, it.track)
    assert np.linalg.norm(state.lever - LEVER) < 0.004


def test_frozen_lost_jumping_and_mirrored_poses_are_told_and_survived() -> None:
    it = _watched(5.0)
    t = it.track.t_room_terminal
    t[80:95] = t[79]
    it.track.q_room_terminal[80:95] = it.track.q_room_terminal[79]
    t[130:145] = np.nan
    t[180:195] += 0.3
    t[230:245] *= -1.0
    placed, _ = run(_known(), begin(_known()), it.felt, it.track)
    assert [fault[0] for fault in told_faults(placed.fates, it.track.time_us)] == [
        Fate.FROZEN,
        Fate.LOST,
        Fate.JUMPED,
        Fate.MIRRORED,
    ]
    assert _rms_mm(placed, it, 100) < 15.0  # a quarter of a second without a tracker, three times
    after = np.linalg.norm(placed.t_room_sensor - it.t_true, axis=-1)[430:] * 1e3
    assert np.sqrt(np.mean(after**2)) < 2.0


def test_attitudes_of_another_terminal_are_told_and_not_taken() -> None:
    it = _watched(3.0)
    q = it.track.q_room_terminal
    q[120:160] = so3.multiply(q[120:160], so3.exp(np.array([0.0, 0.0, 1.5])))
    placed, _ = run(_known(), begin(_known()), it.felt, it.track)
    assert (placed.fates[120:160] == Fate.TURNED).all()
    assert _rms_mm(placed, it, 100) < 1.5


def test_it_waits_while_the_attitude_is_not_known() -> None:
    it = _watched(3.0)
    it.felt.known[100:150] = False
    placed, _ = run(_known(), begin(_known()), it.felt, it.track)
    assert np.isnan(placed.t_room_sensor[100:150]).all()
    assert np.linalg.norm(placed.t_room_sensor - it.t_true, axis=-1)[250:].max() < 0.01


def _known() -> RootFilter:
    return RootFilter(
        q_sensor_terminal=tuple(UPSIDE_DOWN.tolist()),
        q_room_world=tuple(so3.multiply(so3.about_z(0.03), ROOM).tolist()),
        delay_s=0.045,
        t_sensor_terminal=tuple(LEVER.tolist()),
        lever_sd=0.0,
    )


def _rms_mm(placed, it: Watched, begin_at: int) -> float:
    off = np.linalg.norm(placed.t_room_sensor - it.t_true, axis=-1)[begin_at:]
    return float(1e3 * np.sqrt(np.mean(off**2)))


def _part(track: Track, which) -> Track:
    return Track("t", *(getattr(track, name)[which] for name in Track.__slots__[1:]))


def _watched(seconds: float, seed: int = 4, axes: int = 3) -> Watched:
    """A sensor that swings about at up to 2 m/s, sampled at 100 Hz; a tracker 50 ms late."""
    rng = np.random.default_rng(seed)
    knots = np.arange(-1.0, seconds + 1.5, 0.35)
    place = make_interp_spline(knots, rng.normal(0.0, 0.12, (len(knots), 3)), k=5)
    sizes = np.array([0.8, 0.6, 0.5]) * (np.arange(3) < axes)
    turn = make_interp_spline(knots, rng.normal(0.0, 1.0, (len(knots), 3)) * sizes, k=5)
    time_us = np.arange(round(100 * seconds)) * 10_000
    s = time_us * 1e-6
    q = so3.exp(turn(s))
    lift = place.derivative(2)(s) + np.array([0.0, 0.0, 9.80665])
    acc = so3.rotate(so3.conjugate(q), lift) + np.array([0.1, -0.05, 0.08])
    acc = acc + rng.normal(0.0, 0.03, acc.shape)
    told = np.arange(round(60 * seconds)) * 16_667
    then = told * 1e-6 - DELAY_S
    q_then = so3.exp(turn(then))
    t = ORIGIN + so3.rotate(ROOM, place(then) + so3.rotate(q_then, LEVER))
    q_told = so3.multiply(
        so3.multiply(so3.multiply(ROOM, q_then), UPSIDE_DOWN),
        so3.exp(rng.normal(0.0, 0.0026, (len(told), 3))),
    )
    track = Track("t", told, t + rng.normal(0.0, 0.001, t.shape), q_told, np.ones(len(told)))
    felt = Felt(time_us, q, acc, np.ones(len(s), dtype=bool))
    return Watched(felt, track, ORIGIN + so3.rotate(ROOM, place(s)))
