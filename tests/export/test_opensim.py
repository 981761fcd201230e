"""OpenSim's tables, read by a strict reader of our own.

OpenSim's own Python package reads them too (4.6: `TimeSeriesTable`, `Storage`,
`TimeSeriesTableQuaternion`, `TimeSeriesTableVec3`, `MarkerData`); it is too large to be installed
for every run.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from handstudio.export.part import Processed
from handstudio.kinematics import angles_of, measured_angles

from .conftest import GAP


def read(path: Path) -> tuple[dict[str, str], list[str], list[list[str]]]:
    """Header, names of the columns, cells; whatever is not as the format says is an error."""
    head, _, table = path.read_text("utf-8").partition("\nendheader\n")
    title, *lines = head.split("\n")
    assert "=" not in title
    about = dict(line.split("=", maxsplit=1) for line in lines)
    names, *rows = (line.split("\t") for line in table.removesuffix("\n").split("\n"))
    assert names[0] == "time"
    assert len(set(names)) == len(names)
    assert all(len(row) == len(names) for row in rows)
    assert "\t" not in head
    return about, names[1:], rows


def test_a_motion_is_the_angles_in_degrees(into, whole):
    about, names, rows = read(into("mot", whole))
    assert (about["inDegrees"], about["version"]) == ("yes", "1")
    assert (int(about["nRows"]), int(about["nColumns"])) == (len(rows), len(names) + 1)
    angles = measured_angles(whole.setup.layout)
    assert names == [angle.name for angle in angles]
    expected = np.rad2deg(angles_of(whole.setup, whole.motion, angles))
    known = np.isfinite(expected).all(axis=1)
    assert 0 < (~known).sum() < 60, "before the first rest there is no elbow flexion"
    values = np.array(rows, dtype=float)
    np.testing.assert_allclose(values[:, 1:], expected[known], atol=0.50001e-4)
    time_s = (whole.motion.time_us - whole.motion.time_us[0]) / 1e6
    np.testing.assert_array_equal(values[:, 0], np.round(time_s[known], 6))


def test_without_angles_from_the_start_a_motion_has_every_instant(into, whole, gappy):
    _, names, rows = read(into("mot", whole, angles=("wrist_flexion",)))
    assert names == ["wrist_flexion"]
    assert len(rows) == len(whole.motion)
    _, _, some = read(into("mot", gappy, angles=("wrist_flexion",)))
    assert some == rows[: GAP.start] + rows[GAP.stop :]


def test_sensors_are_quaternions_called_as_opensense_looks_for_them(into, whole):
    about, names, rows = read(into("sto", whole, start_s=1.0))
    assert (about["DataType"], float(about["DataRate"])) == ("Quaternion", 100.0)
    assert names[:4] == ["forearm_imu", "forearm_SN2_imu", "forearm_SN3_imu", "hand_ulnar_imu"]
    assert len(names) == 20
    cells = np.array([[cell.split(",") for cell in row[1:]] for row in rows], dtype=float)
    np.testing.assert_allclose(cells, whole.motion.q_world_sensor[100:], atol=0.50001e-9)
    assert rows[0][0] == "1.000000"
    assert about["handstudio_subject"] == "virtual-0"
    assert about["handstudio_raw_sha256"] == whole.take.sha256()


def test_no_name_breaks_a_table(into, door):
    _, names, rows = read(into("sto", Processed(door[0], door[0].header.setup, door[1])))
    assert names == ["door_imu", "wall_imu"]
    assert [row[0] for row in rows] == ["0.000000", "0.020000", "0.040001", "0.100000", "0.120000"]
