"""Planes through three points (seed, 0046 to 0053): where a joint is looked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.trackers.estimate import functional_axis, rest_place
from handstudio.trackers.pair import Pair

_SIDE_M = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """Three points in a terminal's frame [m], not in a row.

    Raises:
        TrackError: they lie in a row.
    """

    p1: Float[Array, "3"]
    p2: Float[Array, "3"]
    p3: Float[Array, "3"]

    def __post_init__(self) -> None:
        one, other = self.sides
        area = np.linalg.norm(np.cross(one, other))
        if not area > 1e-3 * np.linalg.norm(one) * np.linalg.norm(other):
            raise TrackError(
                "Three points that should span a plane lie in a row.",
                "Choose points further apart, such as two along the finger and one beneath it.",
            )

    @property
    def corners(self) -> tuple[Array, Array, Array]:
        """The three points."""
        return self.p1, self.p2, self.p3

    @property
    def sides(self) -> Float[Array, "2 3"]:
        """``P2 - P1`` and ``P3 - P1``."""
        return np.stack([self.p2 - self.p1, self.p3 - self.p1])

    @property
    def normal(self) -> Float[Array, "3"]:
        """Unit normal (eq. 5)."""
        normal = np.cross(*self.sides)
        return np.asarray(normal / np.linalg.norm(normal))

    def at(self, w: Float[Array, "2"]) -> Float[Array, "3"]:
        """The point of (s, t) (eq. 4)."""
        return np.asarray(self.p1 + w @ self.sides)

    def foot(self, v: Float[Array, "3"]) -> Float[Array, "3"]:
        """Foot of the perpendicular from a point (eq. 7 to 9, with ``d = -n P1``)."""
        return np.asarray(v - self.normal * (self.normal @ (v - self.p1)))

    def coordinates(self, p: Float[Array, "3"]) -> Float[Array, "2"]:
        """(s, t) of a point of the plane; the seed's three cases (0071) at once."""
        return np.asarray(np.linalg.lstsq(self.sides.T, p - self.p1, rcond=None)[0])


def middle_plane(pair: Pair, width: Float[Array, "3"] | None = None) -> Plane:
    """The finger's middle plane at rest: square to its width, half way between the terminals.

    Args:
        pair: In whose upper terminal's frame it is.
        width: Across the finger in that frame; the mean flexion axis unless given.
    """
    across = functional_axis(pair)[0] if width is None else width / np.linalg.norm(width)
    along = pair.rest_t_upper_lower - across * (across @ pair.rest_t_upper_lower)
    along = along / np.linalg.norm(along)
    middle = rest_place(pair)
    return Plane(middle, middle + _SIDE_M * along, middle + _SIDE_M * np.cross(across, along))
