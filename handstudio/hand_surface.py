"""The surface of a hand, out of its file; `assets/meshes/make_hand.py` made that."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from handstudio.errors import HandstudioError
from handstudio.hand.skeleton import Skeleton
from handstudio.hand.surface import SkinnedMesh, Surface, shaped

_PLACES = (
    Path(__file__).parent / "assets" / "meshes",
    Path(__file__).parents[1] / "assets" / "meshes",
)


def skinned(skeleton: Skeleton) -> SkinnedMesh:
    """The surface of this hand: vertices, faces, segments, weights and the pose it is bound in.

    Raises:
        HandstudioError: the installation lacks it.
    """
    return shaped(drawn_surface(), skeleton)


@cache
def drawn_surface() -> Surface:
    """The surface as it was drawn, around the average right hand.

    Raises:
        HandstudioError: the installation lacks it.
    """
    for folder in _PLACES:
        path = folder / "hand.npz"
        if path.exists():
            with np.load(path) as held:
                weights = held["weights"].astype(float)
                return Surface(
                    held["vertices"].astype(float),
                    held["faces"].astype(np.int64),
                    held["bones"].astype(np.int64),
                    weights / weights.sum(axis=1, keepdims=True),
                    held["q_world_segment"],
                )
    raise HandstudioError(
        "The surface of the hand is missing from this installation.", "Install handstudio anew."
    )
