"""Files of markers: names, times [s] and places [m], NaN where unseen.

Whatever does not fit raises ValueError or IndexError; `tracks` says which file it was.
"""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

import numpy as np

from handstudio.arrays import Array
from handstudio.errors import TrackError

Markers: TypeAlias = tuple[list[str], Array, Array]

_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


def read_trc(path: Path) -> Markers:
    """OpenSim's and Motion Analysis' TRC: five header lines, empty cells where unseen."""
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    keys, values = lines[1].split("\t"), lines[2].split("\t")
    unit = dict(zip(keys, values, strict=False)).get("Units", "mm").strip()
    names = [cell.strip() for cell in lines[3].split("\t")[2:] if cell.strip()]
    width = 2 + 3 * len(names)
    rows = [_numbers(line, width) for line in lines[5:] if line.strip()]
    table = np.array(rows).reshape(-1, width)
    return names, table[:, 1], _unit(unit) * table[:, 2:].reshape(len(table), -1, 3)


def read_tsv(path: Path) -> Markers:
    """Qualisys' TSV: a header of keys, then a row of columns; empty cells or zeros where unseen."""
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    header = {}
    for row, line in enumerate(lines):
        key, *rest = line.split("\t")
        header[key] = rest
        if key in ("TRAJECTORY_TYPES", "MARKER_NAMES"):
            start = row + 1
    names = [name for name in header["MARKER_NAMES"] if name]
    rate = float(header["FREQUENCY"][0])
    timed = lines[start].startswith("Frame\t")
    start, before = (start + 1, 2) if timed else (start, 0)
    width = before + 3 * len(names)
    table = np.array([_numbers(line, width) for line in lines[start:] if line.strip()])
    table = table.reshape(-1, width)
    time_s = table[:, 1] if timed else np.arange(len(table)) / rate
    places = 1e-3 * table[:, before:].reshape(len(table), -1, 3)
    # this format has no other way to say so
    places[(places == 0.0).all(axis=2)] = np.nan
    return names, time_s, places


def read_c3d(path: Path) -> Markers:
    """C3D's points, by ezc3d."""
    try:
        import ezc3d  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise TrackError(
            "{path}: what reads C3D is not installed.",
            "Install it: pip install 'handstudio[trackers]'. Or export the markers as TRC.",
            path=path,
        ) from error
    file = ezc3d.c3d(str(path))
    point = file["parameters"]["POINT"]
    names = [str(name).strip() for name in point["LABELS"]["value"]]
    rate = float(point["RATE"]["value"][0])
    unit = str(point["UNITS"]["value"][0]).strip() if point["UNITS"]["value"] else "mm"
    data = np.asarray(file["data"]["points"][:3], dtype=float)
    residual = np.asarray(file["data"]["meta_points"]["residuals"], dtype=float)[0]
    places = _unit(unit) * np.moveaxis(data, 0, -1).swapaxes(0, 1)[:, : len(names)]
    places[residual.T[:, : len(names)] < 0.0] = np.nan
    first = int(file["header"]["points"]["first_frame"])
    return names, (first + np.arange(len(places))) / rate, places


def _numbers(line: str, width: int) -> list[float]:
    cells = [float(cell) if cell.strip() else np.nan for cell in line.split("\t")]
    # trailing empty cells are left out by some, and a last tab is added by others
    return (cells + [np.nan] * width)[:width]


def _unit(name: str) -> float:
    if name not in _UNITS:
        raise ValueError(f"places in {name!r}; m, cm or mm is expected")
    return _UNITS[name]
