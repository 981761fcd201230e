"""Tracks of trackers from files: CSV with poses; TRC, C3D and Qualisys TSV with markers.

CSV has one header row and an instant a row: ``time_s``, rising, and the columns of
`trackers.columns` for each terminal. Empty cells: not seen.

Files of markers need clusters: which markers make a terminal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.recording.marker_files import read_c3d, read_trc, read_tsv
from handstudio.trackers.columns import tracks_of
from handstudio.trackers.markers import cluster_of, track_of
from handstudio.trackers.track import Track

_GUIDE = "docs/trackers.md shows the columns."


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
    time_us = _microseconds(table["time_s"])
    return tracks_of(path, table, time_us)


def _table(path: Path) -> dict[str, Array]:
    import pyarrow as pa  # noqa: PLC0415 - takes its time to load
    from pyarrow import csv  # noqa: PLC0415

    try:
        table = csv.read_csv(path)
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


def _microseconds(time_s: Array) -> Array:
    return np.round(np.nan_to_num(time_s) * 1e6).astype(np.int64)
