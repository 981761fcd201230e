"""Means of attitudes, and one terminal seen from another."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3


def mean_attitude(q: Float[Array, "n 4"]) -> Float[Array, "4"]:
    """The attitude nearest to all of them (F. L. Markley et al., JGCD 30, 2007)."""
    _, axes = np.linalg.eigh(q.T @ q)
    mean = axes[:, -1]
    return np.asarray(mean if mean[0] >= 0.0 else -mean)


def seen_from(
    q_room_a: Float[Array, "*#n 4"],
    t_room_a: Float[Array, "*#n 3"],
    q_room_b: Float[Array, "*#n 4"],
    t_room_b: Float[Array, "*#n 3"],
) -> tuple[Float[Array, "*n 4"], Float[Array, "*n 3"]]:
    """Attitude and place of b in a."""
    q_a_room = so3.conjugate(q_room_a)
    return so3.multiply(q_a_room, q_room_b), so3.rotate(q_a_room, t_room_b - t_room_a)


def placed(
    q_a_b: Float[Array, "*#n 4"], t_a_b: Float[Array, "*#n 3"], p_b: Float[Array, "*#n 3"]
) -> Float[Array, "*n 3"]:
    """A point of b in a."""
    return np.asarray(t_a_b + so3.rotate(q_a_b, p_b))
