"""Joints known exactly: a hinge, and how terminals beside it move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.trackers.poses import placed
from handstudio.trackers.track import Track

CENTRE_UPPER = np.array([0.002, 0.013, -0.011])
CENTRE_LOWER = np.array([-0.001, -0.009, -0.012])
AXIS = np.array([0.1, 0.98, 0.05]) / np.linalg.norm([0.1, 0.98, 0.05])
"""Of flexion, in the room."""


@dataclass(frozen=True)
class Hinge:
    """Two tracks beside a hinge, straight for three seconds, then bent."""

    upper: Track
    lower: Track
    centre_upper: Array
    centre_lower: Array
    axis_upper: Array


def hinge(
    noise_m: float = 0.0,
    noise_rad: float = 0.0,
    *,
    seconds: float = 15.0,
    rate_hz: float = 60.0,
    seed: int = 1,
    far: float = 1.1,
) -> Hinge:
    """A hinge on a hand that sways a little; terminals turned as they please."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 3.0 + seconds, 1.0 / rate_hz)
    flexion = np.where(time_s < 3.0, 0.0, 0.5 * far * (1.0 - np.cos(4.2 * (time_s - 3.0))))
    sway = 0.05 * np.stack([np.sin(0.7 * time_s), np.cos(0.9 * time_s), np.sin(1.3 * time_s)], 1)
    # along the finger lies x of the room; at rest the terminals are turned against it
    q_room_upper = so3.multiply(so3.exp(sway - sway[0]), so3.exp(np.array([0.1, -0.2, -1.4])))
    t_room_upper = np.array([0.15, 0.02, 0.05]) + 0.3 * sway
    q_rest = so3.exp(np.array([0.05, 0.12, -0.08]))
    axis_upper = so3.rotate(so3.conjugate(so3.exp(np.array([0.1, -0.2, -1.4]))), AXIS)
    q_upper_lower = so3.multiply(so3.from_axis_angle(axis_upper, flexion), q_rest)
    t_upper_lower = CENTRE_UPPER - so3.rotate(q_upper_lower, CENTRE_LOWER)
    q_room_lower = so3.multiply(q_room_upper, q_upper_lower)
    t_room_lower = placed(q_room_upper, t_room_upper, t_upper_lower)
    time_us = np.round(1e6 * time_s).astype(np.int64)

    def track(name: str, t: Array, q: Array) -> Track:
        t = t + noise_m * rng.standard_normal(t.shape)
        q = so3.multiply(q, so3.exp(noise_rad * rng.standard_normal(t.shape)))
        return Track(name, time_us, t, q, np.ones(len(t)))

    return Hinge(
        track("intermediate", t_room_upper, q_room_upper),
        track("distal", t_room_lower, q_room_lower),
        CENTRE_UPPER,
        CENTRE_LOWER,
        axis_upper,
    )
