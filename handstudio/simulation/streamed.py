"""A tracker's terminal on a board of a virtual glove, told pose by pose while the wearer moves.

The terminal is taped to the board of a sensor, turned anyhow; the tracker stands anywhere and need
not be level. What it tells is noisy, late, now and then missing and bent by metal as `trackers` has
it. Where it sits and how it is turned is drawn from the seed, and whoever compares draws it again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.simulation.imperfections.noise import generator
from handstudio.simulation.moving import Moving
from handstudio.simulation.trackers import Metal, TrackerErrors, bent_by_metal

RATE_HZ = 60.0
LEVER_M = (0.010, 0.004, 0.008)
"""From the sensor to the terminal, in the sensor's axes."""

_PLAIN = TrackerErrors(noise_m=1e-3, noise_rad=float(np.deg2rad(0.15)), late_s=0.05)

STRENGTHS: Mapping[str, TrackerErrors] = {
    "plain": _PLAIN,
    "harsh": TrackerErrors(
        noise_m=2e-3,
        noise_rad=float(np.deg2rad(0.3)),
        late_s=0.08,
        lost=0.05,
        lost_for_s=0.3,
        metal=(Metal((0.4, 0.5, 0.1), 0.1),),
    ),
}
"""How bad a virtual tracker is, by name; the first as fair optical and magnetic ones are."""

_SEED, _NOISE = 62, 63  # which of a seed's streams
_KEPT_US = 1_000_000


@dataclass(frozen=True, slots=True)
class Standing:
    """How a virtual tracker stands in the world, and its terminal on the sensor."""

    q_room_world: Float[Array, "4"]
    t_room_world: Float[Array, "3"]
    q_sensor_terminal: Float[Array, "4"]


def standing_of(seed: int) -> Standing:
    """Where the tracker of a seed stands: half a metre away or so, turned anyhow."""
    rng = generator(seed, _SEED)
    room, mount = (so3.normalize(rng.standard_normal(4)) for _ in range(2))
    return Standing(room, rng.normal(0.0, 0.3, 3), mount)


@dataclass(frozen=True, slots=True)
class ToldPose:
    """One pose, in the room; NaN where the tracker sees nothing."""

    told_us: int
    t_room_terminal: tuple[float, ...]
    q_room_terminal: tuple[float, ...]


class Terminal:
    """A terminal on a sensor; told where that sensor is, it tells poses when they are due.

    Args:
        sensor: Index of the sensor.
        errors: Of the tracker.
        seed: Of where it stands and of its noise.
    """

    def __init__(self, sensor: int, errors: TrackerErrors, seed: int) -> None:
        self._sensor, self._errors = sensor, errors
        self._standing, self._rng = standing_of(seed), generator(seed, _NOISE)
        self._gone = False
        self._begin()

    def saw(self, time_us: Int64[Array, " n"], sensors: Moving) -> None:
        """Where all sensors were at the next instants; time that begins anew is a new motion."""
        if self._times and time_us[0] <= self._times[-1]:
            self._begin()
        k = self._sensor
        self._times.extend(time_us.tolist())
        self._states.extend(zip(sensors.t[:, k], sensors.v[:, k], sensors.q[:, k], strict=True))
        while self._times[-1] - self._times[0] > _KEPT_US:
            self._times.popleft()
            self._states.popleft()

    def due(self, until_us: int) -> list[ToldPose]:
        """The poses that were told until an instant, since the last call."""
        told = []
        late_us = round(1e6 * self._errors.late_s)
        while self._times and self._next_us <= self._times[-1]:
            at_us = self._next_us
            if at_us + late_us > until_us:
                break
            if at_us >= self._times[0]:
                told.append(self._told(at_us, at_us + late_us))
            self._count += 1
        return told

    @property
    def _next_us(self) -> int:
        return round(self._count * 1e6 / RATE_HZ)

    def _begin(self) -> None:
        self._times = deque[int]()
        self._states = deque[tuple[Array, Array, Array]]()
        self._count = 0

    def _told(self, at_us: int, told_us: int) -> ToldPose:
        t, q = self._true(at_us)
        errors, rng, standing = self._errors, self._rng, self._standing
        t = standing.t_room_world + so3.rotate(standing.q_room_world, t)
        q = so3.multiply(so3.multiply(standing.q_room_world, q), standing.q_sensor_terminal)
        if errors.metal:
            bent = bent_by_metal(t[None], q[None], errors.metal)
            t, q = bent[0][0], bent[1][0]
        t = t + errors.noise_m * rng.standard_normal(3)
        q = so3.multiply(q, so3.exp(errors.noise_rad * rng.standard_normal(3)))
        back = min(1.0, 1.0 / (RATE_HZ * errors.lost_for_s))
        away = back * errors.lost / (1.0 - errors.lost)
        self._gone = bool(rng.random() < (1.0 - back if self._gone else away))
        if self._gone:
            t, q = np.full(3, np.nan), np.full(4, np.nan)
        return ToldPose(told_us, tuple(t.tolist()), tuple(q.tolist()))

    def _true(self, at_us: int) -> tuple[Array, Array]:
        """Place and attitude of the terminal, between two instants of the glove (Hermite)."""
        after = next(k for k, us in enumerate(self._times) if us >= at_us)
        before = max(after - 1, 0)
        (t0, v0, q0), (t1, v1, q1) = self._states[before], self._states[after]
        h = max(self._times[after] - self._times[before], 1) * 1e-6
        s = (at_us - self._times[before]) * 1e-6 / h
        t = (1 + 2 * s) * (1 - s) ** 2 * t0 + s * (1 - s) ** 2 * h * v0
        t = t + s * s * (3 - 2 * s) * t1 + s * s * (s - 1) * h * v1
        q1 = -q1 if q0 @ q1 < 0.0 else q1
        q = so3.normalize((1.0 - s) * q0 + s * q1)
        return t + so3.rotate(q, np.array(LEVER_M)), q
