"""How a sensor of known attitude moves, since any instant it remembers, for a fixed cost.

Kept for every sample are the first and second integrals of the specific force, turned to the world,
and those of the turning matrix itself: what an accelerometer's bias adds to both. Differences of
them lead from any remembered instant to any other (as `late_turns` does for attitude).
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.trackers import late_small as small
from handstudio.trackers.late_small import Quaternion

_KEEP_S = 1.0


@dataclass(slots=True)
class Path:
    """What is remembered, oldest first; arrays are never written in place.

    Attributes:
        at_s: Instants [s].
        q: Attitude, ``q_world_sensor``.
        force: ``R_world_sensor`` beside the specific force in the world [m/s²]: (3, 4).
        once: Integral of ``force`` since the first sample: (3, 4).
        twice: Integral of ``once``.
    """

    at_s: list[float] = field(default_factory=list)
    q: list[Quaternion] = field(default_factory=list)
    force: list[Float[Array, "3 4"]] = field(default_factory=list)
    once: list[Float[Array, "3 4"]] = field(default_factory=list)
    twice: list[Float[Array, "3 4"]] = field(default_factory=list)

    def copied(self) -> Path:
        """One that can be added to without touching this one."""
        lists = (self.at_s, self.q, self.force, self.once, self.twice)
        return Path(*(list(each) for each in lists))  # type: ignore[arg-type] # in their order

    def add(self, at_s: float, q: Quaternion, acc: Float[Array, "3"]) -> None:
        """The next sample; between two, force is taken as changing evenly."""
        matrix = small.to_matrix(q)
        now = np.empty((3, 4))
        now[:, :3], now[:, 3] = matrix, matrix @ acc
        once = twice = np.zeros((3, 4))
        if self.at_s:
            dt, before = at_s - self.at_s[-1], self.force[-1]
            once, twice = _further((self.once[-1], self.twice[-1]), before, now, dt, dt)
        self.at_s.append(at_s)
        self.q.append(q)
        self.force.append(now)
        self.once.append(once)
        self.twice.append(twice)
        if self.at_s[0] < at_s - 2.0 * _KEEP_S:
            old = bisect_right(self.at_s, at_s - _KEEP_S)
            for each in (self.at_s, self.q, self.force, self.once, self.twice):
                del each[:old]

    def attitude(self, s: float) -> Quaternion:
        """``q_world_sensor`` at an instant [s], clipped to what is remembered."""
        if s <= self.at_s[0] or s >= self.at_s[-1]:
            return self.q[0 if s <= self.at_s[0] else -1]
        k = bisect_right(self.at_s, s) - 1
        share = (s - self.at_s[k]) / (self.at_s[k + 1] - self.at_s[k])
        return small.between(self.q[k], self.q[k + 1], share)

    def rate(self, s: float, half_s: float) -> Float[Array, "3"]:
        """Mean rate around an instant, in the world [rad/s]."""
        begin, end = max(self.at_s[0], s - half_s), min(self.at_s[-1], s + half_s)
        if end <= begin:
            return np.zeros(3)
        turn = small.multiply(self.attitude(end), small.conjugate(self.attitude(begin)))
        return np.array(small.log(turn)) / (end - begin)

    def between(self, begin: float, end: float) -> tuple[Array, Array]:
        """What force adds to velocity and to place from one instant to another: (3, 4) each.

        The last column is of the force in the world [m/s], [m]; the first three are what takes a
        bias to what it adds.
        """
        (once, twice), (later, beyond) = self._at(begin), self._at(end)
        return later - once, beyond - twice - (end - begin) * once

    def _at(self, s: float) -> tuple[Array, Array]:
        k = min(max(bisect_right(self.at_s, s) - 1, 0), len(self.at_s) - 1)
        dt = s - self.at_s[k]
        if dt == 0.0:
            return self.once[k], self.twice[k]
        last = k == len(self.at_s) - 1
        now, after = self.force[k], self.force[k if last else k + 1]
        span = dt if last else self.at_s[k + 1] - self.at_s[k]
        return _further((self.once[k], self.twice[k]), now, after, dt, span)


def _further(
    so_far: tuple[Array, Array], now: Array, after: Array, dt: float, span: float
) -> tuple[Array, Array]:
    """Integrals ``dt`` on, where force goes evenly from one to the other within ``span``."""
    (once, twice), slope = so_far, (after - now) / span
    further = once + dt * now + (0.5 * dt * dt) * slope
    return further, twice + dt * once + (0.5 * dt * dt) * now + (dt**3 / 6.0) * slope
