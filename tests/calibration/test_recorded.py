"""A recording on an even raster, freed of what its sensors are known to err by."""

from __future__ import annotations

import numpy as np

from handstudio.calibration.device import DeviceCalibration, Residuals, SensorErrors, corrected
from handstudio.calibration.recorded import even
from handstudio.samples import ImuSamples

NAMES = ("SN1", "SN2")
UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
BIASED = SensorErrors(
    "SN2", UNIT, (0.1, 0.2, 0.3), UNIT, (0.01, 0.0, 0.02), Residuals(0.0, 0.0), 20
)
KNOWN = DeviceCalibration("VG-1", "2026-03-04T12:30:05+00:00", "handstudio", (), (BIASED,))


def samples(n: int = 40) -> ImuSamples:
    normal = np.random.default_rng(1).standard_normal((3, n, len(NAMES), 3))
    there = np.ones((n, len(NAMES)), dtype=bool)
    return ImuSamples(np.arange(n) * 10_000, *normal, there, there, ~there)


def test_readings_on_the_raster_already_are_only_freed_of_their_errors():
    it = samples()
    laid, expected = even([it], 100.0, KNOWN, NAMES).samples, corrected(it, KNOWN, NAMES)
    for name in ("gyr", "acc"):
        np.testing.assert_allclose(getattr(laid, name), getattr(expected, name), atol=1e-12)
    np.testing.assert_allclose(laid.gyr[:, 1], it.gyr[:, 1] - BIASED.gyr_bias, atol=1e-12)


def test_without_known_errors_readings_stay_as_they_are():
    it = samples()
    np.testing.assert_allclose(even([it], 100.0).samples.acc, it.acc, atol=1e-12)
