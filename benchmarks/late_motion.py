"""What the late-tracker bench watches: heads and hands, a late tracker, a drifting gyroscope."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.trials import performance
from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.rig import hand_at
from handstudio.simulation.subject import subject
from handstudio.simulation.world import World
from handstudio.trackers.late_euler import from_euler
from handstudio.trackers.track import Track

SECONDS = 10.0
GYR_HZ, TRACKER_HZ = 100, 50
DELAY_S = 0.1
TRACKER_SD = 0.013  # [rad]: 0.8 degrees, as the paper has it
GYR_SD = 0.15  # [rad/s]: v2
GYR_BIAS_SD = (0.034, 0.028, 0.082)
"""About x, y and z [rad/s]: so that rates alone drift within 10 s as far as the paper's did."""

_HEAD_RATES = (0.77, 0.98, 0.97)
"""Azimuth, elevation, roll [rad/s], root mean square: what a tracker 0.1 s late is off by there."""
_HEAD_HZ = ((0.8, 1.8), (1.0, 2.0), (1.2, 2.4))
_TONES = 5
_HAND_MOTIONS = "pouring+spinning_top+ball_throw"


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """What sensors on something that moves tell, and how it was."""

    time_us: Array
    gyr: Array
    track: Track  # with the times when poses were told
    q_true: Array
    tracker_at: Array  # which gyroscope samples poses came with


def head(seed: int) -> Watched:
    """A head that looks about: five tones an angle, with the paper's rates."""
    rng = np.random.default_rng([seed, 1])
    low, high = np.transpose(_HEAD_HZ)
    hertz = rng.uniform(low, high, (_TONES, 3)).T
    phase = rng.uniform(0.0, 2.0 * np.pi, (3, _TONES))
    share = rng.uniform(0.5, 1.5, (3, _TONES))  # of the rate
    share *= (np.array(_HEAD_RATES) * np.sqrt(2.0) / np.linalg.norm(share, axis=1))[:, None]

    def attitude(time_s: Array) -> Array:
        turned = 2.0 * np.pi * hertz * time_s[:, None, None] + phase
        return from_euler(np.sum(share / (2.0 * np.pi * hertz) * np.sin(turned), axis=-1))

    return _watched(attitude, rng)


def hand(seed: int, person: int) -> Watched:
    """The hand of a virtual person who pours, turns a top and throws a ball."""
    rng = np.random.default_rng([seed, 2])
    someone = subject(person)
    performed = performance(someone, _HAND_MOTIONS, seed)
    begins = rng.uniform(0.0, performed.duration_s - SECONDS - 1.0)
    k = SEGMENTS.index("hand")

    def attitude(time_s: Array) -> Array:
        _, segments = hand_at(someone, performed, np.maximum(time_s + begins, 0.0), World())
        return np.array(segments.q[:, k])

    return _watched(attitude, rng)


def _watched(attitude, rng: np.random.Generator) -> Watched:  # type: ignore[no-untyped-def]
    time_us = np.arange(round(SECONDS * GYR_HZ)) * (1_000_000 // GYR_HZ)
    time_s, half = time_us * 1e-6, 1e-4
    turn = so3.multiply(so3.conjugate(attitude(time_s - half)), attitude(time_s + half))
    bias = rng.normal(0.0, GYR_BIAS_SD)
    gyr = so3.log(turn) / (2.0 * half) + bias + rng.normal(0.0, GYR_SD, (len(time_us), 3))
    at = np.arange(0, len(time_us), GYR_HZ // TRACKER_HZ)
    noise = so3.exp(rng.normal(0.0, TRACKER_SD, (len(at), 3)))
    q = so3.multiply(attitude(time_s[at] - DELAY_S), noise)
    track = Track("terminal", time_us[at], np.zeros((len(at), 3)), q, np.ones(len(at)))
    return Watched(time_us, gyr, track, attitude(time_s), at)
