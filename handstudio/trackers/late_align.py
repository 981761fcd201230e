"""How a terminal sits on a sensor, where the room lies, and how late the tracker is.

From a stretch in which the sensor turned, about more than one axis: speeds of turning tell the
delay, and with it a clock of another origin; rotations over a while, as both saw them, tell how
the terminal is turned on the sensor; and both attitudes how the room lies in the world. Nothing is
assumed of the mounting: a terminal may sit upside down.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

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
_LEAST_SECOND = 0.03  # [rad] of these about a second axis, rms: noise of a tracker is a tenth
_SURE = 0.5  # correlation of speeds below which the two did not move together
_LEAST_OVERLAP = 300  # steps of the grid


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
        second_rad: By how much it turned about a second axis within a quarter of a second, root
            mean square: the less, the worse the mounting is known.
    """

    delay_s: float
    q_sensor_terminal: Float[Array, "4"]
    q_room_world: Float[Array, "4"]
    correlation: float
    residual_rad: float
    second_rad: float = 1.0

    @property
    def doubt(self) -> float:
        """What an alignment by another stretch is compared by: the less, the better it is known."""
        return self.residual_rad / self.second_rad


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
    if seen.sum() < 50 or len(time_us) < 50:
        raise CalibrationError(
            "Tracker and sensor tell only {count} attitudes of {name}.",
            "Record at least ten seconds in which the terminal is seen and the sensor was at rest "
            "before.",
            count=min(int(seen.sum()), len(time_us)),
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
    sensor, told = (sensor_s, q_world_sensor), (told_s, q_told)
    q_mount, _ = _mount(sensor, told, delay, track.name)
    delay = _refined(sensor, told, delay, q_mount)
    q_mount, second = _mount(sensor, told, delay, track.name)
    inside = _inside(sensor_s, told_s - delay)
    q_sensor = attitude_at(sensor_s, q_world_sensor, told_s[inside] - delay)
    q_told = q_told[inside]
    q_each = so3.multiply(q_told, so3.conjugate(so3.multiply(q_sensor, q_mount)))
    q_room_world = _mean(q_each)
    off = so3.angle_between(q_each, q_room_world)
    return Alignment(
        delay, q_mount, q_room_world, correlation, float(np.sqrt(np.mean(np.square(off)))), second
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
    sensor, told = _even_speeds(sensor_s, q_sensor), _even_speeds(told_s, q_told)
    agreement = _agreement(sensor[1:], told[1:])
    # the k-th says how well the sensor agrees with what was told so many steps later than at -n + 1
    lags = told[0] - sensor[0] + step * (np.arange(len(agreement)) - (len(sensor[1]) - 1))
    agreement[(lags < search_s[0] - 0.5 * step) | (lags > search_s[1] + 0.5 * step)] = -1.0
    k = int(np.argmax(agreement))
    best = float(lags[k])
    if 0 < k < len(lags) - 1 and min(agreement[k - 1], agreement[k + 1]) > -1.0:
        left, top, right = agreement[k - 1 : k + 2]  # the top of the parabola through three
        bend = left - 2.0 * top + right
        best += float(0.5 * (left - right) / bend * step) if bend < 0.0 else 0.0
    return best, float(max(agreement[k], 0.0))


def _even_speeds(time_s: Array, q: Array) -> tuple[float, Array, Array]:
    """Speeds of turning at even steps: the first instant, the speeds, and where they are known."""
    grid = np.arange(time_s[0], time_s[-1], 1.0 / _GRID_HZ)
    # where samples are missing, the way between the two around them says nothing
    after = np.searchsorted(time_s, grid).clip(1, len(time_s) - 1)
    known = time_s[after] - time_s[after - 1] < 3.0 * np.median(np.diff(time_s))
    return float(grid[0]), np.where(known, _speed(time_s, q, grid), 0.0), known.astype(float)


def _agreement(sensor: tuple[Array, Array], told: tuple[Array, Array]) -> Array:
    """Correlation of speeds at every shift, over what both know; 0 where that is too little."""
    (a, knows_a), (b, knows_b) = sensor, told
    size = len(a) + len(b) - 1
    room = 1 << (size - 1).bit_length()

    def against(x: Array, y: Array) -> Array:
        both = np.fft.rfft(y, room) * np.fft.rfft(x[::-1], room)
        return np.asarray(np.fft.irfft(both, room)[:size])

    count = np.maximum(np.rint(against(knows_a, knows_b)), 1.0)
    mean_a, mean_b = against(a, knows_b) / count, against(knows_a, b) / count
    covariance = against(a, b) / count - mean_a * mean_b
    spread_a = against(a * a, knows_b) / count - mean_a**2
    spread_b = against(knows_a, b * b) / count - mean_b**2
    sound = (count >= _LEAST_OVERLAP) & (spread_a > 1e-6) & (spread_b > 1e-6)
    scatter = np.sqrt(np.where(sound, spread_a * spread_b, 1.0))
    return np.where(sound, covariance / scatter, 0.0)


_Attitudes: TypeAlias = tuple[Array, Array]
"""Instants [s] and attitudes at them."""


def _inside(time_s: Array, at_s: Array) -> Array:
    return np.asarray((at_s >= time_s[0]) & (at_s <= time_s[-1]))


def _turns(sensor: _Attitudes, told: _Attitudes, delay: float) -> tuple[Array, Array, Array]:
    """Rotations over a while, as terminal and sensor saw them, and from which pose on."""
    told_s, q_told = told
    later = np.searchsorted(told_s, told_s + _TURN_S)
    first = np.flatnonzero(later < len(told_s))
    later = later[first]
    usual = (told_s[later] - told_s[first] < 1.5 * _TURN_S) & _inside(
        sensor[0], told_s[first] - delay
    )
    usual &= _inside(sensor[0], told_s[later] - delay)
    first, later = first[usual], later[usual]
    by_sensor = [attitude_at(*sensor, told_s[which] - delay) for which in (first, later)]
    pairs = (q_told[first], q_told[later]), by_sensor
    seen, felt = (so3.log(so3.multiply(so3.conjugate(a), b)) for a, b in pairs)
    return seen, felt, first


def _mount(sensor: _Attitudes, told: _Attitudes, delay: float, name: str) -> tuple[Array, float]:
    """How the terminal sits: rotations of both over a while are about the same axes.

    And by how much it turned about a second one.
    """
    seen, felt, _ = _turns(sensor, told, delay)
    enough = np.linalg.norm(felt, axis=-1) > _LEAST_TURN
    a, b = felt[enough], seen[enough]
    u, size, vt = np.linalg.svd(a.T @ b if len(a) else np.zeros((3, 3)))
    if len(a) < 20 or not size[1] > len(a) * _LEAST_SECOND**2:
        raise CalibrationError(
            "The segment that {name} sits on turned too little, or about one axis only.",
            "Record some seconds in which it turns about several axes, 30 degrees and more.",
            name=name,
        )
    signs = np.array([1.0, 1.0, np.linalg.det(u @ vt)])
    return np.asarray(so3.from_matrix((u * signs) @ vt)), float(np.sqrt(size[1] / len(a)))


def _refined(sensor: _Attitudes, told: _Attitudes, delay: float, q_mount: Array) -> float:
    """The delay at which rotations agree as vectors: steps of Gauss and Newton.

    Speeds alone are drawn aside where a filter turns an attitude right while little moves: their
    differences count less the larger they are (weights of Cauchy).
    """
    h = 0.5 / _GRID_HZ
    for _ in range(5):
        seen, felt, first = _turns(sensor, told, delay)
        off = so3.rotate(q_mount, seen) - felt
        sides = [_turns(sensor, told, delay + d) for d in (h, -h)]
        both = np.intersect1d(np.intersect1d(first, sides[0][2]), sides[1][2])
        up, down = (felt_there[np.isin(at, both)] for _, felt_there, at in sides)
        slope, off = (up - down) / (2.0 * h), off[np.isin(first, both)]
        square = np.sum(off * off, axis=-1, keepdims=True)
        weight = 1.0 / (1.0 + square / (4.0 * max(float(np.median(square)), 1e-12)))
        power = float(np.sum(weight * slope * slope))
        if not power > 0.0:
            break
        delay += float(np.clip(np.sum(weight * slope * off) / power, -0.02, 0.02))
    return delay


def _mean(q: Array) -> Array:
    """The attitude nearest to all, those far off left out in a second round."""
    for _ in range(3):
        _, vectors = np.linalg.eigh(np.einsum("ni,nj->ij", q, q))
        mean: Array = vectors[:, -1]
        off = so3.angle_between(q, mean)
        q = q[off <= 3.0 * max(float(np.median(off)), 1e-6)]
    return mean if mean[0] >= 0.0 else -mean
