"""What noise of attitudes does to least squares whose slopes are made of attitudes.

The equations ``(c + A f) - R (l + B f) = t`` have noise in R, f and t alike, for all come from the
same attitudes. Ordinary least squares then seem to know a hinge's place along its axis, and take
noise for curvature: with 0.1 deg a centre comes out a millimetre off. To second order in the
variance s² about each axis of either terminal, ``X^T (X x - t)`` is not zero at the truth but ``s²
K x`` in the mean, with

    K = X^T M + L^T G + D^T H,   M = C + L - 2 a x [0 0 0 R],   G = 2 (C + L + a x D),
    H = 2 D - a x (C + L),       C = [1 0 f 0],  L = [0 R 0 f R],  D = [0 0 1 -R]

and a the flexion axis; so ``s² K`` is taken off ``X^T X`` (the corrected least squares of W. A.
Fuller, Measurement Error Models, 1987, worked out for these equations).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.trackers.pair import Pair

_ORDER, _SQUARES = 4, 70.0  # of the differences, and their coefficients' sum of squares
_LEAST = 10


def attitude_variance(pair: Pair) -> float:
    """Variance of a terminal's attitude about an axis [rad²], of what changes between frames."""
    if len(pair) < _LEAST:
        return 0.0
    rough = np.diff(pair.turn, _ORDER, axis=0)
    # both terminals' noise is in it
    return float((np.median(np.abs(rough)) / 0.6745) ** 2 / _SQUARES / 2.0)


def seeming(
    pair: Pair,
    axis: Float[Array, "3"],
    beyond: Float[Array, " n"],
    weight: Float[Array, " n"],
) -> Float[Array, "12 12"]:
    """``s² K``, summed over all frames; the first six columns and rows are those of c and l.

    Args:
        pair: A joint bent.
        axis: Of flexion, in the upper terminal's frame.
        beyond: Flexion of each frame against its mean [rad].
        weight: Of each frame.
    """
    turned = so3.to_matrix(pair.q_upper_lower)
    across = np.cross(np.eye(3), axis)  # across @ v = axis x v
    b = beyond[:, None, None]
    own, none = np.broadcast_to(np.eye(3), turned.shape), np.zeros_like(turned)
    c = np.concatenate([own, none, b * own, none], axis=2)
    low = np.concatenate([none, turned, none, b * turned], axis=2)
    d = np.concatenate([none, none, own, -turned], axis=2)
    last = np.concatenate([none, none, none, turned], axis=2)
    m = c + low - 2.0 * across @ last
    total = np.zeros((12, 12))
    for slopes, with_noise in (
        (c - low, m),
        (low, 2.0 * (c + low + across @ d)),
        (d, 2.0 * d - across @ (c + low)),
    ):
        weighted = weight[:, None, None] * slopes
        total += weighted.reshape(-1, 12).T @ with_noise.reshape(-1, 12)
    return np.asarray(attitude_variance(pair) * total)


class Equations(NamedTuple):
    """Normal equations: sums of squares of slopes, and of slopes times values."""

    square: Array
    right: Array


def solved(
    data: Equations, seems: Float[Array, "k k"], known: Equations, start: Float[Array, " k"]
) -> tuple[Float[Array, " k"], Float[Array, "k k"]]:
    """Unknowns and their covariance from weighted data, less what only seems so, and what is known.

    Directions in which the data seem to tell no more than noise would make them seem are left
    to what is known: a hinge's place along its axis.

    Args:
        data: Of the frames.
        seems: What noise adds to their squares.
        known: Of what is known before.
        start: Unknowns that agree with it.
    """
    true = data.square - 0.5 * (seems + seems.T)
    power, directions = np.linalg.eigh(true)
    noise = np.einsum("ik,ij,jk->k", directions, seems, directions)
    told = directions[:, power > np.maximum(noise, 0.0)]
    only = told @ told.T
    covariance = np.linalg.inv(only @ true @ only + known.square)
    left = only @ (data.right - (data.square - seems) @ start)
    return start + covariance @ (left + known.right - known.square @ start), covariance
