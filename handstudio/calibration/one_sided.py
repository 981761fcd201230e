"""Where the centre at rest is that a sensor turns about: all samples of (3.1), least squares.

Equation 3.1 is linear in P: ``a_r = Gamma P + b``. The offset b takes up a bias of the
accelerometer, and what a slightly wrong attitude leaves of gravity. The segment proximal to the
joint has to be held still; `two_sided` needs no such thing.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.rigid_rotation import BIAS_SD, CentreEstimate, RigidRotation, excitation
from handstudio.calibration.robust_fit import fit


def centre(rotation: RigidRotation, bias_sd: float = BIAS_SD) -> CentreEstimate:
    """Where the centre lies, and how surely.

    A hinge's own data leave the place along its axis open: ``unseen`` says so. Recordings about
    several axes of one centre, `rigid_rotation.joined`, are one rotation.

    Args:
        rotation: Of the sensor about a centre at rest; ``acc`` is free of gravity (3.7).
        bias_sd: How far the accelerometer may be off, standard deviation [m/s²].

    Raises:
        CalibrationError: the sensor hardly turned.
    """
    turned = excitation(rotation)
    used = rotation.used
    acc, rows = rotation.acc[used], _rows(rotation.gamma[used])

    def model(x: Array) -> tuple[Array, Array]:
        return np.asarray(rows @ x - acc), rows

    prior = np.diag(np.repeat([0.0, bias_sd**-2.0], 3))
    found = fit(model, np.zeros(6), prior, 3, rotation.rate_hz)
    unseen = found.unseen[:, 0] if found.unseen.shape[1] else np.zeros(3)
    return CentreEstimate(
        from_centre_m=found.x[:3],
        covariance=found.covariance,
        unseen=unseen,
        residual=found.residual,
        excitation=turned,
        condition=found.condition,
    )


def _rows(gamma: Float[Array, "n 3 3"]) -> Float[Array, "n 3 6"]:
    return np.concatenate([gamma, np.broadcast_to(np.eye(3), gamma.shape)], axis=-1)
