"""Turning a folder of foreign recordings into a take (the format: docs/import.md)."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from handstudio.arrays import Array
from handstudio.errors import ImportFolderError, LayoutError
from handstudio.layout import JointPlace, Layout, SensorPlace, glove
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
_GUIDE = "docs/import.md shows what a folder must hold."


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
        for start in range(0, len(content.samples), BLOCK):
            writer.write_samples(content.samples[start : start + BLOCK], start_ns)
        time_us = content.samples.time_us
        writer.close(Summary(writer.chunks, writer.bytes, float(time_us[-1] - time_us[0]) * 1e-6))
    finally:
        writer.abandon()
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
        raise ImportFolderError(f"{folder}: there is no such folder.", "Check the path.")
    table = _table(folder, "samples")
    if table is None:
        raise ImportFolderError(f"{folder}: no samples.csv and no samples.parquet in it.", _GUIDE)
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
        _labels(folder),
        _reference(folder, layout),
    )


def _table(folder: Path, stem: str) -> pa.Table | None:
    parquet, csv = folder / f"{stem}.parquet", folder / f"{stem}.csv"
    try:
        if parquet.exists():
            return pa.parquet.read_table(parquet)
        if csv.exists():
            return pa.csv.read_csv(csv)
    except (pa.ArrowException, OSError) as error:
        raise ImportFolderError(
            f"{folder / stem}: cannot be read as a table ({error}).",
            "It needs one header row, commas, and a number in every cell. " + _GUIDE,
        ) from error
    return None


def _layout(folder: Path, table: pa.Table) -> Layout:
    path = folder / "layout.toml"
    if not path.exists():
        named = {name.split("_")[0] for name in table.column_names if "_gyr_" in name}
        known = [name for name in glove().names if name in named]
        if not known:
            raise ImportFolderError(
                f"{folder}: samples name no sensor of the glove (SN1_gyr_x ...) and there is no "
                "layout.toml.",
                "Add a layout.toml that names the sensors. " + _GUIDE,
            )
        return glove("right", known)
    try:
        return _parse_layout(tomllib.loads(path.read_text(encoding="utf-8")))
    except (tomllib.TOMLDecodeError, msgspec.ValidationError, KeyError, AttributeError) as error:
        raise ImportFolderError(f"{path}: not a layout ({error!r}).", _GUIDE) from error
    except LayoutError as error:
        raise ImportFolderError(f"{path}: {error.what}", error.remedy) from error


def _parse_layout(document: dict[str, Any]) -> Layout:
    sensors = tuple(SensorPlace(name, segment) for name, segment in document["sensors"].items())
    joints = msgspec.convert(document.get("joints", []), tuple[JointPlace, ...])
    return Layout(document.get("side", "unknown"), sensors, joints)


def _times(table: pa.Table, file: str) -> Array:
    time_us = np.round(_column(table, "time_s", file) * 1e6)
    if len(time_us) < 2:
        raise ImportFolderError(f"{file}: {len(time_us)} rows; at least 2 are needed.", _GUIDE)
    _refuse_nan(time_us, "time_s", file)
    step = np.diff(time_us)
    if (step <= 0).any():
        row = int(np.argmax(step <= 0)) + 1
        before, after = time_us[row - 1] * 1e-6, time_us[row] * 1e-6
        raise ImportFolderError(
            f"{file}, row {row + 1}: time does not move on: {after:.6f} s after {before:.6f} s.",
            "Sort the rows by time_s and remove those that repeat one.",
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
                f"samples: no column {', '.join(absent)}.",
                f"Add it, or take {sensor} out of layout.toml. " + _GUIDE,
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
        raise ImportFolderError(f"{file}: no column {name}.", _GUIDE)
    try:
        return np.asarray(table[name].cast(pa.float64()).to_numpy(), dtype=np.float64)
    except pa.ArrowInvalid as error:
        raise ImportFolderError(
            f"{file}, column {name}: not all cells are numbers ({error}).",
            "Write plain numbers with a decimal point.",
        ) from error


def _refuse_nan(values: Array, name: str, file: str) -> None:
    bad = ~np.isfinite(values)
    if bad.any():
        raise ImportFolderError(
            f"{file}, row {int(np.argmax(bad)) + 1}, column {name}: not a number "
            f"({int(bad.sum())} such cells in this column).",
            "Leave out the rows in which a sensor gave nothing: missing instants are a gap, and "
            "gaps are understood.",
        )


def _labels(folder: Path) -> tuple[Label, ...]:
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
                f"labels, row {row}: ends at {end} s, not after its start at {start} s.",
                "Correct start_s and end_s.",
            )
    return tuple(
        Label(float(a), float(b), name) for a, b, name in zip(starts, ends, names, strict=True)
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
