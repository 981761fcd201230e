"""Joint angles over time with how sure they are: what most measures begin from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.analysis.uncertainty import level_sds, skin_shares
from handstudio.arrays import Array
from handstudio.hand.angles import Angle, hand_angles, joint_index
from handstudio.hand.skeleton import PARENTS, SEGMENTS
from handstudio.hand_fit import fit_of
from handstudio.kinematics import angles_of, doubtful_segments, measured_angles
from handstudio.pipeline import Motion
from handstudio.setup import Setup

_BLOCK = 8192  # instants at a time: what is needed in between does not grow with the take

_AGAIN = "_mcp_deviation_ulnar"
"""A finger's deviation is its abduction again, under the sign of another school."""


@dataclass(frozen=True, slots=True, eq=False)
class AngleSeries:
    """Named joint angles of one hand.

    Attributes:
        time_s: From the take's first instant.
        names: Of the columns.
        angles: [rad]; NaN where there is none, or where it is in doubt.
        sd: As the filter has it at every instant [rad], inf where it does not tell.
        level_sd: How far each column may be off as a whole [rad]: zero, axes, mounting.
        share_sd: And by which share of itself: skin.
    """

    time_s: Float[Array, " n"]
    names: tuple[str, ...]
    angles: Float[Array, "n a"]
    sd: Float[Array, "n a"]
    level_sd: Float[Array, " a"]
    share_sd: Float[Array, " a"]

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def of(self, name: str) -> Float[Array, " n"]:
        """One angle [rad]."""
        column: Array = self.angles[:, self.names.index(name)]
        return column

    def sds(self, name: str) -> Float[Array, " n"]:
        """Standard uncertainty [rad] of an angle at every instant: filter, calibration, skin."""
        column = self.names.index(name)
        dragged = self.share_sd[column] * np.abs(self.angles[:, column])
        together: Array = np.sqrt(
            self.moment_sds(name) ** 2 + self.level_sd[column] ** 2 + dragged**2
        )
        return together

    def moment_sds(self, name: str) -> Float[Array, " n"]:
        """The filter's part of it, which differs from instant to instant."""
        told = self.sd[:, self.names.index(name)]
        return np.where(np.isfinite(told), told, FILTER_UNTOLD_SD)

    def sd_at(self, name: str, at: int) -> float:
        """The same at one instant."""
        return float(self.sds(name)[at])


def flexion_beside(name: str) -> str:
    """The flexion of the joint that an angle belongs to; itself, if it is that."""
    joints = {angle.name: angle.joint for angle in hand_angles()}
    return f"{joints[name]}_flexion"


FILTER_UNTOLD_SD = float(np.deg2rad(1.5))
"""What stands for the filter's own standard deviation where it tells none: RMSE of joint angles
by VQF with calibrated sensors (docs/accuracy.md, 1.1 deg in the mean, 2.2 the worst)."""


def series_of(setup: Setup, motion: Motion, start_us: int | None = None) -> AngleSeries:
    """Every angle between segments that carry a sensor; in doubt counts as unknown.

    Args:
        setup: What the motion was computed by.
        motion: All of a take, or a part.
        start_us: Device time of the take's first instant, where the motion is a part.

    Raises:
        LayoutError: the layout is not a hand's.
    """
    fit = fit_of(setup)
    angles = tuple(a for a in measured_angles(setup.layout) if not a.name.endswith(_AGAIN))
    sensors = [setup.layout.drivers[SEGMENTS[joint_index(angle.joint)]] for angle in angles]
    values = np.empty((len(motion), len(angles)))
    for at in range(0, len(motion), _BLOCK):
        part = motion[at : at + _BLOCK]
        block = angles_of(setup, part, angles, fit)
        block[_doubtful(setup, part, angles)] = np.nan
        values[at : at + _BLOCK] = block
    if start_us is None:
        start_us = int(motion.time_us[0]) if len(motion) else 0
    return AngleSeries(
        (np.asarray(motion.time_us) - start_us) * 1e-6,
        tuple(angle.name for angle in angles),
        values,
        np.asarray(motion.sd_rad[:, sensors, 1], dtype=float),
        level_sds(setup, angles),
        skin_shares(angles),
    )


def _doubtful(setup: Setup, motion: Motion, angles: tuple[Angle, ...]) -> Array:
    doubtful = doubtful_segments(setup, np.asarray(motion.doubt))
    children = [joint_index(angle.joint) for angle in angles]
    parents = [max(PARENTS[child], 0) for child in children]
    either: Array = doubtful[:, children] | doubtful[:, parents]
    return either
