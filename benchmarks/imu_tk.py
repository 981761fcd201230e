"""The errors of one real sensor, found in a recording of others, beside its factory calibration.

``imu_tk`` is of Tedaldi et al., ICRA 2014. `benchmarks.sensor_errors` shows it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.sensors import calibrate_sensors
from handstudio.samples import ImuSamples
from handstudio.shell import out, print_table

FACTORY_ACC, FACTORY_GYR = np.diag([415.0, 413.0, 415.0]), np.diag([4778.0, 4758.0, 4766.0])
FACTORY_ACC_AXES = np.array([[1.0, 0.0, -0.01], [0.01, 1.0, 0.01], [0.02, 0.01, 1.0]])
FACTORY_GYR_AXES = np.array([[1.0, -0.01, -0.02], [0.0, 1.0, 0.04], [-0.01, 0.01, 1.0]])
FACTORY_ACC_BIAS = (33123.0, 33276.0, 32360.0)
"""Of the unit in ``imu_tk``, counts per SI unit and axes, rounded: Xsens, as the authors' script
calibrate.m compares with them (github JzHuai0108/imu_tk_matlab)."""

IMU_TK_GRAVITY = 9.81744  # as the authors' program has it
_ROUGH = {"acc": 400.0, "gyr": 5000.0}  # counts per SI unit; what begins so is found anyhow
_ZERO = 32768.0


def imu_tk(folder: Path) -> dict[str, Any]:
    """Counts per SI unit along each axis, and residuals, beside the factory's."""
    samples = imu_tk_samples(folder)
    calibration, verdict = calibrate_sensors(
        samples, ["xsens"], gravity=IMU_TK_GRAVITY, scale_sd=0.3
    )
    (sensor,) = calibration.sensors
    return {
        "acc_counts": _sensitivity(np.array(sensor.acc_matrix) / _ROUGH["acc"]),
        "acc_counts_factory": _rows(FACTORY_ACC @ FACTORY_ACC_AXES),
        "gyr_counts": _sensitivity(np.array(sensor.gyr_matrix) / _ROUGH["gyr"]),
        "gyr_counts_factory": _rows(FACTORY_GYR @ FACTORY_GYR_AXES),
        "acc_bias_counts": [_ZERO + _ROUGH["acc"] * b for b in sensor.acc_bias],
        "acc_bias_counts_factory": list(FACTORY_ACC_BIAS),
        "acc_residual": sensor.residuals.acc,
        "gyr_residual_deg": float(np.rad2deg(sensor.residuals.gyr)),
        "poses": sensor.poses,
        "directions": verdict.readings[0].value,
    }


def imu_tk_samples(folder: Path) -> ImuSamples:
    """The recording in rough units: nobody knows more of a new sensor."""
    acc, gyr = (np.loadtxt(folder / f"xsens_{name}.mat") for name in ("acc", "gyro"))
    flags = np.ones((len(acc), 1), dtype=bool)
    return ImuSamples(
        time_us=np.rint(acc[:, 0] * 1e6).astype(np.int64),
        gyr=((gyr[:, 1:] - _ZERO) / _ROUGH["gyr"])[:, None],
        acc=((acc[:, 1:] - _ZERO) / _ROUGH["acc"])[:, None],
        mag=np.full((len(acc), 1, 3), np.nan),
        fresh=~flags,
        valid=flags,
        saturated=~flags,
    )


def _sensitivity(matrix: Array) -> list[float]:
    """Counts per SI unit along every axis of the chip; in whatever frame it is the same."""
    return _rows(np.linalg.inv(matrix))


def _rows(matrix: Array) -> list[float]:
    return [float(value) for value in np.linalg.norm(matrix, axis=1)]


def show_imu_tk(found: dict[str, Any]) -> None:
    """Print it."""
    rows = [
        [
            name,
            *(" ".join(f"{v:.2f}" for v in found[f"{name}{whose}"]) for whose in ("_factory", "")),
        ]
        for name in ("acc_counts", "gyr_counts", "acc_bias_counts")
    ]
    print_table("imu_tk, one Xsens", ["x y z", "factory", "ours"], rows)
    out.print(
        f"residuals: {found['acc_residual']:.4f} m/s², {found['gyr_residual_deg']:.3f} deg; "
        f"{found['poses']} poses, {found['directions']:.0f} directions"
    )
