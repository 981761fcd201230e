"""What a method says of a joint: a point in both terminals' frames, an axis, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.trackers.pair import Pair
from handstudio.trackers.poses import placed

UNSEEN_SD_M = 0.02
"""What stands for not knowing: a finger is not wider."""


@dataclass(frozen=True, slots=True, eq=False)
class JointEstimate:
    """A joint, as a method found it.

    Attributes:
        method: Which.
        p_upper: The joint's centre in the upper terminal's frame, the seed's P_U [m].
        p_lower: In the lower terminal's, P_L [m].
        upper_covariance: Of the first [m²].
        lower_covariance: Of the second.
        frames: How many instants were used.
        axis_upper: Flexion axis in the upper terminal's frame; NaN where the method has none.
        axis_sd_rad: How well its direction is known; NaN likewise.
        drift_upper: How ``p_upper`` wanders with flexion [m/rad], counted from ``mean_flexion``;
            zero for methods that let it rest.
        drift_lower: And ``p_lower``.
        mean_flexion: About which both are given [rad].
    """

    method: str
    p_upper: Float[Array, "3"]
    p_lower: Float[Array, "3"]
    upper_covariance: Float[Array, "3 3"]
    lower_covariance: Float[Array, "3 3"]
    frames: int
    axis_upper: Float[Array, "3"]
    axis_sd_rad: float
    drift_upper: Float[Array, "3"]
    drift_lower: Float[Array, "3"]
    mean_flexion: float = 0.0

    @property
    def sd_m(self) -> float:
        """Standard deviation of the centre, both terminals' and all directions' together [m]."""
        both = np.trace(self.upper_covariance) + np.trace(self.lower_covariance)
        return float(np.sqrt(0.5 * both))


def at_each(estimate: JointEstimate, pair: Pair) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
    """P_U and P_L at every instant, both in the upper terminal's frame [m]."""
    n = len(pair)
    upper = np.broadcast_to(estimate.p_upper, (n, 3))
    lower = np.broadcast_to(estimate.p_lower, (n, 3))
    if estimate.drift_upper.any() or estimate.drift_lower.any():
        beyond = (pair.turn @ estimate.axis_upper - estimate.mean_flexion)[:, None]
        upper = upper + beyond * estimate.drift_upper
        lower = lower + beyond * estimate.drift_lower
    return upper, placed(pair.q_upper_lower, pair.t_upper_lower, lower)


def apart_m(estimate: JointEstimate, pair: Pair) -> float:
    """How far P_U is from P_L, in the mean over all frames [m]: the seed's measure (0105)."""
    upper, lower = at_each(estimate, pair)
    return float(np.mean(np.linalg.norm(upper - lower, axis=1)))


def independent(left: Float[Array, "n k"]) -> float:
    """How many observations residuals of consecutive frames are worth.

    ``n / (1 + 2 sum of autocorrelations)`` up to the first that is not positive: what leads a
    finger off a model lasts for a swing and not for a frame.
    """
    n = len(left)
    left = left - left.mean(axis=0)
    spectrum = np.abs(np.fft.rfft(left, 2 * n, axis=0)) ** 2
    correlation = np.fft.irfft(spectrum.sum(axis=1))[:n]
    if correlation[0] <= 0.0:
        return float(n)
    correlation = correlation / correlation[0]
    ends = np.flatnonzero(correlation <= 0.0)
    until = ends[0] if len(ends) else n
    return float(max(1.0, n / (1.0 + 2.0 * correlation[1:until].sum())))


def no_axis() -> tuple[Array, float]:
    """For methods that find a point only."""
    return np.full(3, np.nan), float("nan")


def functional_axis(pair: Pair) -> tuple[Float[Array, "3"], float, Float[Array, " n"]]:
    """Mean flexion axis in the upper terminal's frame, its sd [rad], flexion of each frame [rad].

    Extension is where the finger was straight, so turns are positive.
    """
    turn = pair.turn
    _, singular, axes = np.linalg.svd(turn, full_matrices=False)
    axis = axes[0]
    flexion = turn @ axis
    if np.sum(flexion) < 0.0:
        axis, flexion = -axis, -flexion
    count = independent(turn - flexion[:, None] * axis)
    sd = float(singular[1] / max(singular[0], 1e-12) / np.sqrt(count))
    return np.asarray(axis), sd, np.asarray(flexion)


def rest_place(pair: Pair) -> Float[Array, "3"]:
    """Half way between the terminals at rest, in the upper one's frame: a rough guess [m]."""
    return np.asarray(0.5 * pair.rest_t_upper_lower)


def in_lower(pair: Pair, p_upper: Float[Array, "3"]) -> Float[Array, "3"]:
    """A point of the upper terminal's frame in the lower one's, at rest."""
    back = so3.conjugate(pair.rest_q_upper_lower)
    return so3.rotate(back, p_upper - pair.rest_t_upper_lower)
