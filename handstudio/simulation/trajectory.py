"""Joint turns between keyframes, smooth to the second derivative, with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Turns of every joint about x, z and y (intrinsic, as `hand.angles.compose` takes them).

    Attributes:
        turns: [rad]; the root's are the forearm's, relative to its attitude at the start.
        rates: Their first derivatives [rad/s].
        accelerations: Their second derivatives [rad/s²].
    """

    turns: Float[Array, "n k 3"]
    rates: Float[Array, "n k 3"]
    accelerations: Float[Array, "n k 3"]


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Keyframes of joint turns, each reached and left at rest.

    Between two keyframes every turn follows the minimum-jerk curve of Flash and Hogan (J.
    Neurosci. 5, 1985, 1688, eq. 3), ``s(u) = 10 u³ - 15 u⁴ + 6 u⁵``: velocity and acceleration
    are zero at both.

    Attributes:
        time_s: Instants of the keyframes [s], rising from 0.
        turns: Joint turns there [rad].
        periodic: The motion repeats after the last keyframe, which equals the first; otherwise
            it stays where it ended. Before 0 it repeats or stays likewise.

    Raises:
        ValueError: instants do not rise from 0, or a periodic motion does not close.
    """

    time_s: Float[Array, " m"]
    turns: Float[Array, "m k 3"]
    periodic: bool = False

    def __post_init__(self) -> None:
        if self.time_s[0] != 0.0 or np.any(np.diff(self.time_s) <= 0.0):
            raise ValueError("Keyframes must start at 0 s and each be later than the one before.")
        if self.periodic and not np.array_equal(self.turns[0], self.turns[-1]):
            raise ValueError("A periodic motion must end in the pose it began with.")

    @property
    def duration_s(self) -> float:
        """Instant of the last keyframe [s]: the period, where it repeats."""
        return float(self.time_s[-1])

    def at(self, time_s: Float[Array, " n"]) -> JointMotion:
        """Turns and their derivatives at any instants [s]."""
        if self.periodic:
            time_s = np.mod(time_s, self.duration_s)
        time_s = np.clip(time_s, 0.0, self.duration_s)
        last = len(self.time_s) - 2
        key = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, last)
        span = (self.time_s[key + 1] - self.time_s[key])[:, None, None]
        u = (time_s - self.time_s[key])[:, None, None] / span
        way = self.turns[key + 1] - self.turns[key]
        return JointMotion(
            turns=self.turns[key] + way * (u**3 * (10.0 - 15.0 * u + 6.0 * u**2)),
            rates=way * (30.0 * u**2 * (1.0 - u) ** 2 / span),
            accelerations=way * (60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / span**2),
        )
