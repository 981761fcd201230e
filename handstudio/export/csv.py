"""CSV: one header row with units in the names, ``time_s`` first, a sidecar JSON with the rest."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Literal, TypeAlias

import numpy as np

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
    """Write a CSV file and its sidecar (``NAME.csv.json``), both whole or not at all.

    Raises:
        TakeError: the window is empty, the take has no hand to give angles or positions of, or
            the file cannot be written.
    """
    part = cut(motion, window or Window())
    table = _table(setup, part, content)
    unfinished = target.with_name(target.name + ".part")
    sidecar = target.with_name(target.name + ".json")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with unfinished.open("wb") as file:
            _write(file, table, part, start_us=int(motion.time_us[0]))
        sidecar.write_bytes(metadata(take, setup, part, content))
        unfinished.replace(target)
    except OSError as error:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise TakeError(
            "{path}: cannot be written ({reason}).",
            "Choose another folder, or close the program that has the file open.",
            path=target,
            reason=error.strerror or error,
        ) from error
    return target


def cut(motion: Motion, window: Window) -> Motion:
    """The instants of a window, both ends included.

    Raises:
        TakeError: the motion or the window holds no instant.
    """
    if len(motion) == 0:
        raise TakeError("The take holds no instant of motion.", "Record it again.")
    # whole microseconds: 0.1 s is an instant, 100000 times 1e-6 a little less
    time_us = motion.time_us - motion.time_us[0]
    whole_s = float(time_us[-1]) * 1e-6
    end_s = whole_s if window.end_s is None else window.end_s
    first = int(np.searchsorted(time_us, round(window.start_s * 1e6), side="left"))
    last = int(np.searchsorted(time_us, round(end_s * 1e6), side="right"))
    if first >= last:
        raise TakeError(
            "Nothing lies between {start:.2f} s and {end:.2f} s.",
            "Choose a window within 0 and {whole:.2f} s.",
            start=window.start_s,
            end=end_s,
            whole=whole_s,
        )
    return motion[first:last]


@dataclass(frozen=True, slots=True)
class _Table:
    """The columns between time and doubt: their names, and their values in any part of a motion."""

    names: list[str]
    values: Callable[[Motion], Array]


def _write(file: BinaryIO, table: _Table, motion: Motion, start_us: int) -> None:
    import pyarrow as pa  # noqa: PLC0415 - takes a while to load
    import pyarrow.csv  # noqa: PLC0415

    options = pa.csv.WriteOptions(include_header=True, quoting_style="none")
    names = ["time_s", *table.names, "doubtful_sensors"]
    schema = pa.schema([(name, pa.float64()) for name in names])
    with pa.csv.CSVWriter(file, schema, write_options=options) as writer:
        for at in range(0, len(motion), _BLOCK):
            part = motion[at : at + _BLOCK]
            columns = table.values(part)
            time_s = np.round((part.time_us - start_us) * 1e-6, 6)
            doubtful = (part.doubt != 0).sum(axis=1).astype(float)
            arrays = [pa.array(c) for c in (time_s, *columns.T, doubtful)]
            writer.write_table(pa.table(arrays, schema=schema))


def _table(setup: Setup, motion: Motion, content: Content) -> _Table:
    match content:
        case "orientations":
            return _orientations(setup)
        case _ if not setup.layout.is_hand:
            raise TakeError(
                "This take has no joint angles. {why}",
                "Export orientations instead: they hold every sensor and the rotation across "
                "each joint.",
                why=setup.layout.no_hand,
            )
        case "angles":
            return _angles(setup, motion)
        case "positions":
            return _positions(setup)


def _angles(setup: Setup, motion: Motion) -> _Table:
    """Degrees, to 1e-4."""
    angles = exported_angles(setup, motion)
    return _Table(
        [f"{angle.name}_deg" for angle in angles],
        lambda part: _rounded(np.rad2deg(angles_of(setup, part, angles)), 4),
    )


def _positions(setup: Setup) -> _Table:
    """Joints, then fingertips: millimetres, to 1e-3."""

    def values(part: Motion) -> Array:
        pose = pose_of(setup, part.q_world_sensor)
        points = np.concatenate([pose.t_world_joint, pose.t_world_tip], axis=1)
        return _rounded(points.reshape(len(part), -1) * 1e3, 3)

    points = [joint.name for joint in JOINTS] + [f"{finger}_tip" for finger in FINGERS]
    return _Table([f"{point}_{axis}_mm" for point in points for axis in "xyz"], values)


def _orientations(setup: Setup) -> _Table:
    """Sensors in the world, then children in their parents across joints: quaternions, to 1e-7."""

    def values(part: Motion) -> Array:
        relative = relative_rotations(setup.layout, part.q_world_sensor)
        across = [q[:, None] for q in relative.values()]
        every = np.concatenate([part.q_world_sensor, *across], axis=1)
        return _rounded(every.reshape(len(part), -1), 7)

    things = [*setup.layout.names, *(joint.name for joint in setup.layout.instrumented_joints)]
    return _Table([f"{thing}_q{part}" for thing in things for part in "wxyz"], values)


def _rounded(values: Array, digits: int) -> Array:
    rounded: Array = np.round(values, digits) + 0.0  # no minus before a zero
    return rounded
