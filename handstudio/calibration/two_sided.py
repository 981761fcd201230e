"""Where the joint between two moving sensors is: nothing has to be held still.

The centre's acceleration is one vector, whichever of its two sensors it is computed from:

- by vectors: ``R_1 (a_1 - b_1 - Gamma_1 P_1) = exp([theta]x) R_2 (a_2 - b_2 - Gamma_2 P_2)``;
  theta(t) is what is wrong with the orientations, free at knots and straight in between.
- by norms: ``|a_1 - b_1 - Gamma_1 P_1| = |a_2 - b_2 - Gamma_2 P_2|``; needs no orientation
  (T. Seel, J. Raisch, T. Schauer, Sensors 14 (2014) 6891, without biases).

``a`` is the specific force, gravity and all: it is common to both sides. b are biases of the
accelerometers. Along a hinge's axis n the place may go to and fro on both sides at once, and
neither form sees it, however the whole is moved: what is unseen is told.

Both forms are homogeneous: accelerometers whose scales are off by 1 % make arms 1 % too long.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.rigid_rotation import (
    BIAS_SD,
    CentreEstimate,
    Excitation,
    RigidRotation,
    excitation,
    skew,
)
from handstudio.calibration.robust_fit import Fitted, Model, fit
from handstudio.errors import CalibrationError
from handstudio.maths import so3

KNOTS_S = 5.0
"""The error of the orientations is straight in between."""

DRIFT = np.deg2rad(1.0)
"""How fast orientations go astray [rad/s], standard deviation."""

_OPEN = 10.0  # [rad]: of an error of which nothing is known
_SIDES = 6


@dataclass(frozen=True, slots=True, eq=False)
class BothSides:
    """One joint's centre seen from both of its sensors.

    Attributes:
        one, two: From either.
        covariance: Of both places, the first sensor's first [m²].
        bias: Of both accelerometers [m/s²]; where gravity always lies alike in the sensors, it
            stays near zero whatever it is.
    """

    one: CentreEstimate
    two: CentreEstimate
    covariance: Float[Array, "6 6"]
    bias: Float[Array, "2 3"]


def by_norms(one: RigidRotation, two: RigidRotation, bias_sd: float = BIAS_SD) -> BothSides:
    """From the lengths of the centre's acceleration alone.

    Args:
        one, two: The sensors at the same instants; ``acc`` is the specific force.
        bias_sd: How far the accelerometers may be off, standard deviation [m/s²].

    Raises:
        CalibrationError: a sensor hardly turned, or they have different numbers of samples.
    """
    turned = _turned(one, two)
    acc, gamma = _both(one, two)

    def model(x: Array) -> tuple[Array, Array]:
        at, rows = _at_centre(x, acc, gamma)
        length = np.linalg.norm(at, axis=-1, keepdims=True)
        along = np.einsum("sni,snik->snk", at / length, rows)
        return (length[0] - length[1]), (along[0] - along[1])[:, None]

    found = fit(model, np.zeros(2 * _SIDES), _bias_prior(bias_sd), _SIDES, one.rate_hz)
    return _result(found, turned)


def by_vectors(
    one: RigidRotation,
    two: RigidRotation,
    q_world_one: Float[Array, "#n 4"],
    q_world_two: Float[Array, "#n 4"],
    *,
    bias_sd: float = BIAS_SD,
    drift: float = DRIFT,
) -> BothSides:
    """From the centre's acceleration as a vector; sharper than its length, where rotations hold.

    The two worlds may differ by any constant turn, and slowly drift apart: orientations may be
    those of the gyroscopes alone. For a given relative orientation, let ``q_world_one`` be the
    identity.

    Args:
        one, two: The sensors at the same instants; ``acc`` is the specific force.
        q_world_one, q_world_two: Their orientations.
        bias_sd: How far the accelerometers may be off, standard deviation [m/s²].
        drift: How fast the orientations go astray [rad/s], standard deviation.

    Raises:
        CalibrationError: a sensor hardly turned, or they have different numbers of samples.
    """
    turned = _turned(one, two)
    start = by_norms(one, two, bias_sd)
    acc, gamma = _both(one, two)
    used = one.used & two.used
    q = np.stack([np.broadcast_to(q, (len(one), 4))[used] for q in (q_world_one, q_world_two)])
    x = np.concatenate(
        [start.one.from_centre_m, start.two.from_centre_m, start.bias.ravel()], dtype=float
    )
    world = so3.rotate(q, _at_centre(x, acc, gamma)[0])
    q[1] = so3.multiply(_turn_between(*world), q[1])
    hats = _hats(np.flatnonzero(used) / one.rate_hz)
    model = _vector_model(acc, gamma, q, hats)
    count = 2 * _SIDES + 3 * hats.shape[1]
    prior = np.zeros((count, count))
    prior[: 2 * _SIDES, : 2 * _SIDES] = _bias_prior(bias_sd)
    prior[2 * _SIDES :, 2 * _SIDES :] = np.kron(_walk(hats.shape[1], drift), np.eye(3))
    found = fit(model, np.r_[x, np.zeros(count - len(x))], prior, _SIDES, one.rate_hz)
    return _result(found, turned)


def _vector_model(acc: Array, gamma: Array, q: Array, hats: Array) -> Model:
    r_world_sensor = so3.to_matrix(q)

    def model(x: Array) -> tuple[Array, Array]:
        at, rows = _at_centre(x, acc, gamma)
        theta = hats @ x[2 * _SIDES :].reshape(-1, 3)
        r = np.stack([r_world_sensor[0], so3.to_matrix(so3.exp(theta)) @ r_world_sensor[1]])
        world, rows = np.einsum("snij,snj->sni", r, at), r @ rows
        astray = np.einsum("nij,nk->nikj", skew(world[1]), hats).reshape(len(theta), 3, -1)
        return world[0] - world[1], np.concatenate([rows[0] - rows[1], astray], axis=-1)

    return model


def _at_centre(x: Array, acc: Array, gamma: Array) -> tuple[Array, Array]:
    """Acceleration of the centre from both sides (2, n, 3); its derivatives (2, n, 3, 12)."""
    places, biases = x[:_SIDES].reshape(2, 3), x[_SIDES : 2 * _SIDES].reshape(2, 3)
    at = acc - biases[:, None] - np.einsum("snij,sj->sni", gamma, places)
    rows = np.zeros((*at.shape, 2 * _SIDES))
    for side in (0, 1):
        rows[side, ..., 3 * side : 3 * side + 3] = -gamma[side]
        rows[side, ..., _SIDES + 3 * side : _SIDES + 3 * side + 3] = -np.eye(3)
    return at, rows


def _both(one: RigidRotation, two: RigidRotation) -> tuple[Array, Array]:
    used = one.used & two.used
    return np.stack([s.acc[used] for s in (one, two)]), np.stack(
        [s.gamma[used] for s in (one, two)]
    )


def _turn_between(one: Array, two: Array) -> Array:
    """The rotation that best turns the second vectors into the first (Wahba's problem)."""
    left, _, right = np.linalg.svd(one.T @ two)
    proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return so3.from_matrix(left @ proper @ right)


def _hats(time_s: Array) -> Array:
    """Shares of the knots at every instant."""
    count = max(2, round(float(time_s[-1] - time_s[0]) / KNOTS_S) + 1)
    place = (time_s - time_s[0]) / (time_s[-1] - time_s[0]) * (count - 1)
    shares: Array = np.maximum(0.0, 1.0 - np.abs(place[:, None] - np.arange(count)))
    return shares


def _walk(count: int, drift: float) -> Array:
    """Information on knots that are open in the mean and wander from one to the next."""
    steps = np.diff(np.eye(count), axis=0) / (drift * KNOTS_S)
    return np.asarray(steps.T @ steps + np.eye(count) / _OPEN**2)


def _bias_prior(sd: float) -> Array:
    return np.diag(np.repeat([0.0, sd**-2.0], _SIDES))


def _turned(one: RigidRotation, two: RigidRotation) -> tuple[Excitation, Excitation]:
    if len(one) != len(two) or one.rate_hz != two.rate_hz:
        raise CalibrationError(
            "The two sensors have {one} and {two} samples; they must be of the same instants.",
            "Cut both from one recording.",
            one=len(one),
            two=len(two),
        )
    used = one.used & two.used
    return excitation(replace(one, used=used)), excitation(replace(two, used=used))


def _result(found: Fitted, turned: tuple[Excitation, Excitation]) -> BothSides:
    one, two = (
        CentreEstimate(
            from_centre_m=found.x[at],
            covariance=found.covariance[at, at],
            unseen=_unseen(found.unseen[at]),
            residual=found.residual,
            excitation=excited,
            condition=found.condition,
        )
        for at, excited in zip((slice(0, 3), slice(3, 6)), turned, strict=True)
    )
    bias = found.x[_SIDES : 2 * _SIDES].reshape(2, 3)
    return BothSides(one, two, found.covariance, bias)


def _unseen(part: Float[Array, "3 u"]) -> Float[Array, " 3"]:
    """The direction in which unseen directions of both sides move this one most."""
    if not part.shape[1]:
        return np.zeros(3)
    directions, much, _ = np.linalg.svd(part, full_matrices=False)
    return directions[:, 0] if much[0] > 0.3 else np.zeros(3)
