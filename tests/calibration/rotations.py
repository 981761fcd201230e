"""Rigid rotations whose centre is known: turns about axes, one after the other."""

from __future__ import annotations

import numpy as np

from handstudio.maths import so3

RATE_HZ = 100.0
X, Y, Z = np.eye(3)


def turning(*joints: tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]):
    """Orientation, rate and its derivative in the last frame of turns one after the other."""
    q, gyr, domega = so3.IDENTITY, np.zeros(3), np.zeros(3)
    for axis, (angle, rate, slope) in joints:
        own = rate[:, None] * axis
        turn = so3.from_axis_angle(axis, angle)
        back = so3.conjugate(turn)
        carried = so3.rotate(back, gyr)
        domega = so3.rotate(back, domega) - np.cross(own, carried) + slope[:, None] * axis
        q, gyr = so3.multiply(q, turn), carried + own
    return q, gyr, domega


def swing(seconds: float, hz: float, degrees: float, phase: float = 0.0):
    """Angle, rate and its derivative of a swing to and fro."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    w, size = 2.0 * np.pi * hz, np.deg2rad(degrees)
    wt = w * t + phase
    return size * np.sin(wt), size * w * np.cos(wt), -size * w**2 * np.sin(wt)
