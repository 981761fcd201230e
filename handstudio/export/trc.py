"""TRC: places of joints and fingertips in millimetres, five header lines, empty cells in gaps."""

from __future__ import annotations

import math
from typing import BinaryIO

import numpy as np

from handstudio.arrays import Array
from handstudio.export.frames import blocks, frames_of
from handstudio.export.part import Part
from handstudio.export.tables import POINTS, points_mm


def write(part: Part, file: BinaryIO) -> None:
    """Write every frame; one without an instant has its time and nothing else."""
    frames = frames_of(part)
    file.write(_header(frames.rate_hz, frames.first, frames.count).encode())
    for first, count, motion, rows in blocks(part, frames):
        time_s = np.round(np.arange(first, first + count) / frames.rate_hz, 6)
        time_s[rows] = part.seconds(motion)
        cells = np.full((count, 3 * len(POINTS)), "", dtype=object)
        cells[rows] = _cells(points_mm(part.pose(motion)))
        lines = [
            "\t".join([str(first + row + 1), f"{time_s[row]:.6f}", *cells[row]])
            for row in range(count)
        ]
        file.write(("\n".join(lines) + "\n").encode())


def _header(rate_hz: float, first: int, count: int) -> str:
    rate = f"{rate_hz:.10g}"
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
    values = [rate, rate, count, len(POINTS), "mm", rate, first + 1, count]
    axes = [f"{axis}{number}" for number in range(1, len(POINTS) + 1) for axis in "XYZ"]
    lines = [
        ["PathFileType", "4", "(X/Y/Z)", "handstudio.trc"],
        [*keys.split(), "OrigNumFrames"],
        [str(value) for value in values],
        ["Frame#", "Time", "\t\t\t".join(POINTS)],
        ["", "", *axes],
    ]
    return "\n".join("\t".join(line) for line in lines) + "\n"


def _cells(points: Array) -> Array:
    flat = points.reshape(len(points), -1)
    return np.array(
        [["" if math.isnan(value) else f"{value:.4f}" for value in row] for row in flat],
        dtype=object,
    ).reshape(flat.shape)
