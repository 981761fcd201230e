"""The turns of a gyroscope since any instant it remembers, for the cost of two products.

Kept for every sample are the turn since the first one, ``q_first_sensor``, and the integral of its
matrix: what a bias adds to a turn, to first order, is the difference of two of these. So the state
of a while ago is brought to now without adding up the rates between again (the idea of
preintegration: Forster et al., *On-Manifold Preintegration*, IEEE T-RO 33, 2017, eq. 44).
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.trackers import late_small as small
from handstudio.trackers.late_small import Quaternion, Vector

_KEEP_S = 1.0
"""How far back it remembers; no tracker is later."""


@dataclass(slots=True)
class Turns:
    """What is remembered, oldest first; arrays are never written in place.

    Attributes:
        at_s: Instants [s].
        q: Turn since the first sample there ever was, ``q_first_sensor``.
        swept: Integral of its matrix [s].
        gyr: The newest rate [rad/s].
        first_s: The first instant there ever was [s].
    """

    at_s: list[float] = field(default_factory=list)
    q: list[Quaternion] = field(default_factory=list)
    swept: list[Float[Array, "3 3"]] = field(default_factory=list)
    gyr: Vector = (0.0, 0.0, 0.0)
    first_s: float = 0.0

    def copied(self) -> Turns:
        """One that can be added to without touching this one."""
        return Turns(list(self.at_s), list(self.q), list(self.swept), self.gyr, self.first_s)

    def add(self, at_s: float, gyr: Vector) -> None:
        """The next sample: rates between two are taken as their mean."""
        if not self.at_s:
            self.first_s = at_s
            self.q.append(small.IDENTITY)
            self.swept.append(np.zeros((3, 3)))
        else:
            dt = at_s - self.at_s[-1]
            rate = [0.5 * (a + b) for a, b in zip(self.gyr, gyr, strict=True)]
            q, swept = _further(self.q[-1], self.swept[-1], rate, dt)
            self.q.append(small.normalize(q))
            self.swept.append(swept)
        self.at_s.append(at_s)
        self.gyr = gyr
        if self.at_s[0] < at_s - 2.0 * _KEEP_S:
            old = bisect_right(self.at_s, at_s - _KEEP_S)
            del self.at_s[:old], self.q[:old], self.swept[:old]

    def at(self, s: float) -> tuple[Quaternion, Array]:
        """Turn and its integral at an instant [s], between samples or beyond them at their rate."""
        if s < self.at_s[0] or s > self.at_s[-1]:
            end = 0 if s < self.at_s[0] else -1
            return _further(self.q[end], self.swept[end], self._rate_at(end), s - self.at_s[end])
        k = bisect_right(self.at_s, s) - 1
        if self.at_s[k] == s:
            return self.q[k], self.swept[k]
        share = (s - self.at_s[k]) / (self.at_s[k + 1] - self.at_s[k])
        swept = self.swept[k] + share * (self.swept[k + 1] - self.swept[k])
        return small.between(self.q[k], self.q[k + 1], share), swept

    def between(self, begin: float, end: float, bias: Array) -> tuple[Quaternion, Array]:
        """The turn ``q_begin_end`` without bias, and how it changes with the bias: ``-M db``."""
        (q_begin, swept_begin), (q_end, swept_end) = self.at(begin), self.at(end)
        m = small.to_matrix(small.conjugate(q_end)) @ (swept_end - swept_begin)
        q = small.multiply(small.conjugate(q_begin), q_end)
        return small.multiply(q, small.exp(*(-m @ bias).tolist())), m

    def rate(self, s: float, bias: Array, half_s: float) -> Float[Array, "3"]:
        """Mean rate [rad/s] around an instant, or before it where that is the newest."""
        end = min(self.at_s[-1], s + half_s)
        begin = min(s, end) - half_s
        turn = small.multiply(small.conjugate(self.at(begin)[0]), self.at(end)[0])
        return np.array(small.log(turn)) / (end - begin) - bias

    def _rate_at(self, end: int) -> list[float]:
        """Of the oldest or the newest two samples, with bias [rad/s]."""
        if len(self.at_s) < 2:
            return list(self.gyr)
        a, b = (0, 1) if end == 0 else (-2, -1)
        turn = small.log(small.multiply(small.conjugate(self.q[a]), self.q[b]))
        return [x / (self.at_s[b] - self.at_s[a]) for x in turn]


def _further(q: Quaternion, swept: Array, rate: list[float], dt: float) -> tuple[Quaternion, Array]:
    half = small.exp(*(0.5 * dt * x for x in rate))
    middle = small.multiply(q, half)
    return small.multiply(middle, half), swept + dt * small.to_matrix(middle)
