"""The extended Kalman filter of a chain (4.23, 4.24), for all chains at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.fusion import euler
from handstudio.fusion.chain_model import Expected

_WIDEST = float(np.pi)
"""How uncertain an angle can be [rad]. Near the singularity linear propagation has no bound."""


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """Angles of the sensors of each chain and acceleration of its elbow, and how sure they are.

    Attributes:
        angles: phi, theta, psi [rad].
        elbow: In the world [m/s²].
        covariance: Of all of that, in this order.
    """

    angles: Float[Array, "c l 3"]
    elbow: Float[Array, "c 3"]
    covariance: Float[Array, "c a a"]


@dataclass(frozen=True, slots=True, eq=False)
class Observed:
    """Three readings a sensor, what they should be, and their weight: an inverse variance, or 0."""

    reading: Float[Array, "c l 3"]
    expected: Expected
    weight: Float[Array, "c l"]


def predicted(
    belief: Belief,
    turn: Float[Array, "c l 3"],
    spread: Float[Array, "c l"],
    elbow_variance: float,
) -> Belief:
    """One step of the angles (2.13); the elbow forgets how it was accelerated (4.38)."""
    c, links = spread.shape
    a = 3 * links + 3
    step, slopes = euler.rates_and_slopes(belief.angles.reshape(-1, 3).T, turn.reshape(-1, 3).T)
    each = np.arange(links)
    onward = np.zeros((c, links + 1, 3, links + 1, 3))
    onward[:, each, :, each, :] = np.eye(3)
    # numpy puts the index of sensors first here
    onward[:, each, :, each, :2] += slopes.reshape(3, 2, c, links).transpose(3, 2, 0, 1)
    f = onward.reshape(c, a, a)
    covariance = f @ belief.covariance @ np.swapaxes(f, -1, -2)
    variance = np.einsum("cii->ci", covariance)
    variance[:, :-3] += np.repeat(spread, 3, axis=1)
    variance[:, -3:] = elbow_variance
    if variance[:, :-3].max(initial=0.0) > _WIDEST**2:
        covariance = _bounded(covariance)
    return Belief(
        belief.angles + step.T.reshape(c, links, 3), np.zeros_like(belief.elbow), covariance
    )


def apart(belief: Belief, alone: Bool[Array, "c l"]) -> Belief:
    """These sensors have nothing in common with others: what corrects those leaves them alone."""
    c, links = alone.shape
    together = np.ones((c, links + 1), dtype=bool)
    together[:, :-1] = ~alone
    kept = together[:, :, None] & together[:, None, :] | np.eye(links + 1, dtype=bool)
    covariance = belief.covariance * kept.repeat(3, axis=1).repeat(3, axis=2)
    return Belief(belief.angles, belief.elbow, covariance)


def found(
    belief: Belief,
    at: Bool[Array, "c l 3"],
    angles: Float[Array, "c l 3"],
    variance: Float[Array, "c l 3"],
) -> Belief:
    """These angles were found otherwise, each by itself with this variance [rad²]."""
    c = len(at)
    new = np.concatenate([at.reshape(c, -1), np.zeros((c, 3), dtype=bool)], axis=1)
    covariance = np.where(new[:, :, None] | new[:, None, :], 0.0, belief.covariance)
    diagonal = np.einsum("cii->ci", covariance)
    diagonal[new] = variance[at]
    return Belief(np.where(at, angles, belief.angles), belief.elbow, covariance)


def corrected(belief: Belief, observed: Sequence[Observed]) -> Belief:
    """Correct by all that was observed, each component with an error of its own.

    In the form that adds up what observations weigh, where one that weighs nothing says nothing:
    ``P+ = (1 + P H' W H)^-1 P``, ``x+ = x + P+ H' W (z - h)``.
    """
    c, links = belief.angles.shape[:2]
    slopes = np.concatenate([_rows(one.expected) for one in observed], axis=1)
    gap = np.concatenate([one.reading - one.expected.value for one in observed], axis=1)
    weight = np.repeat(np.concatenate([one.weight for one in observed], axis=1), 3, axis=1)
    weighed = np.swapaxes(slopes * weight[..., None], -1, -2)
    before = belief.covariance
    after = np.linalg.solve(np.eye(before.shape[1]) + before @ (weighed @ slopes), before)
    after = 0.5 * (after + np.swapaxes(after, -1, -2))
    move = (after @ (weighed @ gap.reshape(c, -1, 1)))[..., 0]
    return Belief(
        belief.angles + move[:, :-3].reshape(c, links, 3), belief.elbow + move[:, -3:], after
    )


def _rows(expected: Expected) -> Array:
    c, links = expected.value.shape[:2]
    slopes = np.concatenate([expected.by_angles, expected.by_elbow], axis=-1)
    return slopes.reshape(c, 3 * links, -1)


def _bounded(covariance: Array) -> Array:
    """Errors of angles shrunk, with what they have in common, to what can be."""
    variance = np.einsum("cii->ci", covariance)
    shrink = _WIDEST / np.sqrt(np.maximum(variance, _WIDEST**2))
    shrink[:, -3:] = 1.0
    bounded: Array = covariance * shrink[:, :, None] * shrink[:, None, :]
    return bounded
