"""What skin makes of segments that are told by boards on it, taken off again.

Two things of it can be known from a calibration and from the pose alone. A joint that bends pitches
the boards beside it, by a share of its turn. And the skin of the forearm stays behind when the
forearm turns, so the boards on it miss some of that; the hand tells it better (both: J. Biomech.
Eng. 144 (2022) 071007). Here it does as a wrist hardly turns about the forearm's axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.hand.angles import joint_index
from handstudio.hand.skeleton import PARENTS, SEGMENTS, Skeleton
from handstudio.maths import so3

LAG_RAD = float(np.deg2rad(6.0))
"""How far the forearm's own boards are off about its axis, standard deviation: they miss a sixth of
some 35 degrees. Ours."""

WRIST_RAD = float(np.deg2rad(3.0))
"""How far a hand turns on the forearm about that axis. Ours: passively it is more."""


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """What is known of it.

    Attributes:
        segment: Index of the segments whose boards rock.
        joint: Index of the joint beside, its own or one it carries, that each rocks with.
        share: Turn of the board about the joint's axis per turn of the joint [rad/rad].
        by_hand: Whether the hand tells how the forearm is turned.
    """

    segment: Int64[Array, " r"]
    joint: Int64[Array, " r"]
    share: Float[Array, " r"]
    by_hand: bool = False


def skin_of(rocking: Sequence[tuple[str, str, float]], by_hand: bool = False) -> Skin:
    """From names of segment and joint, and the share."""
    return Skin(
        np.array([SEGMENTS.index(segment) for segment, _, _ in rocking], dtype=np.int64),
        np.array([joint_index(joint) for _, joint, _ in rocking], dtype=np.int64),
        np.array([share for _, _, share in rocking], dtype=float),
        by_hand,
    )


def taken_off(
    skin: Skin, skeleton: Skeleton, q_world_segment: Float[Array, "n k 4"]
) -> Float[Array, "n k 4"]:
    """Attitudes of bones from those that boards tell of them; memoryless, in one pass.

    Joints are read from what the boards tell: that these rock too is of second order.
    """
    back, moved = np.zeros((*q_world_segment.shape[:2], 3)), set(skin.segment.tolist())
    if moved:
        _steady(skin, skeleton, q_world_segment, back)
    if skin.by_hand:
        moved.add(_FOREARM)
        back[:, _FOREARM, 1] += _missed(skeleton, q_world_segment)
    which, out = sorted(moved), q_world_segment.copy()
    out[:, which] = so3.multiply(q_world_segment[:, which], so3.exp(back[:, which]))
    return out


def _steady(skin: Skin, skeleton: Skeleton, q: Array, back: Array) -> None:
    """Add how boards turn back that rock [rad], in their segments' frames."""
    parents, rest = np.array(PARENTS)[skin.joint], skeleton.q_parent_rest[skin.joint]
    turned = so3.multiply(so3.conjugate(q[:, parents]), q[:, skin.joint])
    w, x, y, z = np.moveaxis(so3.multiply(so3.conjugate(rest), turned), -1, 0)
    turn = np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + z * z))  # as in angles.decompose
    # the axis is x of the joint's own segment: seen from there, or from the one before
    own = (skin.joint == skin.segment)[:, None]
    axis = so3.rotate(np.where(own, so3.IDENTITY, rest), np.array([1.0, 0.0, 0.0]))
    per_turn = -skin.share[:, None] * axis
    for rock, segment in enumerate(skin.segment):
        back[:, segment] += turn[:, rock, None] * per_turn[rock]


def _missed(skeleton: Skeleton, q: Array) -> Array:
    """What the forearm lacks about its long axis until the wrist turns about two axes only [rad].

    The first, x at rest, is the forearm's, the second, z, the hand's: they stay square. The more
    the wrist is bent the nearer z comes to the long axis, and the less it tells.
    """
    first = so3.rotate(skeleton.q_parent_rest[_HAND], np.array([1.0, 0.0, 0.0]))
    second = so3.rotate(q[:, _HAND], np.array([0.0, 0.0, 1.0]))
    second = so3.rotate(so3.conjugate(q[:, _FOREARM]), second)
    off = np.sum(second * first, axis=-1)
    slope = second[:, 0] * first[2] - second[:, 2] * first[0]  # with the forearm's turn
    missed = np.arctan(-off * slope / (slope**2 + (WRIST_RAD / LAG_RAD) ** 2))
    return np.where(np.isfinite(missed), missed, 0.0)  # a hand that is not known tells nothing


_FOREARM, _HAND = SEGMENTS.index("forearm"), SEGMENTS.index("hand")
