"""Columns of numbers, of a file or a stream, as tracks.

For each terminal NAME its place, ``NAME_x_m, NAME_y_m, NAME_z_m`` (or ``_cm`` or ``_mm``), and its
attitude, terminal to tracker: ``NAME_qw, NAME_qx, NAME_qy, NAME_qz``, or azimuth, elevation and
roll about z, y and x in this order, as Polhemus means them: ``NAME_azimuth_deg, NAME_elevation_deg,
NAME_roll_deg``. ``NAME_quality``, 0 to 1, may be there. NaN: not seen.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Int64

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.track import Track

_GUIDE = "docs/trackers.md shows the columns."

_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
_PLACES = [f"_x_{unit}" for unit in _METRES]


def tracks_of(
    where: object,
    table: Mapping[str, Array],
    time_us: Int64[Array, " n"],
    *,
    refuse: bool = True,
) -> tuple[Track, ...]:
    """All terminals of some columns.

    Args:
        where: What an error names: the file or stream.
        table: Columns by name.
        time_us: Instants of their rows.
        refuse: What is no quaternion; else nothing was seen there, as in a stream that goes on.

    Raises:
        TrackError: there is no terminal in them, or one lacks columns.
    """
    names = [
        column.removesuffix(suffix)
        for column in table
        for suffix in _PLACES
        if column.endswith(suffix)
    ]
    if not names:
        raise TrackError(
            "{where}: no column such as NAME_x_mm, so it has no terminal.", _GUIDE, where=where
        )
    return tuple(_terminal(where, table, name, time_us, refuse) for name in names)


def _terminal(
    where: object, table: Mapping[str, Array], name: str, time_us: Array, refuse: bool
) -> Track:
    unit = next(unit for unit in _METRES if f"{name}_x_{unit}" in table)
    t = _METRES[unit] * _columns(where, table, [f"{name}_{axis}_{unit}" for axis in "xyz"])
    if f"{name}_azimuth_deg" in table:
        turns = ("azimuth", "elevation", "roll")
        angles = np.deg2rad(_columns(where, table, [f"{name}_{turn}_deg" for turn in turns]))
        q = _from_angles(angles)
    else:
        q = _columns(where, table, [f"{name}_q{part}" for part in "wxyz"])
        length = np.linalg.norm(q, axis=1)
        wrong = np.abs(length - 1.0) > 0.05
        if wrong.any() and refuse:
            row = int(np.argmax(wrong))
            raise TrackError(
                "{where}, row {row}: the quaternion of {name} has a length of {length:.3f}.",
                "Unit quaternions are expected, scalar first.",
                where=where,
                row=row + 2,
                name=name,
                length=float(length[row]),
            )
        q = q / np.where(wrong, np.nan, length)[:, None]
    seen = np.isfinite(t).all(axis=1) & np.isfinite(q).all(axis=1)
    quality = table.get(f"{name}_quality", np.ones(len(t)))
    quality = np.where(seen, np.clip(np.nan_to_num(quality), 0.0, 1.0), 0.0)
    gone = quality == 0.0
    t[gone], q[gone] = np.nan, np.nan
    return Track(name, time_us, t, q, quality)


def _columns(where: object, table: Mapping[str, Array], names: list[str]) -> Array:
    missing = [name for name in names if name not in table]
    if missing:
        raise TrackError(
            "{where}: the column {name} is missing or holds no numbers.",
            _GUIDE,
            where=where,
            name=missing[0],
        )
    return np.stack([table[name] for name in names], axis=1)


def _from_angles(angles: Array) -> Array:
    z, y, x = np.eye(3)[::-1]
    turns = [
        so3.from_axis_angle(axis, angle) for axis, angle in zip((z, y, x), angles.T, strict=True)
    ]
    return so3.multiply(so3.multiply(turns[0], turns[1]), turns[2])
