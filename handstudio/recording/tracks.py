"""Tracks of trackers from files: CSV with poses; TRC, C3D and Qualisys TSV with markers.

CSV, one header row, an instant a row:

- ``time_s``: rising.
- For each terminal NAME its place, ``NAME_x_m, NAME_y_m, NAME_z_m`` (or ``_mm`` or ``_cm``), and
  its attitude, terminal to tracker: ``NAME_qw, NAME_qx, NAME_qy, NAME_qz``, or azimuth, elevation
  and roll about z, y and x in this order (as Polhemus means them): ``NAME_azimuth_deg``,
  ``NAME_elevation_deg``, ``NAME_roll_deg``.
- ``NAME_quality``, 0 to 1, may be there. Empty cells: not seen.

Files of markers need clusters: which markers make a terminal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.recording.marker_files import read_c3d, read_trc, read_tsv
from handstudio.trackers.markers import cluster_of, track_of
from handstudio.trackers.track import Track

_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_GUIDE = "docs/trackers.md shows the columns."
_PLACES = [f"_x_{unit}" for unit in _METRES]


def read_tracks(
    path: Path, clusters: Mapping[str, tuple[str, ...]] | None = None
) -> tuple[Track, ...]:
    """All terminals of a file.

    Args:
        path: .csv, .trc, .c3d or .tsv.
        clusters: Of files of markers: the names of each terminal's markers.

    Raises:
        TrackError: the file cannot be read, or does not hold what it should.
    """
    if not path.is_file():
        raise TrackError("{path}: there is no such file.", "Check the path.", path=path)
    if path.suffix.lower() == ".csv":
        return _from_csv(path)
    recording = read_markers(path)
    if not clusters:
        raise TrackError(
            "{path} holds markers, and nothing says which of them make a terminal.",
            "Name them: --cluster NAME=marker,marker,marker. It has {markers}.",
            path=path,
            markers=", ".join(recording.names),
        )
    return tuple(_clustered(path, recording, name, clusters[name]) for name in clusters)


@dataclass(frozen=True, slots=True, eq=False)
class MarkerRecording:
    """Markers over time; NaN where unseen."""

    names: tuple[str, ...]
    time_us: Int64[Array, " n"]
    t_room_marker: Float[Array, "n m 3"]


def read_markers(path: Path) -> MarkerRecording:
    """A file of markers.

    Raises:
        TrackError: it cannot be read.
    """
    readers = {".trc": read_trc, ".c3d": read_c3d, ".tsv": read_tsv}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise TrackError(
            "{path}: files of trackers end in .csv, .trc, .c3d or .tsv.",
            "Export it as one of these.",
            path=path,
        )
    try:
        names, time_s, places_m = reader(path)
    except (OSError, ValueError, IndexError, KeyError, UnicodeDecodeError) as error:
        raise TrackError(
            "{path}: cannot be read: {error}.",
            "Export it anew, with positions of markers.",
            path=path,
            error=str(error).rstrip("."),
        ) from error
    return MarkerRecording(tuple(names), _microseconds(time_s), places_m)


def _clustered(
    path: Path, recording: MarkerRecording, name: str, markers: tuple[str, ...]
) -> Track:
    missing = [each for each in markers if each not in recording.names]
    if missing:
        raise TrackError(
            "{path}: no marker is called {missing}.",
            "It has {markers}.",
            path=path,
            missing=", ".join(missing),
            markers=", ".join(recording.names),
        )
    places = recording.t_room_marker[:, [recording.names.index(each) for each in markers]]
    return track_of(cluster_of(name, markers, places), recording.time_us, places)


def _from_csv(path: Path) -> tuple[Track, ...]:
    table = _table(path)
    if "time_s" not in table:
        raise TrackError(
            "{path}: it has no column time_s, so it has no clock.",
            "Export times in seconds along with the poses. docs/trackers.md shows the columns.",
            path=path,
        )
    names = [
        column.removesuffix(suffix)
        for column in table
        for suffix in _PLACES
        if column.endswith(suffix)
    ]
    if not names:
        raise TrackError(
            "{path}: no column such as NAME_x_mm, so it has no terminal.", _GUIDE, path=path
        )
    time_us = _microseconds(table["time_s"])
    return tuple(_terminal(path, table, name, time_us) for name in names)


def _table(path: Path) -> dict[str, Array]:
    try:
        table = pyarrow.csv.read_csv(path)
        return {
            name: np.asarray(table[name].cast(pa.float64()).to_numpy(), dtype=float)
            for name in table.column_names
            if not pa.types.is_string(table[name].type)
        }
    except (pa.ArrowException, OSError) as error:
        raise TrackError(
            "{path}: cannot be read: {error}.",
            _GUIDE,
            path=path,
            error=str(error).partition("\n")[0].rstrip("."),
        ) from error


def _terminal(path: Path, table: dict[str, Array], name: str, time_us: Array) -> Track:
    unit = next(unit for unit in _METRES if f"{name}_x_{unit}" in table)
    t = _METRES[unit] * _columns(path, table, [f"{name}_{axis}_{unit}" for axis in "xyz"])
    if f"{name}_azimuth_deg" in table:
        turns = ("azimuth", "elevation", "roll")
        angles = np.deg2rad(_columns(path, table, [f"{name}_{turn}_deg" for turn in turns]))
        q = _from_angles(angles)
    else:
        q = _columns(path, table, [f"{name}_q{part}" for part in "wxyz"])
        length = np.linalg.norm(q, axis=1)
        wrong = np.abs(length - 1.0) > 0.05
        if wrong.any():
            row = int(np.argmax(wrong))
            raise TrackError(
                "{path}, row {row}: the quaternion of {name} has a length of {length:.3f}.",
                "Unit quaternions are expected, scalar first.",
                path=path,
                row=row + 2,
                name=name,
                length=float(length[row]),
            )
        q = q / length[:, None]
    seen = np.isfinite(t).all(axis=1) & np.isfinite(q).all(axis=1)
    quality = table.get(f"{name}_quality", np.ones(len(t)))
    quality = np.where(seen, np.clip(np.nan_to_num(quality), 0.0, 1.0), 0.0)
    gone = quality == 0.0
    t[gone], q[gone] = np.nan, np.nan
    return Track(name, time_us, t, q, quality)


def _columns(path: Path, table: dict[str, Array], names: list[str]) -> Array:
    missing = [name for name in names if name not in table]
    if missing:
        raise TrackError(
            "{path}: the column {name} is missing or holds no numbers.",
            _GUIDE,
            path=path,
            name=missing[0],
        )
    return np.stack([table[name] for name in names], axis=1)


def _from_angles(angles: Array) -> Array:
    z, y, x = np.eye(3)[::-1]
    turns = [
        so3.from_axis_angle(axis, angle) for axis, angle in zip((z, y, x), angles.T, strict=True)
    ]
    return so3.multiply(so3.multiply(turns[0], turns[1]), turns[2])


def _microseconds(time_s: Array) -> Array:
    return np.round(np.nan_to_num(time_s) * 1e6).astype(np.int64)
