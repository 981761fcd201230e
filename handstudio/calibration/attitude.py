"""Attitude of a resting sensor from gravity and the magnetic field (equations 2.9 to 2.11).

World frame: z up, x along the horizontal magnetic field. ``R_GS = Rz(psi) Ry(theta) Rx(phi)``.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3


def attitude(
    acc: Float[Array, "*b 3"], mag: Float[Array, "*b 3"] | None = None
) -> Float[Array, "*b 4"]:
    """Attitude ``q_world_sensor`` of a sensor at rest.

    Args:
        acc: Specific force in the sensor frame, +9.81 upward; its length does not matter.
        mag: Magnetic field in the sensor frame; its length does not matter. Where it is missing
            or NaN, psi is 0: the sensor's x axis is taken to point to magnetic north.
    """
    phi = np.arctan2(acc[..., 1], acc[..., 2])
    theta = -np.arctan2(acc[..., 0], np.hypot(acc[..., 1], acc[..., 2]))
    x, y, _ = np.eye(3)
    q_level_sensor = so3.multiply(so3.from_axis_angle(y, theta), so3.from_axis_angle(x, phi))
    if mag is None:
        return q_level_sensor
    level = so3.rotate(q_level_sensor, mag)
    psi = -np.arctan2(level[..., 1], level[..., 0])
    return so3.multiply(so3.about_z(np.where(np.isfinite(psi), psi, 0.0)), q_level_sensor)
