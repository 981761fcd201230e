"""What a filter over several sensors knows of the mechanism that they sit on.

Sensors are nodes of a tree; the edge above a sensor is the joint that joins its segment to that of
its parent sensor. Where no joint with sensors on both sides is, a sensor has no parent and stands
for itself. Everything is seen from sensors, so that no segment frame is needed here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from handstudio.arrays import Array
from handstudio.maths import so3

FREE = 3
"""Axes of a joint that nothing is known of but where its centre is."""

AS_SHIPPED, CALIBRATED = 0.015, 0.003
"""Of a gyroscope's rate: scale and axes as shipped (data sheets: 1 to 3 %), and what calibration
leaves, with timing."""

_BARE_LEVER_SD_M = 0.0  # gravity is taken at the sensor itself


@dataclass(frozen=True, slots=True, eq=False)
class Mechanism:
    """Sensors, and the joints between them.

    A joint's frame is attached to both its sides and is the same in both at the flat hand: x is the
    flexion axis, y along the bone, z dorsal. A hinge keeps the two x the same, a joint of two axes
    keeps the parent's x square to the child's z.

    Attributes:
        parent: The sensor on the other side of the joint; -1: none.
        axes: How many the joint turns about, 1 to 3.
        q_parent_joint: The joint's frame in the parent sensor.
        q_sensor_joint: The joint's frame in the sensor itself.
        t_parent_joint: The joint's centre from the parent sensor, in its frame [m].
        t_sensor_joint: The joint's centre from the sensor, in its frame [m]; of a sensor without
            parent the point that is taken to move least (the elbow).
        axis_sd_rad: How well the axes are known, skin included.
        lever_sd_m: How well the centre is known.
        heading_rad: By how much a sensor's heading by compass is turned to agree with the others
            (4.21).
        chain_root: Which sensor of the root's segment stands first in the chain to a sensor, for
            filters over chains; -1: the one that `parent` leads to.
        range_rad: Between which turns about its flexion axis (x), and then about its second (z),
            the joint can be; infinite where nothing is known.
        gyr_share: What gyroscopes err, as a share of the rate.
        mean_rates: A rate is the mean since the sample before, as of sensors that sample faster
            than they tell; else it is that of the instant.
    """

    parent: Int[Array, " s"]
    axes: Int[Array, " s"]
    q_parent_joint: Float[Array, "s 4"]
    q_sensor_joint: Float[Array, "s 4"]
    t_parent_joint: Float[Array, "s 3"]
    t_sensor_joint: Float[Array, "s 3"]
    axis_sd_rad: Float[Array, " s"]
    lever_sd_m: Float[Array, " s"]
    heading_rad: Float[Array, " s"]
    chain_root: Int[Array, " s"]
    range_rad: Float[Array, "s 2 2"]
    gyr_share: float = AS_SHIPPED
    mean_rates: bool = False

    @property
    def sensors(self) -> int:
        """How many there are."""
        return len(self.parent)

    @property
    def order(self) -> Int[Array, " s"]:
        """All sensors, each after its parent."""
        depth = np.zeros(self.sensors, dtype=np.int64)
        for sensor in range(self.sensors):
            at = int(self.parent[sensor])
            while at >= 0:
                depth[sensor] += 1
                at = int(self.parent[at])
        return np.argsort(depth, kind="stable")


def bare(sensors: int) -> Mechanism:
    """Sensors that nothing joins."""
    return Mechanism(
        parent=np.full(sensors, -1),
        axes=np.full(sensors, FREE),
        q_parent_joint=np.tile(so3.IDENTITY, (sensors, 1)),
        q_sensor_joint=np.tile(so3.IDENTITY, (sensors, 1)),
        t_parent_joint=np.zeros((sensors, 3)),
        t_sensor_joint=np.zeros((sensors, 3)),
        axis_sd_rad=np.full(sensors, np.pi),
        lever_sd_m=np.full(sensors, _BARE_LEVER_SD_M),
        heading_rad=np.zeros(sensors),
        chain_root=np.full(sensors, -1),
        range_rad=np.tile([-np.inf, np.inf], (sensors, 2, 1)),
    )
