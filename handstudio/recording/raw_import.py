"""Turning a folder of foreign recordings into a take (the format: docs/import.md)."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from handstudio.arrays import Array
from handstudio.errors import ImportFolderError, LayoutError
from handstudio.hand.skeleton import HandType
from handstudio.layout import JointPlace, Layout, SensorPlace, glove
from handstudio.protocol.packets import TIP_SENSOR, sensor_name
from handstudio.recording.header import Header, Summary
from handstudio.recording.library import new_take_path
from handstudio.recording.notes import Label, Notes, save_notes
from handstudio.recording.reference import Reference, save_reference
from handstudio.recording.writer import TakeWriter
from handstudio.samples import ImuSamples
from handstudio.setup import HandModel, Setup

BLOCK = 1024  # instants in one message of the take

_SIGNALS = ("gyr", "acc", "mag")
_AXES = ("x", "y", "z")
_LATEST_US = 2.0**52  # the year 2112, and half of what floats count exactly
_GUIDE = "docs/import.md shows what a folder must hold."
_LAYOUT_GUIDE = (
    "Add a layout.toml that says where each sensor sits. docs/import.md shows what a folder must "
    "hold."
)


@dataclass(frozen=True, slots=True)
class Folder:
    """What a raw import folder holds, checked."""

    samples: ImuSamples
    layout: Layout
    rate_hz: float
    magnetometer_rate_hz: float | None
    labels: tuple[Label, ...]
    reference: Reference | None


def import_folder(
    folder: Path,
    sessions: Path,
    subject: str,
    name: str | None = None,
    hand: HandModel | None = None,
) -> Path:
    """Turn a raw import folder into a take of the library; the folder is not changed.

    Returns:
        Path of the new take.

    Raises:
        ImportFolderError: something is missing or wrong; names file, row and remedy.
        TakeError: the take cannot be written.
    """
    content = read_folder(folder)
    now = datetime.now(UTC)
    path = new_take_path(sessions, subject, name or folder.resolve().name, now)
    start_ns = int(now.timestamp() * 1e9)
    rates = content.rate_hz, content.magnetometer_rate_hz
    setup = Setup(content.layout, *rates, hand=hand or HandModel())
    header = Header(path.stem, subject, start_ns, setup, "samples", folder.resolve().name)
    writer = TakeWriter(path, header)
    try:
        time_us = content.samples.time_us
        zero_ns = start_ns - int(time_us[0]) * 1000  # the host time of the folder's own time 0
        for start in range(0, len(content.samples), BLOCK):
            writer.write_samples(content.samples[start : start + BLOCK], zero_ns)
        writer.close(Summary(writer.chunks, writer.bytes, float(time_us[-1] - time_us[0]) * 1e-6))
    except BaseException:
        writer.discard()  # the folder still has it all
        raise
    if content.labels:
        save_notes(path, Notes(labels=content.labels))
    if content.reference is not None:
        save_reference(path, content.reference)
    return path


def read_folder(folder: Path) -> Folder:
    """Read and check a raw import folder.

    Raises:
        ImportFolderError: something is missing or wrong; names file, row and remedy.
    """
    if not folder.is_dir():
        raise ImportFolderError(
            "{folder}: there is no such folder.", "Check the path.", folder=folder
        )
    table = _table(folder, "samples")
    if table is None:
        raise ImportFolderError(
            "{folder}: no samples.csv and no samples.parquet in it.", _GUIDE, folder=folder
        )
    layout = _layout(folder, table)
    time_us = _times(table, "samples")
    signals = {kind: _signal(table, layout, kind) for kind in _SIGNALS}
    fresh = np.asarray(np.isfinite(signals["mag"]).all(axis=-1))
    shape = fresh.shape
    samples = ImuSamples(
        time_us,
        **signals,
        fresh=fresh,
        valid=np.ones(shape, dtype=bool),
        saturated=np.zeros(shape, dtype=bool),
    )
    rate = 1e6 / float(np.median(np.diff(time_us)))
    magnetometer_rate = rate * _typical_share(fresh)
    return Folder(
        samples,
        layout,
        rate,
        magnetometer_rate or None,
        _labels(folder, float(time_us[0]) * 1e-6),
        _reference(folder, layout),
    )


def _table(folder: Path, stem: str) -> pa.Table | None:
    for name, read in _READERS.items():
        path = folder / f"{stem}{name}"
        if not path.exists():
            continue
        try:
            table = read(path)
        except (pa.ArrowException, OSError) as error:
            raise ImportFolderError(
                "{path}: cannot be read as a table ({reason}).",
                "It needs one header row, commas, and a number in every cell. docs/import.md shows "
                "what a folder must hold.",
                path=path,
                reason=error,
            ) from error
        repeated = [name for name in table.column_names if table.column_names.count(name) > 1]
        if repeated:
            raise ImportFolderError(
                "{path}: more than one column {column}.", "Keep one.", path=path, column=repeated[0]
            )
        return table
    return None


_READERS: dict[str, Callable[[Path], pa.Table]] = {
    ".parquet": pa.parquet.read_table,
    ".csv": pa.csv.read_csv,
}


def _layout(folder: Path, table: pa.Table) -> Layout:
    path = folder / "layout.toml"
    if not path.exists():
        return _glove_layout(folder, table, _LayoutFile())
    try:
        file = msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), _LayoutFile)
        return _parse_layout(file) if file.hand_type is None else _glove_layout(folder, table, file)
    except (OSError, ValueError) as error:  # not readable, not UTF-8, not TOML, not a layout
        raise ImportFolderError(
            "{path}: not a layout ({reason}).", _GUIDE, path=path, reason=error
        ) from error
    except LayoutError as error:
        raise ImportFolderError(
            "{path}: {fault}", "{fault.remedy}", path=path, fault=error
        ) from error


def _glove_layout(folder: Path, table: pa.Table, file: _LayoutFile) -> Layout:
    """The layout of a folder that names no sensors: the glove's, and no others."""
    if file.sensors or file.joints:
        raise LayoutError(
            "hand_type divides the palm of the glove's own sensors, and there are others too.",
            "Leave hand_type out: the joints say how the palm is divided.",
        )
    named = {name.rpartition("_gyr_")[0] for name in table.column_names if "_gyr_" in name}
    known = [name for name in (*glove().names, sensor_name(TIP_SENSOR)) if name in named]
    unknown = sorted(named - set(known))
    if unknown:
        raise ImportFolderError(
            "{folder}: no layout.toml names the sensors, and the glove has no sensor {sensors}.",
            _LAYOUT_GUIDE,
            folder=folder,
            sensors=", ".join(unknown),
        )
    if not known:
        raise ImportFolderError(
            "{folder}: no layout.toml names the sensors, and no SN1_gyr_x ...",
            _LAYOUT_GUIDE,
            folder=folder,
        )
    return glove("right" if file.side == "unknown" else file.side, known, file.hand_type)


class _LayoutFile(msgspec.Struct):
    """What layout.toml holds."""

    sensors: dict[str, str] = {}
    joints: tuple[JointPlace, ...] = ()
    side: str = "unknown"
    hand_type: HandType | None = None


def _parse_layout(file: _LayoutFile) -> Layout:
    sensors = tuple(SensorPlace(name, segment) for name, segment in file.sensors.items())
    return Layout(file.side, sensors, file.joints)


def _times(table: pa.Table, file: str) -> Array:
    time_us = np.round(_column(table, "time_s", file) * 1e6)
    if len(time_us) < 2:
        raise ImportFolderError(
            "{file}: {rows} rows; at least 2 are needed.", _GUIDE, file=file, rows=len(time_us)
        )
    _refuse_nan(time_us, "time_s", file)
    if np.abs(time_us).max() > _LATEST_US:
        raise ImportFolderError(
            "{file}: time_s reaches {largest:.3g}, which are no seconds.",
            "Write time_s in seconds.",
            file=file,
            largest=float(np.abs(time_us).max()) * 1e-6,
        )
    step = np.diff(time_us)
    if (step <= 0).any():
        row = int(np.argmax(step <= 0)) + 1
        before, after = time_us[row - 1] * 1e-6, time_us[row] * 1e-6
        raise ImportFolderError(
            "{file}, row {row}: time does not move on: {after:.6f} s after {before:.6f} s.",
            "Sort the rows by time_s and remove those that repeat one.",
            file=file,
            row=row + 1,
            after=float(after),
            before=float(before),
        )
    return time_us.astype(np.int64)


def _signal(table: pa.Table, layout: Layout, kind: str) -> Array:
    """One kind of signal of all sensors, (n, s, 3); NaN for magnetometers that are absent."""
    columns = []
    for sensor in layout.names:
        names = [f"{sensor}_{kind}_{axis}" for axis in _AXES]
        absent = [name for name in names if name not in table.column_names]
        if kind == "mag" and len(absent) == len(names):
            columns.append(np.full((len(table), 3), np.nan))
            continue
        if absent:
            raise ImportFolderError(
                "samples: no column {columns}.",
                "Add it, or take {sensor} out of layout.toml. docs/import.md shows what a folder "
                "must hold.",
                columns=", ".join(absent),
                sensor=sensor,
            )
        values = np.stack([_column(table, name, "samples") for name in names], axis=-1)
        if kind != "mag":  # a compass may be slower than the rest: NaN is no new reading
            for axis, name in enumerate(names):
                _refuse_nan(values[:, axis], name, "samples")
        columns.append(values)
    return np.stack(columns, axis=1)


def _typical_share(fresh: Array) -> float:
    """Share of instants with a fresh reading, of the sensors that have a magnetometer at all."""
    shares = fresh.mean(axis=0)
    return float(np.median(shares[shares > 0.0])) if shares.any() else 0.0


def _column(table: pa.Table, name: str, file: str) -> Array:
    if name not in table.column_names:
        raise ImportFolderError("{file}: no column {column}.", _GUIDE, file=file, column=name)
    try:
        return np.asarray(table[name].cast(pa.float64()).to_numpy(), dtype=np.float64)
    except pa.ArrowException as error:
        row, cell = _first_text(table[name])
        raise ImportFolderError(
            "{file}, row {row}, column {column}: {cell!r} is not a number.",
            "Write plain numbers with a decimal point.",
            file=file,
            row=row,
            column=name,
            cell=cell,
        ) from error


def _first_text(column: pa.ChunkedArray) -> tuple[int, str]:
    """Row and content of the first cell that is not a number; empty ones are missing numbers."""
    for row, cell in enumerate(column.to_pylist(), start=1):
        try:
            float(cell or "nan")
        except (TypeError, ValueError):
            return row, str(cell)
    return 1, str(column[0])


def _refuse_nan(values: Array, name: str, file: str) -> None:
    bad = ~np.isfinite(values)
    if bad.any():
        raise ImportFolderError(
            "{file}, row {row}, column {column}: not a number ({count} such cells in this column).",
            "Leave out the rows in which a sensor gave nothing: missing instants are a gap, and "
            "gaps are understood.",
            file=file,
            row=int(np.argmax(bad)) + 1,
            column=name,
            count=int(bad.sum()),
        )


def _labels(folder: Path, zero_s: float) -> tuple[Label, ...]:
    """Labels, counted from the first instant instead of the folder's own time 0."""
    table = _table(folder, "labels")
    if table is None:
        return ()
    starts = _column(table, "start_s", "labels")
    ends = _column(table, "end_s", "labels")
    if "label" not in table.column_names:
        raise ImportFolderError("labels: no column label.", _GUIDE)
    names = [str(name) for name in table["label"].to_pylist()]
    for row, (start, end) in enumerate(zip(starts, ends, strict=True), start=1):
        if not start < end:
            raise ImportFolderError(
                "labels, row {row}: ends at {end} s, not after its start at {start} s.",
                "Correct start_s and end_s.",
                row=row,
                end=float(end),
                start=float(start),
            )
    return tuple(
        Label(float(start) - zero_s, float(end) - zero_s, name)
        for start, end, name in zip(starts, ends, names, strict=True)
    )


def _reference(folder: Path, layout: Layout) -> Reference | None:
    table = _table(folder, "reference")
    if table is None:
        return None
    seen = [name for name in layout.names if f"{name}_qw" in table.column_names]
    if not seen:
        raise ImportFolderError("reference: no column such as SN15_qw of any sensor.", _GUIDE)
    orientations = [
        np.stack([_column(table, f"{name}_q{part}", "reference") for part in "wxyz"], axis=-1)
        for name in seen
    ]
    return Reference(_times(table, "reference"), tuple(seen), np.stack(orientations, axis=1))
