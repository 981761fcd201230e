"""The hand as a tree of joints for programs that animate: local turns, offsets, what hangs where.

Of each segment, in the order of `SEGMENTS`; the frames are y up (`y_up`), lengths in metres.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.export.y_up import turned_points
from handstudio.hand.skeleton import DISTALS, PARENTS, SEGMENTS, Skeleton
from handstudio.maths import so3

CHILDREN = tuple(
    tuple(child for child, parent in enumerate(PARENTS) if parent == segment)
    for segment in range(len(SEGMENTS))
)
"""Indices of the segments that each segment carries."""


def in_parents(q_world_segment: Float[Array, "n k 4"]) -> Float[Array, "n k 4"]:
    """Attitude of each segment in the one that carries it; the forearm's in the world."""
    parents = list(PARENTS)
    out = so3.multiply(so3.conjugate(q_world_segment[:, parents]), q_world_segment)
    out[:, 0] = q_world_segment[:, 0]
    return out


def rest_in_forearm(skeleton: Skeleton) -> Float[Array, "k 4"]:
    """Attitude of each segment at the flat hand, as the forearm sees it."""
    out = skeleton.q_parent_rest.copy()
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            out[child] = so3.multiply(out[parent], skeleton.q_parent_rest[child])
    return out


def tips(skeleton: Skeleton) -> dict[int, Float[Array, " 3"]]:
    """Where each distal segment ends, in its frame: by the segment's index; our axes."""
    return {
        SEGMENTS.index(name): tip for name, tip in zip(DISTALS, skeleton.t_distal_tip, strict=True)
    }


def ends(skeleton: Skeleton, segment: int) -> list[Float[Array, " 3"]]:
    """The joints and the tip that a segment carries, in its frame turned y up.

    Not a joint that lies where the segment begins: an undivided palm's second block.
    """
    carried = [skeleton.t_parent_joint[child] for child in CHILDREN[segment]]
    tip = tips(skeleton).get(segment)
    every = carried if tip is None else [*carried, tip]
    return [turned_points(each) for each in every if np.any(each)]
