"""Symmetric centre and axis of rotation: both terminals' points at once, in linear least squares.

*Centre* (R. M. Ehrig et al., J. Biomech. 39 (2006) 2798, SCoRE): the points c and l of the two
terminals' frames that stay together best, ``c - R_i l = t_i``. *Axis* (R. M. Ehrig et al., J.
Biomech. 40 (2007) 2150, SARA): the direction in which these equations say least is a hinge's axis.
"""

from __future__ import annotations

import numpy as np

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.trackers.attitude_noise import Equations, seeming, solved
from handstudio.trackers.estimate import (
    UNSEEN_SD_M,
    JointEstimate,
    functional_axis,
    in_lower,
    independent,
    rest_place,
)
from handstudio.trackers.pair import Pair
from handstudio.trackers.plane import Plane


def centre(pair: Pair, plane: Plane | None = None) -> JointEstimate:
    """The two points; along the axis of a hinge half way between the terminals, or in a plane."""
    rows = _rows(pair)
    middle = rest_place(pair) if plane is None else plane.p1
    guess = np.concatenate([middle, in_lower(pair, middle)])
    x = guess
    tie = np.eye(6) / UNSEEN_SD_M**2
    square = np.einsum("nki,nkj->ij", rows, rows)
    axis = functional_axis(pair)[0]
    noise = seeming(pair, axis, np.zeros(len(pair)), np.ones(len(pair)))[:6, :6]
    covariance = tie
    for _ in range(3):  # what is left tells how much the ties count
        left = pair.t_upper_lower - rows @ x
        precision = _precision(left)
        right = np.einsum("nki,nk->i", rows, pair.t_upper_lower)
        data = Equations(precision * square, precision * right)
        x, covariance = solved(data, precision * noise, Equations(tie, tie @ guess), guess)
    axis, sd = _axis(axis, square, left)
    zero = np.zeros(3)
    return JointEstimate(
        "symmetric",
        x[:3],
        x[3:],
        covariance[:3, :3],
        covariance[3:, 3:],
        len(pair),
        axis,
        sd,
        zero,
        zero,
    )


def _rows(pair: Pair) -> Array:
    turned = so3.to_matrix(pair.q_upper_lower)
    return np.concatenate([np.broadcast_to(np.eye(3), turned.shape), -turned], axis=2)


def _precision(left: Array) -> float:
    n = len(left)
    spread = max(float(np.sum(left**2)) / (3.0 * n), 1e-14)
    return independent(left) / n / spread


def _axis(flexion: Array, square: Array, left: Array) -> tuple[Array, float]:
    """Upper half of the direction that is told least, along the mean flexion axis; its sd."""
    power, vectors = np.linalg.eigh(square)
    axis = vectors[:3, 0] / np.linalg.norm(vectors[:3, 0])
    turned = float(np.sqrt(power[1] / len(left)))
    spread = float(np.sqrt(max(power[0], 0.0) / len(left)))
    sd = spread / max(turned, 1e-9) / np.sqrt(independent(left))
    return np.asarray(axis if axis @ flexion >= 0.0 else -axis), sd
