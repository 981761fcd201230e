"""Accelerometers and gyroscopes of a board that was tumbled: what was put in is found."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.sensor_errors import MOTION, tumbled
from handstudio.calibration.inertial import Inertial, inertial
from handstudio.calibration.sensors import calibrate_sensors
from handstudio.calibration.still import poses_of, still_intervals, turns_of
from handstudio.errors import CalibrationError
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY, ImuSamples

RATE_HZ = 100
NAMES = ("SN4", "SN11", "SN15", "SN20")
UP = np.array([0.0, 0.0, STANDARD_GRAVITY])
SIDES = np.concatenate([np.eye(3), -np.eye(3)])


def spiral(count: int) -> np.ndarray:
    """Directions all around."""
    k = np.arange(count) + 0.5
    z, around = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    flat = np.sqrt(1.0 - z**2)
    return np.stack([flat * np.cos(around), flat * np.sin(around), z], axis=-1)


def turned_board(directions: np.ndarray, seed: int = 1) -> ImuSamples:
    """Perfect sensors on a stiff board that is laid down with each of these pointing up."""
    rng = np.random.default_rng(seed)
    s_of_turn = np.linspace(0.0, 1.0, 2 * RATE_HZ)
    shape = s_of_turn**3 * (10.0 - 15.0 * s_of_turn + 6.0 * s_of_turn**2)
    q = [np.tile(so3.IDENTITY, (2 * RATE_HZ, 1))]
    for up in directions:
        axis = np.cross(up, UP / STANDARD_GRAVITY)
        angle = np.arctan2(np.linalg.norm(axis), up[2])
        axis = axis / max(np.linalg.norm(axis), 1e-9) if angle < 3.1 else np.array([1.0, 0.0, 0.0])
        to = so3.multiply(so3.about_z(rng.uniform(-3.0, 3.0)), so3.from_axis_angle(axis, angle))
        way = so3.log(so3.multiply(so3.conjugate(q[-1][-1]), to))
        q += [so3.multiply(q[-1][-1], so3.exp(shape[:, None] * way))]
        q += [np.tile(q[-1][-1], (int(1.7 * RATE_HZ), 1))]
    q_world_board = np.concatenate(q)
    q_board_sensor = so3.normalize(rng.standard_normal((len(NAMES), 4)))
    q_world_sensor = so3.multiply(q_world_board[:, None], q_board_sensor)
    ahead = np.concatenate([q_world_sensor[1:], q_world_sensor[-1:]])
    behind = np.concatenate([q_world_sensor[:1], q_world_sensor[:-1]])
    gyr = 0.5 * RATE_HZ * so3.log(so3.multiply(so3.conjugate(behind), ahead))
    n = len(gyr)
    flags = np.ones((n, len(NAMES)), dtype=bool)
    mag = so3.rotate(so3.conjugate(q_world_sensor), np.array([31.0, 0.0, -35.0]))
    acc = so3.rotate(so3.conjugate(q_world_sensor), UP)
    return ImuSamples(np.arange(n) * 10_000, gyr, acc, mag, flags, flags.copy(), ~flags)


def with_errors(felt: ImuSamples, seed: int = 3) -> tuple[ImuSamples, dict[str, np.ndarray]]:
    normal = np.random.default_rng(seed).standard_normal((4, len(NAMES), 3, 3))
    known = {"acc": np.eye(3) + 0.01 * normal[0], "gyr": np.eye(3) + 0.01 * normal[1]}
    known |= {"acc_bias": 0.1 * normal[2, :, 0], "gyr_bias": 0.02 * normal[2, :, 1]}
    known |= {"per_acc": 1.7e-4 * normal[3]}
    acc = np.einsum("sij,nsj->nsi", known["acc"], felt.acc) + known["acc_bias"]
    gyr = np.einsum("sij,nsj->nsi", known["gyr"], felt.gyr) + known["gyr_bias"]
    gyr += np.einsum("sij,nsj->nsi", known["per_acc"], felt.acc)
    return replace(felt, acc=acc, gyr=gyr), known


def found_in(samples: ImuSamples, together: bool = True) -> Inertial:
    stills = still_intervals(samples)
    poses, turns = poses_of(samples, stills), turns_of(samples, stills)
    return inertial(poses, turns, together=together)


def left(found: Inertial, acc: np.ndarray, gyr: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What is left of both matrices in the frame of the corrected accelerometer."""
    u, _, v = np.linalg.svd(found.acc_matrix @ acc)
    to_frame = (u @ v).swapaxes(1, 2)
    return (
        to_frame @ found.acc_matrix @ acc - np.eye(3),
        to_frame @ found.gyr_matrix @ gyr - np.eye(3),
    )


@cache
def read() -> tuple[ImuSamples, dict[str, np.ndarray]]:
    return with_errors(turned_board(spiral(18)))


@pytest.mark.parametrize("together", [False, True])
def test_what_was_put_into_perfect_sensors_is_found(together: bool) -> None:
    samples, known = read()
    found = found_in(samples, together)
    acc, gyr = left(found, known["acc"], known["gyr"])
    # what scales are expected to be pulls on them by this much
    assert np.abs(acc).max() < 1e-4
    assert np.abs(gyr).max() < 2e-4
    assert np.abs(found.acc_bias - known["acc_bias"]).max() < 1e-3
    assert np.abs(found.gyr_bias - known["gyr_bias"]).max() < np.deg2rad(0.003)


def test_typical_sensors_are_found_within_a_fifth_of_a_percent_and_better_together() -> None:
    worn, samples = tumbled(1, 1, "typical", MOTION)
    at = [3, 5, 8, 10, 14, 19]
    part = ImuSamples(
        samples.time_us, *(getattr(samples, n)[:, at] for n in ImuSamples.__slots__[1:])
    )
    of_acc, of_gyr = worn.drawn.inertial[at, :3, :3], worn.drawn.inertial[at, 3:, 3:]
    rms = {}
    for together in (False, True):
        found = found_in(part, together)
        acc, gyr = left(found, of_acc, of_gyr)
        assert np.abs(np.diagonal(gyr, axis1=1, axis2=2)).max() < 0.002
        assert np.abs(np.diagonal(acc, axis1=1, axis2=2)).max() < 0.001
        rms[together] = np.sqrt(np.mean(gyr**2))
    assert rms[True] < rms[False]


def test_a_loose_sensor_does_not_pull_the_others() -> None:
    samples, known = read()
    loose = replace(samples, gyr=samples.gyr.copy(), acc=samples.acc.copy())
    other, errors = with_errors(turned_board(spiral(18)[::-1], seed=8))
    n = min(len(samples), len(other))
    loose.gyr[:n, 3], loose.acc[:n, 3] = other.gyr[:n, 3], other.acc[:n, 3]
    found = found_in(loose)
    _, gyr = left(found, known["acc"], known["gyr"])
    assert np.abs(gyr[:3]).max() < 5e-4
    assert found.rigid[3].mean() < 0.2 < found.rigid[:3].mean()
    _, own = left(found, errors["acc"], errors["gyr"])
    assert np.abs(own[3]).max() < 2e-3


def test_deviations_say_how_sure_it_is() -> None:
    samples, _ = read()
    few = found_in(samples[: 14 * 370])
    many = found_in(samples)
    assert (many.gyr_scale_sd > 0.0).all()
    assert many.gyr_scale_sd.mean() < few.gyr_scale_sd.mean() < 0.005
    assert many.acc_scale_sd.mean() < few.acc_scale_sd.mean() < 0.005


def test_one_dead_sensor_is_left_out_and_named() -> None:
    samples, known = read()
    dead = replace(
        samples, gyr=samples.gyr.copy(), acc=samples.acc.copy(), valid=samples.valid.copy()
    )
    dead.gyr[:, 1], dead.acc[:, 1], dead.valid[:, 1] = 0.0, 0.0, False
    calibration, verdict = calibrate_sensors(dead, NAMES)
    assert [s.name for s in calibration.sensors] == ["SN4", "SN15", "SN20"]
    assert not verdict.ok
    assert {r.about for r in verdict.failing if r.what == "directions"} == {"SN11"}
    gyr = np.array([s.gyr_bias for s in calibration.sensors])
    assert np.abs(gyr - known["gyr_bias"][[0, 2, 3]]).max() < np.deg2rad(0.01)


def test_a_good_tumble_has_a_good_verdict() -> None:
    calibration, verdict = calibrate_sensors(read()[0], NAMES)
    assert verdict.ok
    assert verdict.step == "tumble"
    assert verdict.readings[0].what == "directions"
    assert len(calibration.sensors) == len(NAMES)
    assert {r.about for r in verdict.readings if r.what == "residual"} == set(NAMES)


def test_six_directions_are_too_few() -> None:
    samples, _ = with_errors(turned_board(np.concatenate([SIDES, SIDES])))
    with pytest.raises(CalibrationError, match="in 6 directions, at least 9"):
        calibrate_sensors(samples, NAMES)


def test_a_board_that_was_moved_in_its_rests_is_refused() -> None:
    samples, _ = read()
    creeping = replace(samples, acc=samples.acc.copy())
    for still in still_intervals(samples)[:-8]:
        creep = np.linspace(0.0, 0.1, len(still))[:, None]
        creeping.acc[still.slice, :, 0] += creep
    with pytest.raises(CalibrationError, match=r"lay still 8 times.*in \d+ more it moved"):
        calibrate_sensors(creeping, NAMES)


def test_one_rest_in_which_the_board_moved_is_passed_over() -> None:
    samples, known = read()
    moved = replace(samples, acc=samples.acc.copy())
    rest = still_intervals(samples)[7]
    moved.acc[rest.slice, :, 0] += np.linspace(0.0, 0.15, len(rest))[:, None]
    calibration, verdict = calibrate_sensors(moved, NAMES)
    assert verdict.ok
    assert {s.poses for s in calibration.sensors} == {18}
    scale = [np.array(s.gyr_matrix) @ known["gyr"][i] for i, s in enumerate(calibration.sensors)]
    assert np.abs(np.diagonal(scale, axis1=1, axis2=2) - 1.0).max() < 1e-3


def test_too_short_a_tumble_is_refused() -> None:
    with pytest.raises(CalibrationError, match="still 3 times"):
        calibrate_sensors(read()[0][: 3 * 370], NAMES)


def test_without_any_sensor_it_says_so() -> None:
    samples, _ = read()
    silent = replace(samples, valid=np.zeros_like(samples.valid))
    with pytest.raises(CalibrationError, match="None of the 4 sensors"):
        calibrate_sensors(silent, NAMES)
