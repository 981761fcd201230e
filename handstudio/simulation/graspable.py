"""Things to hold: shapes with their signed distance, and a thing in a hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3


@runtime_checkable
class Shape(Protocol):
    """A solid about its frame's origin."""

    def distance(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
        """From points in its frame to its surface [m]: negative inside."""
        ...


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball [m]."""

    radius_m: float

    def distance(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
        """From points in its frame to its surface [m]: negative inside."""
        distance: Array = np.linalg.norm(points, axis=-1) - self.radius_m
        return distance


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A round bar or a disk along z, its length in all [m]."""

    radius_m: float
    length_m: float

    def distance(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
        """From points in its frame to its surface [m]: negative inside."""
        beside = np.linalg.norm(points[..., :2], axis=-1) - self.radius_m
        beyond = np.abs(points[..., 2]) - 0.5 * self.length_m
        return _cornered(np.stack([beside, beyond], axis=-1))


@dataclass(frozen=True, slots=True)
class Box:
    """A card, a plate, a box: its lengths along x, y and z in all [m]."""

    size_m: tuple[float, float, float]

    def distance(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
        """From points in its frame to its surface [m]: negative inside."""
        return _cornered(np.abs(points) - 0.5 * np.asarray(self.size_m))


def _cornered(beyond: Float[Array, "*n d"]) -> Float[Array, "*n"]:
    """Distance to what is square: by how much a point is beyond each of its faces."""
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    distance: Array = outside + np.minimum(beyond.max(axis=-1), 0.0)
    return distance


@dataclass(frozen=True, slots=True, eq=False)
class HeldObject:
    """A thing in a hand, which does not move against the palm.

    Attributes:
        name: Of the grasp.
        shape: What it is.
        q_hand_object: Its attitude in the segment ``hand``.
        t_hand_object: Its origin's place there [m].
    """

    name: str
    shape: Shape
    q_hand_object: Float[Array, "4"]
    t_hand_object: Float[Array, "3"]

    def pose(
        self, q_world_segment: Float[Array, "n k 4"], t_world_joint: Float[Array, "n k 3"]
    ) -> tuple[Float[Array, "n 4"], Float[Array, "n 3"]]:
        """Its attitude and its origin's place in the world [m]."""
        hand = SEGMENTS.index("hand")
        q_world_hand = q_world_segment[:, hand]
        arm = so3.rotate(q_world_hand, self.t_hand_object)
        return so3.multiply(q_world_hand, self.q_hand_object), t_world_joint[:, hand] + arm
