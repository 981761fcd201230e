"""From our world, z up, to one whose y is up and whose x is ours."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array


def turned_points(points: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
    """Points or vectors: (x, y, z) becomes (x, z, -y)."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x, z, -y], axis=-1)


def turned_rotations(q: Float[Array, "*n 4"]) -> Float[Array, "*n 4"]:
    """The same turns, their axes written in the other world; scalar first."""
    return np.concatenate([q[..., :1], turned_points(q[..., 1:])], axis=-1)
