"""Our VQF against its authors' package, run directly; and a compass slower than the rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from vqf import VQF

from handstudio.fusion.vqf_filter import VqfFilter
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.samples import ImuSamples
from handstudio.simulation.imperfections import MPU9250, read, switched_on
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject

Q_WORLD_ENU = so3.about_z(-0.5 * np.pi)  # the package's y points north, our x does


def showing(rate_hz: int, seconds: float = 4.0) -> tuple[ImuSamples, np.ndarray]:
    """Two sensors of a hand that makes a fist, with errors of real ones, and their truth."""
    layout = glove("right", ["SN11", "SN16"])
    time_us = 3_500_000 + np.arange(round(seconds * rate_hz)) * (1_000_000 // rate_hz)
    exact, truth = signals(ideal_subject("right"), layout, showcase("right"), time_us)
    readings, _ = read(MPU9250, 5, rate_hz, switched_on(2), exact)
    si, ranges = readings.counts / 32768, MPU9250.ranges
    samples = replace(
        exact,
        acc=si[..., 0:3] * ranges.acc,
        gyr=si[..., 3:6] * ranges.gyr,
        mag=si[..., 6:9] * ranges.mag,
        fresh=readings.fresh,
    )
    return samples, truth.q_world_sensor


def ours(fusion: VqfFilter, samples: ImuSamples, rate_hz: int) -> np.ndarray:
    begun = fusion.begin(2, float(rate_hz), magnetometer_rate_hz=100.0)
    return fusion.run(begun, samples, np.ones(len(samples)), samples.valid)[0]


def directly(vqf: VQF, samples: ImuSamples, sensor: int) -> np.ndarray:
    """Sample by sample, as the package's own documentation does it."""
    out = []
    for k in range(len(samples)):
        gyr, acc, mag = (getattr(samples, kind)[k, sensor] for kind in ("gyr", "acc", "mag"))
        vqf.updateGyr(gyr.copy())
        vqf.updateAcc(acc.copy())
        if samples.fresh[k, sensor]:
            vqf.updateMag(mag.copy())
        out.append(so3.multiply(Q_WORLD_ENU, np.asarray(vqf.getQuat9D())))
    return np.array(out)


@pytest.mark.parametrize("rate_hz", [100, 1000])
def test_it_is_the_authors_package(rate_hz):
    samples, _ = showing(rate_hz)
    assert samples.fresh.mean() == pytest.approx(100 / rate_hz, abs=0.001)
    fused = ours(VqfFilter(), samples, rate_hz)
    for sensor in range(2):
        theirs = directly(VQF(1.0 / rate_hz, magTs=0.01), samples, sensor)
        np.testing.assert_array_equal(fused[:, sensor], theirs)


def test_a_compass_cannot_read_more_often_than_it_is_asked():
    fusion = VqfFilter()
    slow = fusion.begin(2, 50.0, magnetometer_rate_hz=100.0)
    assert fusion.pack(slow) == fusion.pack(fusion.begin(2, 50.0))


def test_its_parameters_reach_the_package():
    samples, _ = showing(100)
    fused = ours(VqfFilter(tau_acc_s=1.0, tau_mag_s=2.0), samples, 100)
    same = directly(VQF(0.01, tauAcc=1.0, tauMag=2.0), samples, 0)
    other = directly(VQF(0.01), samples, 0)
    np.testing.assert_array_equal(fused[:, 0], same)
    assert np.any(fused[:, 0] != other)


def test_without_its_compass_it_is_the_package_with_two_kinds_of_sensor():
    samples, _ = showing(100)
    gyr, acc = (np.ascontiguousarray(getattr(samples, kind)[:, 1]) for kind in ("gyr", "acc"))
    expected = so3.multiply(Q_WORLD_ENU, VQF(0.01).updateBatch(gyr, acc)["quat6D"])
    absent = replace(
        samples, mag=np.full_like(samples.mag, np.nan), fresh=np.zeros_like(samples.fresh)
    )
    for fused in (
        ours(VqfFilter(use_magnetometer=False), samples, 100),
        ours(VqfFilter(), absent, 100),
    ):
        np.testing.assert_array_equal(fused[:, 1], expected)


def test_a_reading_of_the_compass_that_is_not_fresh_is_not_looked_at():
    samples, _ = showing(1000, seconds=1.0)
    for nonsense in (np.nan, 1e4):
        mag = samples.mag.copy()
        mag[~samples.fresh] = nonsense
        fused = ours(VqfFilter(), replace(samples, mag=mag), 1000)
        np.testing.assert_array_equal(fused, ours(VqfFilter(), samples, 1000))


def test_a_fresh_reading_that_is_no_number_is_passed_over():
    samples, _ = showing(100, seconds=1.0)
    mag, fresh = samples.mag.copy(), samples.fresh.copy()
    mag[40:60, 0, 1] = np.nan
    fresh[40:60, 0] = False
    fused = ours(VqfFilter(), replace(samples, mag=mag), 100)
    np.testing.assert_array_equal(fused, ours(VqfFilter(), replace(samples, fresh=fresh), 100))


def test_a_compass_at_a_tenth_of_the_rate_corrects_as_fast_as_one_at_full_rate():
    """VQF has to be told: it would take each reading for a thousandth of a second of evidence."""
    wrong = so3.about_z(np.deg2rad(20.0))
    left = {}
    for rate_hz in (100, 1000):
        samples, truth = showing(rate_hz, seconds=6.0)
        fusion = VqfFilter()
        state = fusion.begin(2, float(rate_hz), magnetometer_rate_hz=100.0)
        for sensor in range(2):
            placed = so3.multiply(wrong, truth[0, sensor])
            state = fusion.place(state, sensor, placed, np.zeros(3))
        fused, _ = fusion.run(state, samples, np.ones(len(samples)), samples.valid)
        error = so3.heading(so3.multiply(fused[-1], so3.conjugate(truth[-1])))
        left[rate_hz] = np.rad2deg(error)
    np.testing.assert_allclose(left[1000], left[100], atol=2.0)
    assert (np.abs(left[100]) < 17.0).all()
    assert (np.abs(left[100]) > 5.0).all()
