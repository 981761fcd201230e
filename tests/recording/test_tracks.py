"""Files of trackers: each format read back, and what is wrong with a file is said."""

from __future__ import annotations

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.recording.tracks import read_markers, read_tracks
from handstudio.trackers.poses import placed

NAMES = ("m1", "m2", "m3", "other")
CLUSTER = {"hand": ("m1", "m2", "m3")}
SHAPE = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.0, 0.04, 0.0], [0.1, 0.1, 0.1]])
COUNT = 40


@pytest.fixture
def places() -> Array:
    """Places [m] with a gap; none at the origin, which some formats take for unseen."""
    rng = np.random.default_rng(4)
    q = so3.exp(0.3 * rng.standard_normal((COUNT, 3)))
    t = 0.5 + 0.1 * rng.standard_normal((COUNT, 3))
    out = placed(q[:, None], t[:, None], SHAPE)
    out[10:15, 1] = np.nan
    out[20:22, 3] = np.nan
    return np.round(out, 6)


def _cells(row: Array) -> str:
    return "\t".join("" if np.isnan(value) else f"{1e3 * value:.3f}" for value in row.ravel())


def _trc(path: Path, places: Array) -> Path:
    lines = [
        "PathFileType\t4\t(X/Y/Z)\ta.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"100\t100\t{COUNT}\t4\tmm",
        "Frame#\tTime\t" + "\t\t\t".join(NAMES),
        "\t\t" + "\t".join(f"{axis}{k}" for k in range(1, 5) for axis in "XYZ"),
        *(f"{k + 1}\t{k / 100:.5f}\t{_cells(row)}" for k, row in enumerate(places)),
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def _tsv(path: Path, places: Array) -> Path:
    lines = [
        f"NO_OF_FRAMES\t{COUNT}",
        "FREQUENCY\t100",
        "MARKER_NAMES\t" + "\t".join(NAMES),
        *(_cells(row) for row in places),
    ]
    path.write_text("\n".join(lines) + "\n")
    return path


def _c3d(path: Path, places: Array) -> Path:
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["LABELS"]["value"] = list(NAMES)
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    points = np.ones((4, 4, COUNT))
    points[:3] = 1e3 * np.moveaxis(places, 2, 0).swapaxes(1, 2)
    file["data"]["points"] = points
    residuals = np.where(np.isnan(points[0]), -1.0, 0.0)[None]
    file["data"]["meta_points"]["residuals"] = residuals
    file.write(str(path))
    return path


@pytest.mark.parametrize("write", [_trc, _tsv, _c3d], ids=["trc", "tsv", "c3d"])
def test_markers_come_back_with_their_gaps(tmp_path: Path, places: Array, write) -> None:  # type: ignore[no-untyped-def]
    path = write(tmp_path / f"a.{write.__name__[1:]}", places)
    recording = read_markers(path)
    assert recording.names == NAMES
    np.testing.assert_allclose(recording.t_room_marker, places, atol=2e-6)
    np.testing.assert_array_equal(np.diff(recording.time_us), 10_000)
    (track,) = read_tracks(path, CLUSTER)
    gone = np.isnan(track.t_room_terminal).any(axis=1)
    assert np.flatnonzero(gone).tolist() == [10, 11, 12, 13, 14]


HEADER = "time_s,a_x_mm,a_y_mm,a_z_mm,a_qw,a_qx,a_qy,a_qz,a_quality,note"


def _csv(path: Path, *rows: str, header: str = HEADER) -> Path:
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_csv_in_other_units_is_in_metres(tmp_path: Path) -> None:
    (track,) = read_tracks(
        _csv(
            tmp_path / "a.csv",
            "0,10,20,30,1,0,0,0,1,x",
            "0.01,,,,,,,,,",
            "0.02,40,50,60,0,1,0,0,0.5,y",
        )
    )
    assert track.name == "a"
    assert track.time_us.tolist() == [0, 10_000, 20_000]
    np.testing.assert_allclose(track.t_room_terminal[0], [0.01, 0.02, 0.03])
    assert np.isnan(track.t_room_terminal[1]).all()
    assert track.quality.tolist() == [1.0, 0.0, 0.5]


def test_azimuth_elevation_and_roll_are_turns_about_z_y_and_x(tmp_path: Path) -> None:
    header = "time_s,a_x_m,a_y_m,a_z_m,a_azimuth_deg,a_elevation_deg,a_roll_deg"
    rows = ["0,0,0,0,90,0,0", "1,0,0,0,0,90,0", "2,0,0,0,0,0,90", "3,0,0,0,90,0,90"]
    (track,) = read_tracks(_csv(tmp_path / "a.csv", *rows, header=header))
    x, y, z = (so3.rotate(track.q_room_terminal, axis) for axis in np.eye(3))
    np.testing.assert_allclose(x[0], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(x[1], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(y[2], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(z[3], [1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("header", "row", "what"),
    [
        ("a_x_mm,a_y_mm,a_z_mm,a_qw,a_qx,a_qy,a_qz", "0,0,0,1,0,0,0", "no clock"),
        ("time_s,x,y,z", "0,0,0,0", "no terminal"),
        ("time_s,a_x_mm,a_y_mm,a_z_mm,a_qw", "0,0,0,0,1", "a_qx is missing"),
        (HEADER, "0,0,0,0,2,0,0,0,1,", "row 2: the quaternion of a has a length of 2.000"),
    ],
)
def test_what_a_csv_lacks_is_said(tmp_path: Path, header: str, row: str, what: str) -> None:
    with pytest.raises(TrackError, match=what):
        read_tracks(_csv(tmp_path / "a.csv", row, header=header))


def test_markers_without_a_cluster_are_listed(tmp_path: Path, places: Array) -> None:
    path = _trc(tmp_path / "a.trc", places)
    with pytest.raises(TrackError) as told:
        read_tracks(path)
    assert "m1, m2, m3, other" in told.value.remedy
    with pytest.raises(TrackError, match="no marker is called m9"):
        read_tracks(path, {"hand": ("m1", "m2", "m9")})


@pytest.mark.parametrize("name", ["a.trc", "a.tsv", "a.c3d", "a.csv", "a.xyz"])
def test_nonsense_is_refused_with_its_name(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"\x00\x01nonsense\n\n")
    with pytest.raises(TrackError, match=name):
        read_tracks(path, CLUSTER)


def test_a_file_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(TrackError, match="no such file"):
        read_tracks(tmp_path / "a.csv")
