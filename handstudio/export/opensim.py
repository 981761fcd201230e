"""OpenSim's tables: joint angles (``.mot``), and what sensors show to OpenSense (``.sto``).

Both have a header of lines ``key=value`` that ends in ``endheader``, then tabs. Instants that are
missing have no row: OpenSim takes times that are not even.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, BinaryIO

import msgspec
import numpy as np

from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.export.part import Part
from handstudio.export.tables import Table, table_of
from handstudio.hand.angles import ROOT_ANGLES
from handstudio.layout import Layout

TO_OPENSIM = "sensor_to_opensim_rotations: -1.5708 0 0"
"""What OpenSense is told of a world with z up; its own has y up."""


def write_mot(part: Part, file: BinaryIO) -> None:
    """Joint angles in degrees, each column called as its angle.

    An instant at which one is not known has no row: what reads motions in OpenSim's window stops at
    a NaN.
    """
    table = table_of(part)
    names = [name.removesuffix("_deg") for name in table.names]
    count = int(known(part).sum())
    if count == 0:
        raise TakeError(
            "Not all of these angles are known at any instant.", "Choose fewer, or a longer window."
        )
    head = ["version=1", f"nRows={count}", f"nColumns={len(names) + 1}", "inDegrees=yes"]
    _begin(part, file, head, names)
    for times, block in _rows(part, table):
        there = np.isfinite(block).all(axis=1)
        cells = [[f"{value:.4f}" for value in row] for row in block[there]]
        _add(file, times[there], cells)


def known(part: Part) -> Array:
    """Whether all wanted angles are known at an instant: those from the start are not before it."""
    if not {angle.name for angle in part.angles} & set(ROOT_ANGLES):
        return np.ones(len(part.motion), dtype=bool)
    finite: Array = np.isfinite(part.motion.q_world_start[:, 0])
    return finite


def left_out(part: Part) -> dict[str, Any]:
    """What the file tells of instants without a row."""
    missing = int((~known(part)).sum())
    return {"instants_without_all_angles_left_out": missing} if missing else {}


def write_sto(part: Part, file: BinaryIO) -> None:
    """Attitudes of the sensors in the world, z up: ``w,x,y,z`` a cell."""
    names = imu_names(part.setup.layout)
    head = [
        f"DataRate={part.about['measured_rate_hz'] or part.setup.rate_hz:f}",
        "DataType=Quaternion",
        "version=3",
        "OpenSimVersion=4.5",
    ]
    _begin(part, file, head, names)
    table = Table(names, lambda motion: motion.q_world_sensor, 9)
    for times, block in _rows(part, table):
        cells = [[",".join(f"{v:.9f}" for v in q) for q in row] for row in block]
        _add(file, times, cells)


def imu_names(layout: Layout) -> list[str]:
    """Columns as OpenSense looks for them, ``SEGMENT_imu``; a second sensor adds its own name."""
    drivers = layout.drivers
    return [
        _cell(
            f"{place.segment}_imu"
            if drivers[place.segment] == index
            else f"{place.segment}_{place.sensor}_imu"
        )
        for index, place in enumerate(layout.sensors)
    ]


def _begin(part: Part, file: BinaryIO, head: list[str], names: list[str]) -> None:
    about = [f"handstudio_{key}={_cell(_told(value))}" for key, value in part.about.items()]
    title = _cell(f"{part.about['take']} by {part.about['software']}")
    lines = [title, *head, *about, "endheader", "\t".join(["time", *names])]
    file.write(("\n".join(lines) + "\n").encode())


def _rows(part: Part, table: Table) -> Iterator[tuple[Array, Array]]:
    for block in part.blocks():
        yield part.seconds(block), table.rounded(block)


def _add(file: BinaryIO, times: Array, cells: list[list[str]]) -> None:
    lines = ["\t".join([f"{at:.6f}", *row]) for at, row in zip(times, cells, strict=True)]
    file.write("".join(f"{line}\n" for line in lines).encode())


def _told(value: object) -> str:
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()


def _cell(text: str) -> str:
    """On one line, in one column."""
    return " ".join(text.split())
