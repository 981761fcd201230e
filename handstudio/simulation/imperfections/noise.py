"""Random numbers with a place: given by the seed and the index of the instant, however cut."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array

BLOCK = 64  # instants that are drawn together; changing it changes every stream


def generator(seed: int, *stream: int) -> np.random.Generator:
    """Random numbers of one of a seed's streams."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=stream))


def normals(
    seed: int, stream: int, first: int, n: int, shape: tuple[int, ...]
) -> Float[Array, "n ..."]:
    """Standard normals of the instants from ``first`` on, (n, *shape)."""
    start, stop = first // BLOCK, -(-(first + n) // BLOCK)
    blocks = [
        generator(seed, stream, block).standard_normal((BLOCK, *shape))
        for block in range(start, stop)
    ]
    skip = first - start * BLOCK
    return np.concatenate(blocks)[skip : skip + n]
