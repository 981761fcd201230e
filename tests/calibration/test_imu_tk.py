"""A real sensor, turned by hand: its factory calibration is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.imu_tk import imu_tk


@pytest.mark.real
def test_a_real_sensor_is_found_as_its_factory_found_it(data_dir: Path) -> None:
    found = imu_tk(data_dir / "imu_tk")
    # the factory's axes are rounded to 1 %, its scales to 0.12 and 0.01 %, years before
    np.testing.assert_allclose(found["acc_counts"], found["acc_counts_factory"], rtol=0.004)
    np.testing.assert_allclose(found["gyr_counts"], found["gyr_counts_factory"], rtol=0.003)
    np.testing.assert_allclose(found["acc_bias_counts"], found["acc_bias_counts_factory"], atol=8.0)
    assert found["poses"] >= 35
    assert found["acc_residual"] < 0.004
    assert found["gyr_residual_deg"] < 0.25
