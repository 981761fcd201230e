"""Frames in which the axis of a joint is steady (seed, 0075 to 0091; claims 4 and 5).

The lower segment's turn against rest is written as axis and angle in the room's axes at rest,
``R_ULS(i) = R_US(i)^-1 R_LS(i)`` (eq. 10 to 12 with the offsets taken at rest, where both are the
identity), the axis' sign such that its y is positive. Frames are sorted by y into a hundred equal
classes, and those of the fullest are kept. Frames of small turns are dropped first: there the axis
means nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.pair import LEAST_FRAMES, Pair

CLASSES = 100
SMALL_TURN = float(np.deg2rad(10.0))
"""Ours: with a tenth of a degree of noise the axis of such a turn is off by half a degree."""

WIDTH = np.array([0.0, 1.0, 0.0])
"""Across the finger, in the room's axes at rest: the seed's y."""


@dataclass(frozen=True, slots=True, eq=False)
class SteadyAxis:
    """Axes of all frames, and which are alike.

    Attributes:
        axes: Unit axes in the room's axes at rest, their share along the width positive; NaN
            where the turn was small.
        angle: Of each turn [rad].
        along: Share of each axis along the width, 0 to 1; NaN likewise.
        counts: Frames in each of the classes.
        fullest: Index of the class that holds most.
        used: Frames of that class.
    """

    axes: Float[Array, "n 3"]
    angle: Float[Array, " n"]
    along: Float[Array, " n"]
    counts: Int64[Array, " c"]
    fullest: int
    used: Bool[Array, " n"]

    @property
    def between(self) -> tuple[float, float]:
        """From where to where the fullest class goes."""
        classes = len(self.counts)
        return self.fullest / classes, (self.fullest + 1) / classes

    def share(self, low: float) -> float:
        """Share of frames, small turns aside, whose axis has at least so much along the width."""
        along = self.along[np.isfinite(self.along)]
        return float(np.mean(along >= low))


def steady_axis(
    pair: Pair,
    *,
    width: Float[Array, "3"] = WIDTH,
    classes: int = CLASSES,
    small: float = SMALL_TURN,
) -> SteadyAxis:
    """Sort frames by how far their axis lies along the finger's width.

    Args:
        pair: A joint bent.
        width: Across the finger, in the room's axes at rest.
        classes: How many, from 0 to 1.
        small: Turns below it [rad] are left out.

    Raises:
        TrackError: the joint hardly turned.
    """
    turn = so3.rotate(pair.rest_q_room_upper, pair.turn)
    angle = np.linalg.norm(turn, axis=1)
    large = angle >= small
    if np.count_nonzero(large) < LEAST_FRAMES:
        raise TrackError(
            "The joint was bent by more than {small:.0f} deg in {count} frames; {least} are "
            "needed.",
            "Bend it further, for 20 s, and check that each terminal sits on its own phalanx.",
            small=float(np.rad2deg(small)),
            count=int(np.count_nonzero(large)),
            least=LEAST_FRAMES,
        )
    axes = np.where(large[:, None], turn / np.maximum(angle, 1e-9)[:, None], np.nan)
    along = axes @ (width / np.linalg.norm(width))
    axes = axes * np.where(along < 0.0, -1.0, 1.0)[:, None]
    along = np.abs(along)
    which = np.full(len(along), -1)
    which[large] = np.minimum((along[large] * classes).astype(int), classes - 1)
    counts = np.bincount(which[large], minlength=classes)
    fullest = int(np.argmax(counts))
    return SteadyAxis(axes, angle, along, counts, fullest, which == fullest)
