"""CSV exports, read back with other people's readers: the numbers of the motion, and where from."""

from __future__ import annotations

import csv
import json
import shutil
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import pyarrow.csv
import pytest

from handstudio import __version__
from handstudio.calibration.device import UNITY, DeviceCalibration, Residuals, SensorErrors, Source
from handstudio.calibration.subject import Centre, SubjectCalibration
from handstudio.errors import TakeError
from handstudio.export import part as part_module
from handstudio.export import tables as tables_module
from handstudio.export.export import export
from handstudio.export.formats import FORMATS
from handstudio.export.part import Content, Processed, Window
from handstudio.hand.angles import ROOT_ANGLES
from handstudio.hand.skeleton import FINGERS, JOINTS, SEGMENTS
from handstudio.health.record import Episode
from handstudio.kinematics import (
    angles_of,
    measured_angles,
    pose_of,
    relative_rotations,
    segment_attitudes,
)
from handstudio.pipeline import Motion
from handstudio.recording.header import Summary
from handstudio.recording.take import Take, open_take
from handstudio.recording.writer import TakeWriter
from handstudio.setup import Setup, calibrated

CONTENTS: tuple[Content, ...] = ("angles", "orientations", "segments", "positions")


def read(path: Path) -> tuple[list[str], np.ndarray]:
    """With Python's own reader."""
    with path.open(newline="", encoding="utf-8") as file:
        names, *rows = list(csv.reader(file))
    return names, np.array([[float(cell) for cell in row] for row in rows])


def export_csv(
    take: Take,
    setup: Setup,
    motion: Motion,
    target: Path,
    *,
    content: Content = "angles",
    window: Window | None = None,
) -> Path:
    source = Processed(take, setup, motion)
    return export(source, target, FORMATS["csv"], content=content, window=window)


def exported(
    take: Take, motion: Motion, folder: Path, content: Content = "angles", **window: float
) -> tuple[list[str], np.ndarray]:
    chosen = Window(**window) if window else None
    setup = take.header.setup
    path = export_csv(take, setup, motion, folder / "out.csv", content=content, window=chosen)
    return read(path)


# --- the numbers ------------------------------------------------------------------------------


@pytest.mark.parametrize("content", CONTENTS)
def test_two_other_readers_read_the_same_table(recorded, motion, tmp_path, content):
    names, values = exported(recorded, motion, tmp_path, content)
    table = pyarrow.csv.read_csv(tmp_path / "out.csv")
    assert table.column_names == names
    assert len(set(names)) == len(names)
    columns = [column.to_numpy().astype(float) for column in table.columns]
    np.testing.assert_array_equal(np.stack(columns, axis=-1), values)


def test_angles_are_those_of_the_hand_in_degrees(recorded, motion, tmp_path):
    names, values = exported(recorded, motion, tmp_path)
    setup = recorded.header.setup
    angles = measured_angles(setup.layout)
    assert names == ["time_s", *(f"{a.name}_deg" for a in angles), "doubtful_sensors"]
    expected = np.rad2deg(angles_of(setup, motion, angles))
    np.testing.assert_allclose(values[:, 1:-1], expected, atol=0.50001e-4)
    assert np.nanmax(np.abs(expected)) > 40.0
    np.testing.assert_array_equal(np.isnan(values[:, 1:-1]), np.isnan(expected))
    np.testing.assert_array_equal(values[:, 1:-1], np.round(values[:, 1:-1], 4))


def test_orientations_are_those_of_the_sensors_and_across_the_joints(recorded, motion, tmp_path):
    names, values = exported(recorded, motion, tmp_path, "orientations")
    layout = recorded.header.setup.layout
    across = relative_rotations(layout, motion.q_world_sensor)
    assert len(across) == len(JOINTS) - 1
    things = [*layout.names, *across]
    assert names == ["time_s", *(f"{t}_q{p}" for t in things for p in "wxyz"), "doubtful_sensors"]
    expected = np.concatenate([motion.q_world_sensor, np.stack(list(across.values()), 1)], axis=1)
    np.testing.assert_allclose(values[:, 1:-1], expected.reshape(len(motion), -1), atol=0.50001e-7)


def test_segments_are_those_of_the_hand_in_the_world(recorded, motion, tmp_path):
    names, values = exported(recorded, motion, tmp_path, "segments")
    assert names == ["time_s", *(f"{s}_q{p}" for s in SEGMENTS for p in "wxyz"), "doubtful_sensors"]
    expected = segment_attitudes(recorded.header.setup, motion.q_world_sensor)
    np.testing.assert_allclose(values[:, 1:-1], expected.reshape(len(motion), -1), atol=0.50001e-7)


def test_positions_are_those_of_joints_and_fingertips_in_millimetres(recorded, motion, tmp_path):
    names, values = exported(recorded, motion, tmp_path, "positions")
    points = [*(joint.name for joint in JOINTS), *(f"{finger}_tip" for finger in FINGERS)]
    assert names == ["time_s", *(f"{p}_{a}_mm" for p in points for a in "xyz"), "doubtful_sensors"]
    pose = pose_of(recorded.header.setup, motion.q_world_sensor)
    expected = np.concatenate([pose.t_world_joint, pose.t_world_tip], axis=1) * 1e3
    np.testing.assert_allclose(values[:, 1:-1], expected.reshape(len(motion), -1), atol=0.50001e-3)


@pytest.mark.parametrize("content", CONTENTS)
def test_time_counts_seconds_from_the_takes_first_instant(recorded, motion, tmp_path, content):
    _, values = exported(recorded, motion, tmp_path, content)
    time_s = (motion.time_us - motion.time_us[0]) / 1e6
    np.testing.assert_allclose(values[:, 0], time_s, atol=1e-12)


def test_doubtful_sensors_are_counted(recorded, motion, door, tmp_path):
    _, values = exported(recorded, motion, tmp_path)
    np.testing.assert_array_equal(values[:, -1], (motion.doubt != 0).sum(axis=1))
    assert values[0, -1] == 20.0
    _, values = exported(*door, tmp_path, "orientations")
    assert values[:, -1].tolist() == [0.0, 1.0, 2.0, 1.0, 0.0]


@pytest.mark.parametrize("content", CONTENTS)
def test_how_many_rows_are_written_at_a_time_changes_no_byte(
    recorded, motion, tmp_path, monkeypatch, content
):
    exported(recorded, motion, tmp_path, content)
    whole = (tmp_path / "out.csv").read_bytes()
    monkeypatch.setattr(part_module, "BLOCK", 97)
    exported(recorded, motion, tmp_path, content)
    assert (tmp_path / "out.csv").read_bytes() == whole
    assert b"-0," not in whole


# --- the window -------------------------------------------------------------------------------


def test_a_window_holds_both_its_ends(recorded, motion, tmp_path):
    names, values = exported(recorded, motion, tmp_path, start_s=1.0, end_s=2.5)
    assert values[[0, -1], 0].tolist() == [1.0, 2.5]
    assert len(values) == 151
    all_names, whole = exported(recorded, motion, tmp_path)
    assert names == all_names
    np.testing.assert_array_equal(values, whole[100:251])


@pytest.mark.parametrize(
    ("window", "times"),
    [
        ({"start_s": 0.0, "end_s": 0.0}, [0.0]),
        ({"start_s": 0.02, "end_s": 0.1}, [0.02, 0.040001, 0.1]),
        ({"start_s": 0.1}, [0.1, 0.12]),
        ({"start_s": -5.0, "end_s": 99.0}, [0.0, 0.02, 0.040001, 0.1, 0.12]),
    ],
)
def test_a_window_is_in_time_and_not_in_rows(door, tmp_path, window, times):
    _, values = exported(*door, tmp_path, "orientations", **window)
    assert values[:, 0].tolist() == times


@pytest.mark.parametrize("window", [{"start_s": 0.041, "end_s": 0.09}, {"start_s": 7.0}])
def test_a_window_in_which_nothing_lies_says_where_there_is_something(door, tmp_path, window):
    with pytest.raises(TakeError, match=r"Nothing lies between.*\n.*within 0 and 0\.12 s"):
        exported(*door, tmp_path, "orientations", **window)
    assert list(tmp_path.glob("out*")) == []


def test_a_motion_of_nothing_is_not_exported(door, tmp_path):
    take, motion = door
    with pytest.raises(TakeError, match="no instant"):
        exported(take, motion[:0], tmp_path, "orientations")


# --- without a start, without a hand ----------------------------------------------------------


def test_angles_from_the_start_are_absent_where_there_is_none(recorded, motion, tmp_path):
    names, values = exported(recorded, motion, tmp_path, start_s=0.0, end_s=0.3)
    assert not {f"{name}_deg" for name in ROOT_ANGLES} & set(names)
    assert np.isfinite(values).all()
    assert not any("elbow" in key for key in json.loads(sidecar(tmp_path)))


def test_angles_from_the_start_are_told_as_such(recorded, motion, tmp_path):
    names, values = exported(recorded, motion, tmp_path)
    assert names[1:3] == [f"{name}_deg" for name in ROOT_ANGLES]
    placed = np.isfinite(motion.q_world_start[:, 0])
    np.testing.assert_array_equal(np.isfinite(values[:, 1]), placed)
    assert "upper arm assumed still" in json.loads(sidecar(tmp_path))[" and ".join(ROOT_ANGLES)]


def test_a_take_without_a_hand_gives_orientations(door, tmp_path):
    take, motion = door
    names, values = exported(take, motion, tmp_path, "orientations")
    things = ["leaf, inner", "frame", "hinge"]
    assert names == ["time_s", *(f"{t}_q{p}" for t in things for p in "wxyz"), "doubtful_sensors"]
    across = relative_rotations(take.header.setup.layout, motion.q_world_sensor)["hinge"]
    np.testing.assert_allclose(values[:, 9:13], across, atol=0.50001e-7)


@pytest.mark.parametrize("content", ["angles", "positions", "segments"])
def test_a_take_without_a_hand_has_no_angles_and_leaves_no_file(door, tmp_path, content):
    with pytest.raises(TakeError, match=r"no joint angles.*which hand.*\n.*orientations instead"):
        exported(*door, tmp_path, content)
    assert list(tmp_path.glob("out*")) == []


# --- where it is from -------------------------------------------------------------------------


def sidecar(folder: Path) -> str:
    return (folder / "out.csv.json").read_text(encoding="utf-8")


@pytest.mark.parametrize("content", CONTENTS)
def test_every_export_says_where_it_is_from(recorded, motion, tmp_path, content):
    exported(recorded, motion, tmp_path, content, start_s=1.0)
    told = json.loads(sidecar(tmp_path))
    header = recorded.header
    assert told["content"] == content
    assert told["subject"] == "virtual-0"
    assert told["hand_side"] == "left"
    assert told["hand_length_m"] == 0.175
    assert list(told["sensor_map"].items()) == [
        (place.sensor, place.segment) for place in header.setup.layout.sensors
    ]
    assert told["nominal_rate_hz"] == told["measured_rate_hz"] == 100.0
    assert told["loss_percent"] == 0.0
    assert told["findings"] == []
    assert told["calibration"] == header.setup.calibration
    assert told["zero"] == header.setup.zero
    assert told["zero_source"] == "maker"
    for key in ("made", "residuals"):
        assert told[f"calibration_{key}"] is None
    assert told["sensor_calibration"] is told["heading_alignment_deg"] is None
    assert "flexion (about x), deviation (about z), rotation (about y)" in told["convention"]
    assert told["filter"]["type"] == "vqf"
    assert told["software"] == f"handstudio {__version__}"
    assert told["raw_file"] == recorded.path.name
    assert told["raw_sha256"] == recorded.sha256()
    start = datetime.fromisoformat(told["start_utc"])
    assert abs((start - datetime.fromtimestamp(header.start_utc_ns / 1e9, UTC)).total_seconds()) < (
        0.002
    )
    assert told["device"]["serial_number"] == "VG-1"


def test_what_was_calibrated_goes_along(recorded, motion, tmp_path):
    layout = recorded.header.setup.layout
    centre = Centre(
        "index_pip", "SN16", (0.0, 0.03, 0.0), (1e-3,) * 3, (1.0, 0.0, 0.0), 0.2, (60.0, 3.0), 7.0
    )
    subject = SubjectCalibration(
        *("S01-3", "2026-03-04T12:30:05Z", "handstudio 9", "S01", "left", 0.18, 3, "VG-1", (), ()),
        centres=(centre,),
        takes=(("course", "ab" * 32),),
    )
    zero = (0.0, 0.0, 0.0)
    errors = SensorErrors("SN1", UNITY, zero, UNITY, zero, Residuals(0.1, np.deg2rad(0.3)), 12)
    sensors = DeviceCalibration(
        *("VG-1", "2026-03-03T12:30:05Z", "handstudio 8", (Source("tumble", "cd" * 32),), (errors,))
    )
    setup = calibrated(recorded.header.setup, subject=subject, sensors=sensors)
    setup = msgspec.structs.replace(
        setup, heading_rad=tuple(np.deg2rad(np.arange(len(layout.names))).tolist())
    )
    export_csv(recorded, setup, motion, tmp_path / "out.csv")
    told = json.loads(sidecar(tmp_path))
    assert told["calibration"] == told["calibration_made"]["id"] == "S01-3"
    assert told["calibration_made"]["takes"] == {"course": "ab" * 32}
    assert told["calibration_residuals"] == [
        {"joint": "index_pip", "sensor": "SN16", "residual_m_s2": 0.2, "place_sd_mm": [1.0] * 3}
    ]
    assert told["zero_source"] == "calibration"
    assert told["sensor_calibration"]["software"] == "handstudio 8"
    assert told["sensor_calibration"]["residuals"]["SN1"]["gyr_deg"] == pytest.approx(0.3)
    assert told["heading_alignment_deg"]["SN4"] == pytest.approx(3.0)
    other = msgspec.structs.replace(setup.subject, mirrored_from="S01-2")
    setup = msgspec.structs.replace(setup, subject=other)
    export_csv(recorded, setup, motion, tmp_path / "out.csv")
    assert json.loads(sidecar(tmp_path))["zero_source"] == "mirror of the other hand"


def test_loss_and_measured_rate_are_what_they_were(recorded, motion, tmp_path):
    header = recorded.header
    writer = TakeWriter(tmp_path / "lossy.mcap", header)
    lossy = open_take(writer.close(Summary(0, 0, 6.0, packets=975, missing=25)))
    half = Motion(*(getattr(motion, name)[::2] for name in Motion.__slots__))
    exported(lossy, half, tmp_path)
    told = json.loads(sidecar(tmp_path))
    assert told["loss_percent"] == 2.5
    assert (told["nominal_rate_hz"], told["measured_rate_hz"]) == (100.0, 50.0)


def test_what_was_wrong_goes_along(recorded, motion, tmp_path):
    wrong = (
        Episode("magnetic", "note", (16,), 1.0, 2.5, 20.0),
        Episode("magnetic", "act", (14, 16), 4.0, 5.0, 44.4444),
        Episode("loss", "note", (), 0.0, 0.25, 0.5),
    )
    health = msgspec.structs.replace(recorded.summary.health, episodes=wrong)
    summary = msgspec.structs.replace(recorded.summary, chunks=0, bytes=0, health=health)
    spoilt = open_take(TakeWriter(tmp_path / "spoilt.mcap", recorded.header).close(summary))
    exported(spoilt, motion, tmp_path)
    told = json.loads(sidecar(tmp_path))
    assert told["findings"] == [
        {
            "kind": "magnetic",
            "level": "act",
            "sensors": ["SN15", "SN17"],
            "times": 2,
            "seconds": 2.5,
            "worst": 44.444,
            "unit": "%",
        },
        {
            "kind": "loss",
            "level": "note",
            "sensors": [],
            "times": 1,
            "seconds": 0.25,
            "worst": 0.5,
            "unit": "%",
        },
    ]


def test_what_nobody_knows_is_null(door, tmp_path):
    take, motion = door
    exported(take, motion[:1], tmp_path, "orientations")
    told = json.loads(sidecar(tmp_path))
    assert told["loss_percent"] is None
    assert told["measured_rate_hz"] is None
    assert told["device"] is None


# --- files ------------------------------------------------------------------------------------


def test_folders_are_made_and_an_export_before_is_replaced_whole(recorded, motion, tmp_path):
    setup = recorded.header.setup
    target = tmp_path / "a" / "b" / "out.csv"
    export_csv(recorded, setup, motion, target)
    export_csv(recorded, setup, motion, target, content="orientations")
    assert read(target)[0][1] == "SN1_qw"
    assert sorted(path.name for path in target.parent.iterdir()) == ["out.csv", "out.csv.json"]


def test_a_file_that_cannot_be_written_is_named_and_the_one_before_stays(
    recorded, motion, tmp_path, monkeypatch
):
    exported(recorded, motion, tmp_path)
    before = (tmp_path / "out.csv").read_bytes()
    monkeypatch.setattr(tables_module.Table, "rounded", _full)
    with pytest.raises(TakeError, match=r"out\.csv: cannot be written.*\n.*another folder"):
        exported(recorded, motion, tmp_path, "positions")
    assert (tmp_path / "out.csv").read_bytes() == before
    assert list(tmp_path.glob("*.part")) == []
    shutil.copy(tmp_path / "out.csv", tmp_path / "file")
    with pytest.raises(TakeError, match="cannot be written"):
        export_csv(recorded, recorded.header.setup, motion, tmp_path / "file" / "out.csv")


def _full(*_: object) -> np.ndarray:
    raise OSError(28, "No space left on device")
