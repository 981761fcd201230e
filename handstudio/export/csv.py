"""CSV: one header row with units in the names, ``time_s`` first, a sidecar JSON with the rest."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
import pyarrow as pa
import pyarrow.csv

from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.export.metadata import metadata
from handstudio.hand.skeleton import FINGERS, JOINTS
from handstudio.kinematics import angles_of, exported_angles, pose_of, relative_rotations
from handstudio.pipeline import Motion
from handstudio.recording.take import Take
from handstudio.setup import Setup

Content: TypeAlias = Literal["angles", "orientations", "positions"]

_BLOCK = 8192  # instants turned into text at a time: memory does not grow with the take


@dataclass(frozen=True, slots=True)
class Window:
    """The part to export, seconds from the take's first instant; None: to its end."""

    start_s: float = 0.0
    end_s: float | None = None


def export_csv(
    take: Take,
    setup: Setup,
    motion: Motion,
    target: Path,
    *,
    content: Content = "angles",
    window: Window | None = None,
) -> Path:
    """Write a CSV file and its sidecar (``NAME.csv.json``).

    Raises:
        TakeError: the file cannot be written.
        LayoutError: angles or positions of a take that has no hand.
    """
    part = cut(motion, window or Window())
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("wb") as file:
            write_csv(file, setup, part, content, start_us=int(motion.time_us[0]))
        sidecar = target.with_name(target.name + ".json")
        sidecar.write_bytes(metadata(take, setup, part, content))
    except OSError as error:
        raise TakeError(
            f"{target}: cannot be written ({error.strerror or error}).",
            "Choose another folder, or close the program that has the file open.",
        ) from error
    return target


def csv_bytes(setup: Setup, motion: Motion, content: Content, window: Window) -> bytes:
    """The same file in memory, for a browser's download."""
    buffer = BytesIO()
    write_csv(buffer, setup, cut(motion, window), content, start_us=int(motion.time_us[0]))
    return buffer.getvalue()


def cut(motion: Motion, window: Window) -> Motion:
    """The instants of a window, both ends included.

    Raises:
        TakeError: the motion or the window holds no instant.
    """
    if len(motion) == 0:
        raise TakeError("The take holds no instant of motion.", "Record it again.")
    time_s = (motion.time_us - motion.time_us[0]) * 1e-6
    end_s = time_s[-1] if window.end_s is None else window.end_s
    first = int(np.searchsorted(time_s, window.start_s, side="left"))
    last = int(np.searchsorted(time_s, end_s, side="right"))
    if first >= last:
        raise TakeError(
            f"Nothing lies between {window.start_s:.2f} s and {end_s:.2f} s.",
            f"Choose a window within 0 and {time_s[-1]:.2f} s.",
        )
    return motion[first:last]


def write_csv(
    file: BytesIO | object, setup: Setup, motion: Motion, content: Content, start_us: int
) -> None:
    """Write the rows of a motion; times count from ``start_us``."""
    options = pa.csv.WriteOptions(include_header=True, quoting_style="none")
    names = _names(setup, motion, content)
    schema = pa.schema([(name, pa.float64()) for name in names])
    with pa.csv.CSVWriter(file, schema, write_options=options) as writer:
        for at in range(0, len(motion), _BLOCK):
            part = motion[at : at + _BLOCK]
            columns = _columns(setup, part, content, exported_of=motion)
            time_s = np.round((part.time_us - start_us) * 1e-6, 6)
            doubtful = (part.doubt != 0).sum(axis=1).astype(float)
            arrays = [pa.array(c) for c in (time_s, *columns.T, doubtful)]
            writer.write_table(pa.table(arrays, schema=schema))


def _names(setup: Setup, motion: Motion, content: Content) -> list[str]:
    match content:
        case "angles":
            if not setup.layout.is_hand:
                raise_no_hand(setup)
            middle = [f"{angle.name}_deg" for angle in exported_angles(setup, motion)]
        case "positions":
            if not setup.layout.is_hand:
                raise_no_hand(setup)
            points = [joint.name for joint in JOINTS] + [f"{finger}_tip" for finger in FINGERS]
            middle = [f"{point}_{axis}_mm" for point in points for axis in "xyz"]
        case "orientations":
            relative = relative_rotations(setup.layout, motion.q_world_sensor[:0])
            things = [*setup.layout.names, *relative]
            middle = [f"{thing}_q{part}" for thing in things for part in "wxyz"]
    return ["time_s", *middle, "doubtful_sensors"]


def _columns(setup: Setup, motion: Motion, content: Content, exported_of: Motion) -> Array:
    """Values as written: degrees to 1e-4, quaternions to 1e-7, millimetres to 1e-3."""
    match content:
        case "angles":
            angles = exported_angles(setup, exported_of)
            return np.round(np.rad2deg(angles_of(setup, motion, angles)), 4) + 0.0
        case "positions":
            pose = pose_of(setup, motion.q_world_sensor)
            points = np.concatenate([pose.t_world_joint, pose.t_world_tip], axis=1)
            return np.round(points.reshape(len(motion), -1) * 1e3, 3) + 0.0
        case "orientations":
            relative = relative_rotations(setup.layout, motion.q_world_sensor)
            across = [q[:, None] for q in relative.values()]
            every = np.concatenate([motion.q_world_sensor, *across], axis=1)
            return np.round(every.reshape(len(motion), -1), 7) + 0.0


def raise_no_hand(setup: Setup) -> None:
    """Say why there are no angles and what to export instead."""
    raise TakeError(
        f"This take has no joint angles. {setup.layout.missing_for_hand}",
        "Export orientations instead: they hold every sensor and the rotation across each joint.",
    )
