"""ZYX angles, as Emura and Tachi (1993) write attitudes: ``R = Rz(gamma) Ry(beta) Rx(alpha)``.

Angles are in their order (gamma, beta, alpha): azimuth, elevation, roll; body rates likewise (z, y,
x).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3


def euler_of(q: Float[Array, "*n 4"]) -> Float[Array, "*n 3"]:
    """Azimuth, elevation and roll [rad] of attitudes, elevation in [-pi/2, pi/2]."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    gamma = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    beta = np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0))
    alpha = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return np.stack([gamma, beta, alpha], axis=-1)


def from_euler(angles: Float[Array, "*n 3"]) -> Float[Array, "*n 4"]:
    """Attitudes of azimuth, elevation and roll [rad]."""
    gamma, beta, alpha = np.moveaxis(angles, -1, 0)
    q_z = so3.about_z(gamma)
    q_y = so3.from_axis_angle(np.array([0.0, 1.0, 0.0]), beta)
    q_x = so3.from_axis_angle(np.array([1.0, 0.0, 0.0]), alpha)
    return so3.multiply(so3.multiply(q_z, q_y), q_x)


def rate_matrix(angles: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """F': rates of the angles are ``F' (z, y, x)`` of the body's rates [rad/s]; section 2.

    It has no limit where the elevation is a right angle.
    """
    _, b, a = angles
    sa, ca, tb = np.sin(a), np.cos(a), np.tan(b)
    return np.array(
        [[ca / np.cos(b), sa / np.cos(b), 0.0], [-sa, ca, 0.0], [ca * tb, sa * tb, 1.0]]
    )


def shorter(angles: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Differences of angles as the shorter way round, in [-pi, pi)."""
    return np.asarray((angles + np.pi) % (2.0 * np.pi) - np.pi)
