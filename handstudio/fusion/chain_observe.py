"""What a chain of sensors observes at an instant: readings beside what they should be (4.36)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.fusion.chain_kalman import Observed
from handstudio.fusion.chain_model import (
    UP,
    Attitudes,
    Expected,
    accumulated,
    from_before,
    from_beyond,
)
from handstudio.fusion.chain_steps import ChainSteps


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """Inverse variances of all instants: H1 and H2 [s⁴/m²], H3 as a share of the field; 0: none."""

    root: Float[Array, "n c l"]
    joint: Float[Array, "n c l"]
    field: Float[Array, "n c l"]


def inertial(
    at: Attitudes, steps: ChainSteps, k: int, weights: Weights, *, with_neighbours: bool
) -> list[Observed]:
    """H1, and both halves of H2, at the k-th instant.

    The elbow's acceleration, forgotten with every step, is expected to be 0.
    """
    still = np.zeros((len(at.r), 3))
    own, before, root, joint = steps.own[k], steps.before[k], weights.root[k], weights.joint[k]
    seen = [Observed(own, accumulated(at, steps.carried[k], still), root)]
    if with_neighbours:
        nearer = np.empty_like(before)
        nearer[:, 0], nearer[:, 1:] = UP, before[:, :-1]
        seen += [
            Observed(own, from_before(at, before, still), joint),
            Observed(nearer, from_beyond(at, own, still), joint),
        ]
    return seen


def magnetic(
    field: Expected, level_ut: Float[Array, "c l"], weight: Float[Array, "c l"]
) -> Observed:
    """H3: the level field that was found in the static interval is seen along x (4.33)."""
    reading = level_ut[..., None] * [1.0, 0.0, 0.0]
    known = level_ut > 0.0
    square = np.where(known, level_ut, 1.0) ** 2
    return Observed(reading, field, np.where(known, weight / square, 0.0))


def averaged_level(
    level_ut: Float[Array, "c l"],
    levels: Float[Array, "c l"],
    field: Expected,
    now: Bool[Array, "c l"],
) -> tuple[Float[Array, "c l"], Float[Array, "c l"]]:
    """Mean of the level field's strength over the static interval, and from how many readings."""
    if not now.any():
        return level_ut, levels
    count = levels + now
    strength = np.hypot(field.value[..., 0], field.value[..., 1])
    share = np.where(now, 1.0 / np.maximum(count, 1.0), 0.0)
    return level_ut + share * (strength - level_ut), count
