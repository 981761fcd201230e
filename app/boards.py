"""The sensor boards that are drawn on a hand: on which segment, where on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from app import colours
from app.bones import hand_length, joint_radii
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import SEGMENTS, Skeleton
from handstudio.layout import Layout
from handstudio.maths import so3

BOARD_M = 0.010
"""Drawn width of a board."""

# share of the way along a segment; what is not named sits half way
_ALONG = {"SN1": 0.66, "SN2": 0.76, "SN3": 0.86, "Tip": 1.0}


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
    size = hand_length(skeleton)
    far = skeleton.t_far_end
    names, segments, places = [], [], []
    for sensor in layout.sensors:
        if sensor.segment not in SEGMENTS:
            continue
        segment = SEGMENTS.index(sensor.segment)
        height = np.array([0.0, 0.0, joint_radii()[segment] * size + 0.2 * BOARD_M])
        names.append(sensor.sensor)
        segments.append(segment)
        places.append(_ALONG.get(sensor.sensor, 0.5) * far[segment] + height)
    tints = tuple(colours.of_part(SEGMENTS[segment]) for segment in segments)
    return Boards(tuple(names), tuple(segments), np.array(places).reshape(-1, 3), tints)
