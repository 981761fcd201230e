"""Attitude from gyroscopes and a late tracker: laws, equivalences, named faults."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.maths import so3
from handstudio.trackers.late_attitude import LateFilter, begin, run
from handstudio.trackers.late_faults import Fate, told_faults
from handstudio.trackers.late_turns import Turns
from handstudio.trackers.track import Track

DELAY_S = 0.1
BIAS = np.array([0.05, -0.03, 0.08])
FILTER = LateFilter(delay_s=0.06)


def test_cutting_anywhere_changes_no_digit() -> None:
    time_us, gyr, track, _ = _watched(3.0)
    whole, _ = run(FILTER, begin(FILTER), time_us, gyr, track)
    for cuts in ([57, 58, 200], [1, 120, 299]):
        state, q, fates = begin(FILTER), [], []
        for part, between in zip(
            np.split(np.arange(len(time_us)), cuts),
            np.split(np.arange(len(track.time_us)), np.searchsorted(track.time_us, time_us[cuts])),
            strict=True,
        ):
            told = Track("t", *(getattr(track, n)[between] for n in Track.__slots__[1:]))
            found, state = run(FILTER, state, time_us[part], gyr[part], told)
            q.append(found.q_room_sensor)
            fates.append(found.fates)
        np.testing.assert_array_equal(np.concatenate(q), whole.q_room_sensor)
        np.testing.assert_array_equal(np.concatenate(fates), whole.fates)


def test_a_state_that_was_handed_on_is_not_changed() -> None:
    time_us, gyr, track, _ = _watched(2.0)
    _, state = run(FILTER, begin(FILTER), time_us[:100], gyr[:100], _part(track, slice(0, 50)))
    first, _ = run(FILTER, state, time_us[100:], gyr[100:], _part(track, slice(50, None)))
    again, _ = run(FILTER, state, time_us[100:], gyr[100:], _part(track, slice(50, None)))
    np.testing.assert_array_equal(first.q_room_sensor, again.q_room_sensor)


def test_remembered_turns_equal_adding_the_rates_up_again() -> None:
    rng = np.random.default_rng(5)
    gyr, turns = rng.normal(0.0, 2.0, (31, 3)), Turns()
    for k in range(31):
        turns.add(0.01 * k, tuple(gyr[k].tolist()))
    q = so3.IDENTITY
    for k in range(10, 30):
        q = so3.multiply(q, so3.exp(0.01 * (0.5 * (gyr[k] + gyr[k + 1]) - BIAS)))
    turn, _ = turns.between(0.1, 0.3, BIAS)
    assert so3.angle_between(np.array(turn), q) < 3e-4


def test_delay_bias_and_attitude_are_found() -> None:
    time_us, gyr, track, q_true = _watched(7.0)
    found, state = run(FILTER, begin(FILTER), time_us, gyr, track)
    assert found.delay_s[-1] == pytest.approx(DELAY_S, abs=0.003)
    np.testing.assert_allclose(state.bias, BIAS, atol=0.03)
    assert _rms(found.q_room_sensor, q_true, slice(200, None)) < 0.02
    told = np.median(found.sd_rad[200:]) * np.sqrt(3.0)
    assert 0.7 < _rms(found.q_room_sensor, q_true, slice(200, None)) / told < 1.4


def test_a_frozen_tracker_is_told_and_does_no_harm() -> None:
    time_us, gyr, track, q_true = _watched(6.0)
    track.q_room_terminal[200:225] = track.q_room_terminal[199]
    found, _ = run(FILTER, begin(FILTER), time_us, gyr, track)
    (fault,) = told_faults(found.fates, track.time_us)
    assert fault == (Fate.FROZEN, pytest.approx(4.0), pytest.approx(4.48), 25)
    assert _rms(found.q_room_sensor, q_true, slice(400, 460)) < 0.03


def test_a_jump_and_a_drop_out_are_told_and_do_no_harm() -> None:
    time_us, gyr, track, q_true = _watched(6.0)
    q = track.q_room_terminal
    q[150:175] = so3.multiply(so3.exp(np.array([0.0, np.pi, 0.0])), q[150:175])
    q[220:245] = np.nan
    found, _ = run(FILTER, begin(FILTER), time_us, gyr, track)
    assert [fault[0] for fault in told_faults(found.fates, track.time_us)] == [
        Fate.JUMPED,
        Fate.LOST,
    ]
    assert _rms(found.q_room_sensor, q_true, slice(300, None)) < 0.03


def test_a_tracker_that_was_put_elsewhere_is_believed_again_after_a_second() -> None:
    time_us, gyr, track, q_true = _watched(6.0)
    moved = so3.exp(np.array([0.0, 0.0, 1.0]))
    q = track.q_room_terminal
    q[200:] = so3.multiply(moved, q[200:])
    found, _ = run(FILTER, begin(FILTER), time_us, gyr, track)
    assert (found.fates == Fate.AFRESH).sum() == 1
    assert _rms(found.q_room_sensor, so3.multiply(moved, q_true), slice(550, None)) < 0.03


def test_a_tracker_upside_down_from_the_start_is_followedas_it_is() -> None:
    time_us, gyr, track, q_true = _watched(4.0)
    over = so3.exp(np.array([np.pi, 0.0, 0.0]))
    track = replace(track, q_room_terminal=so3.multiply(over, track.q_room_terminal))
    found, _ = run(FILTER, begin(FILTER), time_us, gyr, track)
    assert _rms(found.q_room_sensor, so3.multiply(over, q_true), slice(200, None)) < 0.02


def _rms(q, q_true, part) -> float:
    return float(np.sqrt(np.mean(so3.angle_between(q[part], q_true[part]) ** 2)))


def _part(track: Track, part: slice) -> Track:
    return Track("t", *(getattr(track, name)[part] for name in Track.__slots__[1:]))


def _watched(seconds: float):
    """Something that turns about, gyroscopes at 100 Hz and a tracker at 50 Hz, 0.1 s late."""
    rng = np.random.default_rng(11)
    time_us = np.arange(round(100 * seconds)) * 10_000

    def attitude(s):
        wave = [0.2 * np.sin(8.0 * s), 0.15 * np.sin(9.5 * s + 1.0), 0.12 * np.sin(7.0 * s + 2.0)]
        return so3.exp(np.stack(wave, axis=-1))

    s = time_us * 1e-6
    omega = so3.log(so3.multiply(so3.conjugate(attitude(s - 1e-4)), attitude(s + 1e-4))) / 2e-4
    gyr = omega + BIAS + rng.normal(0.0, 0.15, omega.shape)
    told = time_us[::2]
    q = attitude(told * 1e-6 - DELAY_S)
    q = so3.multiply(q, so3.exp(rng.normal(0.0, 0.013, (len(told), 3))))
    n = len(told)
    return time_us, gyr, Track("t", told, np.zeros((n, 3)), q, np.ones(n)), attitude(s)
