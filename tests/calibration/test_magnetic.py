"""Magnetometers of a tumbled hand: iron and turned axes are found, missing ones are said."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.sensor_errors import MOTION, tumbled
from handstudio.calibration.inertial import Inertial, inertial
from handstudio.calibration.magnetic import Magnetic, magnetic, readings_of
from handstudio.calibration.sensors import calibrate_sensors
from handstudio.calibration.still import Still, Turns, poses_of, still_intervals, turns_of
from handstudio.maths import so3
from handstudio.samples import ImuSamples

NAMES = ("SN4", "SN11", "SN15", "SN20")
AT = [3, 10, 14, 19]
LENGTH_UT = float(np.hypot(31.0, 35.0))
NOISY = "bias,scale,misalignment,g_sensitivity,white_noise,mag_noise,mag_hold,quantisation"


@cache
def hand(imperfections: str) -> tuple[ImuSamples, np.ndarray]:
    """Some sensors of a tumbled hand in an even field, and the accelerometers' true matrices."""
    worn, samples = tumbled(2, 2, imperfections, MOTION)
    signals = (getattr(samples, name)[:, AT] for name in ImuSamples.__slots__[1:])
    return ImuSamples(samples.time_us, *signals), worn.drawn.inertial[AT, :3, :3]


def with_iron(samples: ImuSamples, hard_ut: float = 20.0) -> tuple[ImuSamples, np.ndarray]:
    """Soft iron, axes turned by some degrees, and hard iron in any size."""
    rng = np.random.default_rng(5)
    shape = 0.05 * rng.standard_normal((len(AT), 3, 3))
    soft = so3.to_matrix(so3.exp(0.1 * rng.standard_normal((len(AT), 3)))) @ (np.eye(3) + shape)
    hard = hard_ut * rng.standard_normal((len(AT), 3))
    return replace(samples, mag=np.einsum("sij,nsj->nsi", soft, samples.mag) + hard), soft


@cache
def lying() -> tuple[tuple[Still, ...], Turns, Inertial]:
    """What accelerometers and gyroscopes tell of the noisy hand: the same whatever is magnetic."""
    samples, _ = hand(NOISY)
    stills = still_intervals(samples)
    turns = turns_of(samples, stills)
    return stills, turns, inertial(poses_of(samples, stills), turns)


def found_in(samples: ImuSamples, field_ut: float | None = None) -> tuple[Magnetic, np.ndarray]:
    """What is found, and the accelerometers' matrices as found."""
    stills, turns, found = lying()
    return magnetic(readings_of(samples, stills, turns, found), field_ut), found.acc_matrix


def turned(found: Magnetic, acc: np.ndarray, soft: np.ndarray, of_acc: np.ndarray) -> np.ndarray:
    """What is left of soft iron and turned axes, in the frame of the corrected accelerometer."""
    u, _, v = np.linalg.svd(acc @ of_acc)
    return np.asarray((u @ v).swapaxes(1, 2) @ found.matrix @ soft - np.eye(3))


@pytest.mark.parametrize("hard_ut", [0.0, 20.0, 100.0])
def test_iron_and_turned_axes_are_found(hard_ut: float) -> None:
    samples, of_acc = hand(NOISY)
    samples, soft = with_iron(samples, hard_ut)
    found, acc = found_in(samples, LENGTH_UT)
    assert found.known.all()
    off = turned(found, acc, soft, of_acc)
    assert np.abs(off).max() < 0.004
    # what turns a compass: half of it what is not symmetric
    assert np.rad2deg(np.abs(off - off.swapaxes(1, 2)).max() / 2.0) < 0.15
    assert found.residual.max() < 0.004
    assert found.field_ut == LENGTH_UT
    assert np.rad2deg(np.abs(found.dip - np.arctan2(35.0, 31.0)).max()) < 0.2


def test_without_a_length_the_field_is_as_long_as_sensors_have_it() -> None:
    samples, soft = with_iron(hand(NOISY)[0])
    found, _ = found_in(samples)
    gains = np.abs(np.linalg.det(soft)) ** (1.0 / 3.0)
    assert found.field_ut == pytest.approx(LENGTH_UT * np.median(gains), rel=0.03)


def test_stale_readings_are_not_looked_at() -> None:
    samples, _ = hand(NOISY)
    fresh = samples.fresh & (np.arange(len(samples)) % 3 == 0)[:, None]
    kept = replace(samples, fresh=fresh)
    spoilt = replace(kept, mag=np.where(fresh[..., None], samples.mag, 1e3))
    assert np.array_equal(found_in(spoilt)[0].matrix, found_in(kept)[0].matrix)


@pytest.mark.parametrize("reading", [np.nan, 0.0])
def test_a_missing_magnetometer_has_no_entry_and_is_said(reading: float) -> None:
    samples, _ = hand(NOISY)
    missing = replace(samples, mag=samples.mag.copy())
    missing.mag[:, 1] = reading
    calibration, verdict = calibrate_sensors(missing, NAMES)
    has = {s.name: s.mag_matrix is not None for s in calibration.sensors}
    assert has == {"SN4": True, "SN11": False, "SN15": True, "SN20": True}
    (reading_of_it,) = verdict.failing
    assert (reading_of_it.about, reading_of_it.value, reading_of_it.limit) == ("magnetometer", 3, 4)


def test_a_device_without_magnetometers_is_calibrated_all_the_same() -> None:
    samples, _ = hand(NOISY)
    calibration, verdict = calibrate_sensors(
        replace(samples, mag=np.full_like(samples.mag, np.nan)), NAMES
    )
    assert verdict.ok
    assert calibration.field_ut is None
    assert [s.mag_bias for s in calibration.sensors] == [None] * len(NAMES)


def test_iron_beside_one_rest_pulls_little() -> None:
    samples, of_acc = hand(NOISY)
    samples, soft = with_iron(samples)
    rest = still_intervals(samples)[6]
    samples.mag[rest.slice] += [8.0, -5.0, 3.0]
    found, acc = found_in(samples, LENGTH_UT)
    assert np.abs(turned(found, acc, soft, of_acc)).max() < 0.01
