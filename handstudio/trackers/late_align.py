"""How a terminal sits on a sensor, where the room lies, and how late the tracker is.

From a stretch in which the sensor turned, about more than one axis: speeds of turning tell the
delay, and with it a clock of another origin; rotations over a while, as both saw them, tell how
the terminal is turned on the sensor; and both attitudes how the room lies in the world. Nothing is
assumed of the mounting: a terminal may sit upside down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.errors import CalibrationError
from handstudio.maths import so3
from handstudio.trackers.track import Track

_GRID_HZ = 100.0
_SPEED_S = 0.04  # speeds of turning are means of so long
_TURN_S = 0.25  # rotations that are compared
_LEAST_TURN = np.deg2rad(5.0)
_LEAST_SECOND = 0.15  # of the turning about the first axis: less tells no attitude
_SURE = 0.5  # correlation of speeds below which the two did not move together


@dataclass(frozen=True, slots=True)
class Alignment:
    """What a stretch told.

    Attributes:
        delay_s: When a pose is told after it was, on the sensor's clock [s]; negative where the
            tracker's clock is behind.
        q_sensor_terminal: How the terminal sits on the sensor.
        q_room_world: The world in the room.
        correlation: Of speeds of turning, 0 to 1: whether the two sit on the same thing.
        residual_rad: By how much attitudes differ afterwards, root mean square.
    """

    delay_s: float
    q_sensor_terminal: Float[Array, "4"]
    q_room_world: Float[Array, "4"]
    correlation: float
    residual_rad: float


def align(
    time_us: Int64[Array, " n"],
    q_world_sensor: Float[Array, "n 4"],
    track: Track,
    search_s: tuple[float, float] = (0.0, 0.5),
) -> Alignment:
    """Align a track with the sensor it sits beside.

    Args:
        time_us: Of the sensor's attitudes [µs], rising.
        q_world_sensor: The attitudes.
        track: Poses of the terminal, with attitudes.
        search_s: Shortest and longest delay; of another clock, whatever may be between.

    Raises:
        CalibrationError: too little of it was seen, it turned too little or about one axis only, or
            the two did not move together.
    """
    seen = np.isfinite(track.q_room_terminal).all(axis=-1)
    if seen.sum() < 50:
        raise CalibrationError(
            "The tracker tells only {count} attitudes of {name}.",
            "Record at least ten seconds in which the terminal is seen.",
            count=int(seen.sum()),
            name=track.name,
        )
    sensor_s, told_s = time_us * 1e-6, track.time_us[seen] * 1e-6
    q_told = track.q_room_terminal[seen]
    delay, correlation = _delay(sensor_s, q_world_sensor, told_s, q_told, search_s)
    if correlation < _SURE:
        raise CalibrationError(
            "The terminal {name} does not turn as the sensor does: correlation {found:.2f}.",
            "Name the segment it sits on, or another terminal; turn the hand about in the take.",
            name=track.name,
            found=correlation,
        )
    at = told_s - delay
    inside = (at >= sensor_s[0]) & (at <= sensor_s[-1])
    q_sensor, q_told, at = (
        attitude_at(sensor_s, q_world_sensor, at[inside]),
        q_told[inside],
        at[inside],
    )
    q_mount = _mount(at, q_sensor, q_told, track.name)
    q_each = so3.multiply(q_told, so3.conjugate(so3.multiply(q_sensor, q_mount)))
    q_room_world = _mean(q_each)
    off = so3.angle_between(q_each, q_room_world)
    return Alignment(
        delay, q_mount, q_room_world, correlation, float(np.sqrt(np.mean(np.square(off))))
    )


def attitude_at(
    time_s: Float[Array, " n"], q: Float[Array, "n 4"], at_s: Float[Array, " m"]
) -> Float[Array, "m 4"]:
    """Attitudes between samples, along the chord; clipped to the first and the last."""
    k = np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, len(time_s) - 2)
    share = np.clip((at_s - time_s[k]) / (time_s[k + 1] - time_s[k]), 0.0, 1.0)[:, None]
    a, b = q[k], q[k + 1]
    b = np.where(np.sum(a * b, axis=-1, keepdims=True) < 0.0, -b, b)
    return so3.normalize((1.0 - share) * a + share * b)


def _speed(time_s: Array, q: Array, at_s: Array) -> Array:
    half = 0.5 * _SPEED_S
    before, after = (attitude_at(time_s, q, at_s + d) for d in (-half, half))
    return np.asarray(so3.angle_between(before, after) / _SPEED_S)


def _delay(
    sensor_s: Array, q_sensor: Array, told_s: Array, q_told: Array, search_s: tuple[float, float]
) -> tuple[float, float]:
    """The shift at which speeds of turning agree best, and how well they do."""
    step = 1.0 / _GRID_HZ
    grid = np.arange(told_s[0], told_s[-1], step)
    # where poses are missing, the way between the two around them says nothing
    nearest = np.searchsorted(told_s, grid).clip(1, len(told_s) - 1)
    sound = told_s[nearest] - told_s[nearest - 1] < 3.0 * np.median(np.diff(told_s))
    grid = grid[sound]
    speed = _speed(told_s, q_told, grid)
    lags = np.arange(search_s[0], search_s[1] + 0.5 * step, step)
    fine = _speed_table(sensor_s, q_sensor, grid[0] - lags[-1], grid[-1] - lags[0])
    found = np.array([_agreement(fine, grid - lag, speed) for lag in lags])
    k = int(np.argmax(found))
    best = float(lags[k])
    if 0 < k < len(lags) - 1:  # the top of the parabola through three
        left, top, right = found[k - 1 : k + 2]
        bend = left - 2.0 * top + right
        best += float(0.5 * (left - right) / bend * step) if bend < 0.0 else 0.0
    return best, float(found[k])


def _speed_table(sensor_s: Array, q: Array, first: float, last: float) -> tuple[Array, Array]:
    at = np.arange(max(first, sensor_s[0]), min(last, sensor_s[-1]), 0.5 / _GRID_HZ)
    return at, _speed(sensor_s, q, at)


def _agreement(table: tuple[Array, Array], at_s: Array, speed: Array) -> float:
    at, sensor = table
    if len(at) < 2:
        return 0.0
    inside = (at_s >= at[0]) & (at_s <= at[-1])
    if inside.sum() < 100:
        return 0.0
    a, b = np.interp(at_s[inside], at, sensor), speed[inside]
    scatter = float(np.std(a) * np.std(b))
    return float(np.mean((a - a.mean()) * (b - b.mean())) / scatter) if scatter > 0.0 else 0.0


def _mount(at_s: Array, q_sensor: Array, q_terminal: Array, name: str) -> Array:
    """How the terminal sits: rotations of both over a while are about the same axes."""
    later = np.searchsorted(at_s, at_s + _TURN_S)
    first = np.flatnonzero(later < len(at_s))
    later = later[first]
    first, later = (
        first[at_s[later] - at_s[first] < 1.5 * _TURN_S],
        later[at_s[later] - at_s[first] < 1.5 * _TURN_S],
    )
    turns = [
        so3.log(so3.multiply(so3.conjugate(q[first]), q[later])) for q in (q_sensor, q_terminal)
    ]
    enough = np.linalg.norm(turns[0], axis=-1) > _LEAST_TURN
    a, b = turns[0][enough], turns[1][enough]
    u, size, vt = np.linalg.svd(a.T @ b if len(a) else np.zeros((3, 3)))
    if not size[1] > _LEAST_SECOND**2 * size[0] or len(a) < 20:
        raise CalibrationError(
            "The segment that {name} sits on turned too little, or about one axis only.",
            "Record some seconds in which it turns about several axes, 30 degrees and more.",
            name=name,
        )
    signs = np.array([1.0, 1.0, np.linalg.det(u @ vt)])
    return np.asarray(so3.from_matrix((u * signs) @ vt))


def _mean(q: Array) -> Array:
    """The attitude nearest to all, those far off left out in a second round."""
    for _ in range(3):
        _, vectors = np.linalg.eigh(np.einsum("ni,nj->ij", q, q))
        mean: Array = vectors[:, -1]
        off = so3.angle_between(q, mean)
        q = q[off <= 3.0 * max(float(np.median(off)), 1e-6)]
    return mean if mean[0] >= 0.0 else -mean
