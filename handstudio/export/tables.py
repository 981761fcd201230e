"""What a motion is as a table: named columns with units, of angles, attitudes or places."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handstudio.arrays import Array
from handstudio.export.part import Part
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import FINGERS, JOINTS, SEGMENTS
from handstudio.kinematics import angles_of, relative_rotations, segment_attitudes
from handstudio.pipeline import Motion
from handstudio.setup import Setup

POINTS = (*(joint.name for joint in JOINTS), *(f"{finger}_tip" for finger in FINGERS))
"""The points that positions are of: joint centres, then fingertips."""


@dataclass(frozen=True, slots=True)
class Table:
    """The columns beside the time: their names, their values in any part of a motion, and how many
    digits of them mean something.
    """

    names: list[str]
    values: Callable[[Motion], Array]
    digits: int

    def rounded(self, motion: Motion) -> Array:
        """The values to the digits that mean something."""
        values: Array = np.round(self.values(motion), self.digits) + 0.0  # no minus before a zero
        return values


def table_of(part: Part) -> Table:
    """The table of a part's content."""
    match part.content:
        case "angles":
            return _angles(part)
        case "segments":
            return _segments(part.setup)
        case "positions":
            return _positions(part)
        case _:
            return _orientations(part.setup)


def points_mm(pose: Pose) -> Array:
    """The points of a pose in the order of `POINTS` [mm], (n, p, 3)."""
    points: Array = np.concatenate([pose.t_world_joint, pose.t_world_tip], axis=1) * 1e3
    return points


def _angles(part: Part) -> Table:
    """Degrees."""
    angles = part.angles
    return Table(
        [f"{angle.name}_deg" for angle in angles],
        lambda motion: np.rad2deg(angles_of(part.setup, motion, angles)),
        4,
    )


def _positions(part: Part) -> Table:
    """Millimetres."""

    def values(motion: Motion) -> Array:
        return points_mm(part.pose(motion)).reshape(len(motion), -1)

    return Table([f"{point}_{axis}_mm" for point in POINTS for axis in "xyz"], values, 3)


def _orientations(setup: Setup) -> Table:
    """Sensors in the world, then children in their parents across joints: quaternions."""

    def values(motion: Motion) -> Array:
        relative = relative_rotations(setup.layout, motion.q_world_sensor)
        across = [q[:, None] for q in relative.values()]
        every: Array = np.concatenate([motion.q_world_sensor, *across], axis=1)
        return every.reshape(len(motion), -1)

    things = [*setup.layout.names, *(joint.name for joint in setup.layout.instrumented_joints)]
    return Table(_quaternions(things), values, 7)


def _segments(setup: Setup) -> Table:
    """Segments in the world: quaternions."""

    def values(motion: Motion) -> Array:
        return segment_attitudes(setup, motion.q_world_sensor).reshape(len(motion), -1)

    return Table(_quaternions(SEGMENTS), values, 7)


def _quaternions(things: list[str] | tuple[str, ...]) -> list[str]:
    return [f"{thing}_q{part}" for thing in things for part in "wxyz"]
