"""The sensor boards that are drawn on a hand: on which segment, where on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from app import colours
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import SEGMENTS, Skeleton
from handstudio.hand.surface import SkinnedMesh
from handstudio.hand_surface import skinned
from handstudio.layout import Layout
from handstudio.maths import so3

BOARD_M = 0.010
"""Drawn width of a board."""

# share of the way along a segment; what is not named sits half way
_ALONG = {"SN1": 0.66, "SN2": 0.76, "SN3": 0.86, "Tip": 1.0}


_THICK = 0.12  # half of a board, less what sinks into skin
_AROUND_M = 0.006


@dataclass(frozen=True, slots=True, eq=False)
class Boards:
    """Boards as constants in the frames of their segments (drawn, not measured)."""

    names: tuple[str, ...]
    segment: tuple[int, ...]
    t_segment_board: Float[Array, "s 3"]
    colour: tuple[tuple[int, int, int], ...]

    def placed(self, pose: Pose) -> tuple[Float[Array, "s 4"], Float[Array, "s 3"]]:
        """Attitude and place of every board for a single pose."""
        q = pose.q_world_segment[list(self.segment)]
        return q, pose.t_world_joint[list(self.segment)] + so3.rotate(q, self.t_segment_board)


def boards_of(layout: Layout, skeleton: Skeleton) -> Boards:
    """The boards of a layout's sensors that sit on the hand, on the backs of its segments."""
    far, skin = skeleton.t_far_end, skinned(skeleton)
    names, segments, places = [], [], []
    for sensor in layout.sensors:
        if sensor.segment not in SEGMENTS:
            continue
        segment = SEGMENTS.index(sensor.segment)
        names.append(sensor.sensor)
        segments.append(segment)
        along = _ALONG.get(sensor.sensor, 0.5) * far[segment]
        height = _back(skin, segment, along) + _THICK * BOARD_M
        places.append(along + np.array([0.0, 0.0, height]))
    tints = tuple(colours.of_part(SEGMENTS[segment]) for segment in segments)
    return Boards(tuple(names), tuple(segments), np.array(places).reshape(-1, 3), tints)


def _back(skin: SkinnedMesh, segment: int, at: Float[Array, "3"]) -> float:
    """How high the skin is on the back of a segment above a point of its frame [m]."""
    q = so3.conjugate(skin.bound.q_world_segment[segment])
    vertices = skin.vertices[skin.part(segment)[0]]
    offset = so3.rotate(q, vertices - skin.bound.t_world_joint[segment]) - at
    apart = np.linalg.norm(offset[:, :2], axis=1)
    upper = offset[:, 2] > 0.0
    near = upper & (apart < max(_AROUND_M, float(apart[upper].min())) + 1e-9)
    return float(offset[near, 2].max())
