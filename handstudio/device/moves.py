"""The last half minute of a hand, at a pace that following it in a room can keep."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.device import corrected
from handstudio.device.orders import Moved
from handstudio.pipeline import Motion, join
from handstudio.samples import ImuSamples
from handstudio.setup import Setup
from handstudio.terminal import in_time, is_in_time

SPAN_S = 25.0
PACE_HZ = 125.0
"""Instants are made fewer above this: readings are means, attitudes those of their middle."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Instants of all sensors: their motion, and what they felt [m/s²]."""

    motion: Motion
    acc: Array

    def last(self, seconds: float) -> Part:
        """The end of it."""
        time_us = self.motion.time_us
        at = int(np.searchsorted(time_us, time_us[-1] - round(seconds * 1e6)))
        return Part(self.motion[at:], self.acc[at:])


@dataclass(slots=True)
class Moves:
    """What was kept; for one thread. Begins anew with another setup."""

    setup: Setup | None = None
    parts: list[Part] = field(default_factory=list)
    _left: list[Part] = field(default_factory=list)  # too few yet for a step of the pace
    _before: Motion | None = None  # the last instant, as it came

    def add(self, moves: list[Moved]) -> Part | None:
        """Take in what came, all by one setup; what is new, at the pace. None: nothing yet."""
        if not moves:
            return None
        if moves[-1].setup != self.setup:
            self.forget()
            self.setup = moves[-1].setup
        setup = self.setup
        assert setup is not None  # just set
        for move in moves:
            acc = [_felt(setup, run) for run in move.runs]
            self._left.append(Part(self._timely(setup, move.motion), np.concatenate(acc)))
        step = max(1, round(setup.rate_hz / PACE_HZ))
        part = _fewer(Part(join([p.motion for p in self._left]), _accs(self._left)), step)
        whole = len(part.motion) * step
        left = Part(join([p.motion for p in self._left])[whole:], _accs(self._left)[whole:])
        self._left = [left] if len(left.motion) else []
        if not len(part.motion):
            return None
        self.parts.append(part)
        newest_us = int(part.motion.time_us[-1])
        while newest_us - int(self.parts[0].motion.time_us[-1]) > SPAN_S * 1e6:
            self.parts.pop(0)
        return part

    def forget(self) -> None:
        """Begin anew."""
        self.setup, self.parts, self._left, self._before = None, [], [], None

    def _timely(self, setup: Setup, motion: Motion) -> Motion:
        """Attitudes of the instants that they are said to be of, see `terminal.in_time`."""
        if is_in_time(setup):
            return motion
        both = motion if self._before is None else join([self._before, motion])
        self._before = motion[-1:]
        q = np.stack(
            [in_time(setup, both.q_world_sensor[:, k]) for k in range(both.doubt.shape[1])], axis=1
        )
        return replace(motion, q_world_sensor=q[len(both) - len(motion) :])

    def whole(self) -> Part:
        """All that is kept; there is some."""
        return Part(join([p.motion for p in self.parts]), _accs(self.parts))

    @property
    def seconds(self) -> float:
        """How long what is kept lasted."""
        if not self.parts:
            return 0.0
        first, last = self.parts[0].motion.time_us[0], self.parts[-1].motion.time_us[-1]
        return float(last - first) * 1e-6


def _felt(setup: Setup, run: ImuSamples) -> Array:
    sound = run if setup.sensors is None else corrected(run, setup.sensors, setup.layout.names)
    return sound.acc


def _accs(parts: list[Part]) -> Array:
    return np.concatenate([part.acc for part in parts])


def _fewer(part: Part, step: int) -> Part:
    count = len(part.motion) // step
    middle = step * np.arange(count) + step // 2
    motion = Motion(*(getattr(part.motion, name)[middle] for name in Motion.__slots__))
    acc = part.acc[: count * step]
    return Part(motion, acc.reshape(count, step, *acc.shape[1:]).mean(axis=1))
