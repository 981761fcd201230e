"""Recordings made by others, written as raw import folders (docs/import.md).

BROAD: D. Laidig et al., Data 6 (2021) 72, CC BY 4.0. dfjimu: D. Weber, data by D. Lehmann, MIT.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from scipy.io import loadmat

from handstudio.arrays import Array
from handstudio.maths import so3

DFJIMU_RATE_HZ = 50.0

# BROAD's reference is in ENU, its north the magnetic one; our world has x there
_Q_WORLD_ENU = so3.about_z(-np.pi / 2)


def broad_folder(trial: Path, folder: Path) -> None:
    """One IMU with magnetometer; its movement phase becomes a label."""
    data = loadmat(trial, squeeze_me=True)
    time_s = np.arange(len(data["imu_gyr"])) / float(data["sampling_rate"])
    signals = {"gyr": data["imu_gyr"], "acc": data["imu_acc"], "mag": data["imu_mag"]}
    _write_samples(folder, time_s, {"IMU": signals})
    _write_reference(folder, time_s, {"IMU": so3.multiply(_Q_WORLD_ENU, data["opt_quat"])})
    _write_layout(folder, {"IMU": "body"}, [])
    _write_movement(folder, time_s, np.asarray(data["movement"], dtype=bool))


def dfjimu_folder(trial: Path, folder: Path) -> None:
    """Two IMUs without magnetometer on two segments with one joint."""
    data = loadmat(trial, squeeze_me=True, struct_as_record=False)["data"]
    sensors, reference = np.asarray(data.sensorData), np.asarray(data.ref)
    time_s = np.arange(len(sensors)) / DFJIMU_RATE_HZ
    _write_samples(
        folder,
        time_s,
        {
            "ONE": {"acc": sensors[:, 0:3], "gyr": sensors[:, 3:6]},
            "TWO": {"acc": sensors[:, 6:9], "gyr": sensors[:, 9:12]},
        },
    )
    # its authors' filters hold a start value before the first sample: their estimate t + 1, which
    # belongs to reference t, is the one after sample t, as ours is
    _write_reference(folder, time_s, {"ONE": reference[:, 0:4], "TWO": reference[:, 4:8]})
    axes = int(trial.stem.split("_")[1][0])
    joint = {"name": "joint", "parent": "first", "child": "second", "axes": axes}
    _write_layout(folder, {"ONE": "first", "TWO": "second"}, [joint])


def _write_samples(folder: Path, time_s: Array, sensors: dict[str, dict[str, Array]]) -> None:
    columns = {"time_s": time_s}
    for sensor, signals in sensors.items():
        for kind, values in signals.items():
            for i, axis in enumerate("xyz"):
                columns[f"{sensor}_{kind}_{axis}"] = values[:, i]
    folder.mkdir(parents=True, exist_ok=True)
    pa.parquet.write_table(pa.table(columns), folder / "samples.parquet")


def _write_reference(folder: Path, time_s: Array, orientations: dict[str, Array]) -> None:
    columns = {"time_s": time_s}
    for sensor, q in orientations.items():
        for i, part in enumerate("wxyz"):
            columns[f"{sensor}_q{part}"] = q[:, i]
    pa.csv.write_csv(pa.table(columns), folder / "reference.csv")


def _write_layout(folder: Path, sensors: dict[str, str], joints: list[dict[str, Any]]) -> None:
    lines = ["[sensors]", *(f'{name} = "{segment}"' for name, segment in sensors.items())]
    for joint in joints:
        lines.append("[[joints]]")
        lines += [f"{key} = {value!r}" for key, value in joint.items()]
    (folder / "layout.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_movement(folder: Path, time_s: Array, moving: Array) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moving, [False]]).astype(int)))
    half = 0.5 * (time_s[1] - time_s[0])
    starts, ends = time_s[edges[0::2]] - half, time_s[edges[1::2] - 1] + half
    table = {"start_s": starts, "end_s": ends, "label": ["movement"] * len(starts)}
    pa.csv.write_csv(pa.table(table), folder / "labels.csv")
