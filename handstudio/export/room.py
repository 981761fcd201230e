"""The hand of a part in a tracker's room, for formats that move a skeleton by its root.

Where the place is not known the last one is held, before the first the first one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.export.part import Part
from handstudio.hand.skeleton import Skeleton
from handstudio.hand_fit import HandFit
from handstudio.kinematics import segment_attitudes
from handstudio.maths import so3
from handstudio.pipeline import Motion
from handstudio.rooted import Root
from handstudio.way import last_known


@dataclass(frozen=True, slots=True, eq=False)
class Rooted:
    """A hand in the frame of its file, at some instants.

    Attributes:
        q_frame_segment: Of every segment; the frame is the room, or the world without one.
        t_frame_root: Where the first segment's joint is [m].
        known: Whether it was there at that instant, or is held.
    """

    q_frame_segment: Float[Array, "n k 4"]
    t_frame_root: Float[Array, "n 3"]
    known: Bool[Array, " n"]


class Placer:
    """Places the hand of a part; without a room its elbow rests in the origin."""

    def __init__(self, part: Part, fit: HandFit) -> None:
        self._part, self._fit = part, fit
        self._held = None if part.root is None else _held(part.root)

    @property
    def moves(self) -> bool:
        """Whether the root goes anywhere."""
        return self._held is not None

    def at(self, motion: Motion) -> Rooted:
        """At instants of the part."""
        q = segment_attitudes(self._part.setup, motion.q_world_sensor, self._fit)
        t = _root_joint(self._fit.skeleton)
        root, held = self._part.root, self._held
        if root is None or held is None:
            return Rooted(q, np.tile(t, (len(motion), 1)), np.ones(len(motion), dtype=bool))
        at = np.searchsorted(root.time_us, motion.time_us)
        q_room_world, t_room_elbow = root.q_room_world[held[at]], root.t_room_elbow[held[at]]
        return Rooted(
            so3.multiply(q_room_world[:, None], q),
            t_room_elbow + so3.rotate(q_room_world, t),
            held[at] == at,
        )


def _held(root: Root) -> Int64[Array, " n"] | None:
    known = np.isfinite(root.t_room_elbow[:, 0])
    return last_known(known) if known.any() else None


def _root_joint(skeleton: Skeleton) -> Float[Array, "3"]:
    first: Array = skeleton.t_parent_joint[0]
    return first
