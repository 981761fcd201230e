"""The thing that is held in the open take, as the picture shows it. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from app.state import State
from app.views.page import HandView, SensorsView
from handstudio.analysis.object_size import ObjectSize
from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3

_HAND = SEGMENTS.index("hand")
_BAR_M = 0.14  # how long a bar is nobody knows: longer than a palm is broad


@dataclass(frozen=True, slots=True, eq=False)
class HeldView:
    """A sphere or a bar along its z, from the elbow [m].

    Attributes:
        size: Whose: the same as before, the same thing.
        radius_m: Of it.
        length_m: Of a bar as it is drawn; 0: a sphere.
    """

    size: ObjectSize
    radius_m: float
    length_m: float
    q_world_held: Float[Array, "4"]
    t_world_held: Float[Array, "3"]


def held_view(state: State, hand: HandView | SensorsView | None) -> HeldView | None:
    """What is held now, as far as its size was told; ``hand``: the one that is drawn."""
    review = state.review
    if review is None or review.found is None or not isinstance(hand, HandView):
        return None
    grasp = review.found.grasp_at(review.at_s)
    if grasp is None or grasp.size is None:
        return None
    if not grasp.segment.hold_s <= review.at_s <= grasp.segment.release_s:
        return None
    size, q_world_hand = grasp.size, hand.pose.q_world_segment[_HAND]
    arm = so3.rotate(q_world_hand, size.t_hand_middle)
    return HeldView(
        size,
        0.5 * size.diameter_m,
        _BAR_M if size.form == "cylinder" else 0.0,
        so3.multiply(q_world_hand, _z_along(size.axis)),
        hand.pose.t_world_joint[_HAND] + arm,
    )


def _z_along(axis: Array) -> Array:
    """The shortest turn that brings z along an axis; a bar has no ends to tell apart."""
    z = np.array([0.0, 0.0, 1.0])
    towards = axis if axis @ z >= 0.0 else -axis
    across = np.cross(z, towards)
    sine = float(np.linalg.norm(across))
    turn: Array = across * (np.arctan2(sine, towards @ z) / sine if sine > 0.0 else 0.0)
    return so3.exp(turn)
