"""Rests of a board: found by its own noise, whatever one sensor does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.calibration.still import poses_of, still_intervals, turns_of, working
from handstudio.samples import ImuSamples

RATE_HZ = 100
RESTS_S = ((0.0, 3.0), (5.0, 8.0), (10.0, 12.0))
SENSORS = 4


def board(seed: int = 0, noise: float = 1.0) -> ImuSamples:
    """A board that moves between three rests."""
    rng = np.random.default_rng(seed)
    n = 12 * RATE_HZ
    time_s = np.arange(n) / RATE_HZ
    moves = np.ones(n, dtype=bool)
    for begin, end in RESTS_S:
        moves &= (time_s < begin) | (time_s >= end)
    wave = moves * np.sin(np.pi * (time_s - 3.0) / 2.0)
    gyr = wave[:, None, None] * [1.0, 2.0, 0.5] + rng.normal(0.02, 0.002 * noise, (n, SENSORS, 3))
    acc = wave[:, None, None] * [3.0, 0.0, 1.0] + [0.0, 0.0, 9.8]
    acc = acc + rng.normal(0.0, 0.03 * noise, (n, SENSORS, 3))
    flags = np.ones((n, SENSORS), dtype=bool)
    mag = np.full((n, SENSORS, 3), np.nan)
    return ImuSamples(np.arange(n) * 10_000, gyr, acc, mag, ~flags, flags, ~flags)


def assert_found(samples: ImuSamples) -> None:
    found = still_intervals(samples)
    assert len(found) == len(RESTS_S)
    for still, (begin, end) in zip(found, RESTS_S, strict=True):
        assert begin * RATE_HZ <= still.start <= begin * RATE_HZ + 30
        assert end * RATE_HZ - 30 <= still.stop <= end * RATE_HZ


@pytest.mark.parametrize("noise", [0.0, 0.3, 1.0, 3.0])
def test_rests_are_found_whatever_the_noise(noise: float) -> None:
    assert_found(board(noise=noise))


def test_one_sensor_that_never_rests_changes_nothing() -> None:
    samples = board()
    samples.gyr[:, 1] += np.random.default_rng(1).normal(0.0, 1.0, (len(samples), 3)).cumsum(axis=0)
    assert_found(samples)


def test_one_silent_sensor_changes_nothing() -> None:
    samples = board()
    for signal in (samples.gyr, samples.acc):
        signal[:, 2] = 0.0
    samples.valid[:, 2] = False
    assert working(samples).tolist() == [True, True, False, True]
    assert_found(samples)


def test_a_steady_turn_is_no_rest() -> None:
    samples = board()
    samples.gyr[550:750] += 0.5
    found = still_intervals(samples)  # what is left of that rest is too short
    assert [still.start // RATE_HZ for still in found] == [0, 10]


def test_nothing_is_found_where_nothing_is() -> None:
    assert still_intervals(board()[:0]) == ()
    assert still_intervals(board()[:5]) == ()
    silent = replace(board(), valid=np.zeros((1200, SENSORS), dtype=bool))
    assert still_intervals(silent) == ()


def test_a_sensor_that_creeps_in_a_rest_is_not_used_there() -> None:
    samples = board()
    samples.acc[500:800, 3, 0] += np.linspace(0.0, 0.2, 300)
    poses = poses_of(samples, still_intervals(samples))
    assert poses.usable.all(axis=1).tolist() == [True, True, True, False]
    assert poses.usable[3].tolist() == [True, False, True]


def test_a_turn_with_missing_samples_is_not_used() -> None:
    samples = board()
    samples.valid[400, 0] = False
    stills = still_intervals(samples)
    assert turns_of(samples, stills).usable.tolist()[0] == [False, True]
    assert turns_of(samples, stills).usable[1:].all()
    gap = replace(samples, time_us=samples.time_us + 80_000 * (np.arange(len(samples)) >= 400))
    assert not turns_of(gap, stills).usable[:, 0].any()
