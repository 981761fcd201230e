"""Attitude as three Euler angles, as the thesis has it: `raw` and `filter1` compute with them.

``R_GS = Rz(psi) Ry(theta) Rx(phi)``, sensor to world (2.7), angles [rad] in the order phi, theta,
psi. Components stand on the first axis here and sensors on the last, so that numpy's inner loop
runs over sensors: these functions are called once an instant.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3

NEAREST_TO_SINGULAR = 1e-3
"""What \\|cos(theta)\\| is taken to be where it is smaller, within 0.06 deg of theta = +-90 deg.

There phi and psi turn infinitely fast (2.12). The equation is bounded there, so that a step stays a
number that the next one can build on, and left as it is elsewhere. Nothing is mended by it."""


def rates(angles: Float[Array, "3 s"], gyr: Float[Array, "3 s"]) -> Float[Array, "3 s"]:
    """Rates of the angles [rad/s] of a sensor that turns at ``gyr`` [rad/s], its own frame (2.12).

    They are linear in ``gyr``: give it the rotation of a step [rad] and the result is the step
    of the angles, first order, as (2.13) sums it.
    """
    return _turning(angles, gyr)[0]


def rates_and_slopes(
    angles: Float[Array, "3 s"], gyr: Float[Array, "3 s"]
) -> tuple[Float[Array, "3 s"], Float[Array, "3 2 s"]]:
    """The rates and how they change with phi and theta; with psi they do not.

    ``slopes[i, j]`` is the derivative of rate i by angle j.
    """
    rate, across, cos_theta, sin_theta = _turning(angles, gyr)
    slopes = np.zeros((3, 2, rate.shape[1]))
    np.divide(rate[1], cos_theta, out=slopes[2, 0])
    np.multiply(slopes[2, 0], sin_theta, out=slopes[0, 0])
    np.divide(rate[2], cos_theta, out=slopes[0, 1])
    np.multiply(slopes[0, 1], sin_theta, out=slopes[2, 1])
    np.negative(across, out=slopes[1, 0])
    return rate, slopes


def observed(acc: Float[Array, "3 *b"], mag: Float[Array, "3 *b"]) -> Float[Array, "3 *b"]:
    """Angles by accelerometer and compass, as if the sensor rested (2.9 to 2.11).

    Lengths of both do not matter; what is not gravity in ``acc`` is taken for gravity.
    """
    phi = np.arctan2(acc[1], acc[2])
    theta = -np.arctan2(acc[0], np.sqrt(acc[1] * acc[1] + acc[2] * acc[2]))
    sin_phi, cos_phi = np.sin(phi), np.cos(phi)
    level_x = np.cos(theta) * mag[0] + np.sin(theta) * (sin_phi * mag[1] + cos_phi * mag[2])
    level_y = cos_phi * mag[1] - sin_phi * mag[2]
    return np.stack([phi, theta, -np.arctan2(level_y, level_x)])


def to_quaternion(angles: Float[Array, "3 *b"]) -> Float[Array, "*b 4"]:
    """``q_world_sensor`` of these angles."""
    x, y, _ = np.eye(3)
    q_level_sensor = so3.multiply(
        so3.from_axis_angle(y, angles[1]), so3.from_axis_angle(x, angles[0])
    )
    return so3.multiply(so3.about_z(angles[2]), q_level_sensor)


def from_quaternion(q_world_sensor: Float[Array, "*b 4"]) -> Float[Array, "3 *b"]:
    """Angles of an orientation, theta in [-pi/2, pi/2]; inverse of `to_quaternion`.

    Where \\|theta\\| is pi/2, phi and psi are not separately determined, and some pair that gives
    the orientation is returned.
    """
    m = so3.to_matrix(q_world_sensor)
    phi = np.arctan2(m[..., 2, 1], m[..., 2, 2])
    theta = np.arctan2(-m[..., 2, 0], np.hypot(m[..., 2, 1], m[..., 2, 2]))
    # the second column of what is left, Rz(psi) Ry(theta), once phi is taken off
    left = np.cos(phi)[..., None] * m[..., :, 1] - np.sin(phi)[..., None] * m[..., :, 2]
    return np.stack([phi, theta, np.arctan2(-left[..., 0], left[..., 1])])


def difference(to: Float[Array, "3 *b"], of: Float[Array, "3 *b"]) -> Float[Array, "3 *b"]:
    """``to - of``, each in [-pi, pi].

    A triple (phi, theta, psi) and (phi + pi, pi - theta, psi + pi) are one attitude. A state whose
    theta went past 90 deg is compared with the one of the two on its own side.
    """
    past = np.cos(of[1]) < 0.0
    if past.any():
        phi, theta, psi = to
        to = np.where(past, np.stack([phi + np.pi, np.pi - theta, psi + np.pi]), to)
    gap = to - of
    wrapped: Array = gap - 2.0 * np.pi * np.rint(gap * (0.5 / np.pi))
    return wrapped


def _turning(angles: Array, gyr: Array) -> tuple[Array, Array, Array, Array]:
    """The rates, and what they are made of."""
    (sin_phi, sin_theta), (cos_phi, cos_theta) = np.sin(angles[:2]), np.cos(angles[:2])
    cos_theta = np.copysign(np.maximum(np.abs(cos_theta), NEAREST_TO_SINGULAR), cos_theta)
    across = sin_phi * gyr[1] + cos_phi * gyr[2]
    rate = np.empty(angles.shape)
    np.divide(across, cos_theta, out=rate[2])
    np.add(gyr[0], rate[2] * sin_theta, out=rate[0])
    np.subtract(cos_phi * gyr[1], sin_phi * gyr[2], out=rate[1])
    return rate, across, cos_theta, sin_theta
