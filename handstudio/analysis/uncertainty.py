"""How far an angle may be off as a whole, whatever the filter says of the moment.

Parts, each a standard deviation, independent and summed in squares: where zero is, how well the
joint's axis is known, how the board sits on its segment, and what skin does beneath it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.angles import FLEXION, Angle
from handstudio.setup import Setup

ZERO_SD = float(np.deg2rad(1.0))
"""A flat hand on a table, held twice."""

SKIN_SD = float(np.deg2rad(1.0))
"""What skin turns a board off its bone, beyond what a calibration takes off."""

SKIN_SHARE, SKIN_SHARE_LAST = 0.03, 0.07
"""What skin drags along a board of what its joint turns, beyond what a calibration takes off; the
second at the last joint of a finger, where no joint beyond tells of it. Chosen on virtual people 1
and 2 with typical imperfections and calibrations of their own (docs/measures.md)."""

AXIS_SD = float(np.deg2rad(4.0))
"""Of a joint whose axis no step of the course has shown."""

NOMINAL_SD = float(np.deg2rad(8.0))
"""Without a calibration: how a board is tilted on its segment, two of them a joint."""

OFF_AXIS_SHARE = 0.5
"""An axis that is off bends flexion by less than the turns beside it."""

DETECTABLE = 1.96 * np.sqrt(2.0)
"""Times the standard error of one measurement: what 95 of 100 unchanged pairs stay below."""

LEAST_SEM = float(np.deg2rad(2.0))
"""No visit to visit error is smaller: persons differ from themselves, gloves sit otherwise.
Published standard errors of 3-D capture of finger joints are 2 to 4 deg."""


def level_sds(setup: Setup, angles: Sequence[Angle]) -> Float[Array, " a"]:
    """Standard deviation [rad] of each angle's level by calibration, mounting and skin."""
    subject = setup.subject
    if subject is None:
        return np.full(len(angles), float(np.hypot(NOMINAL_SD, SKIN_SD)))
    known = {axis.joint: axis.sd_rad for axis in subject.axes}
    out = []
    for angle in angles:
        axis = known.get(angle.joint, AXIS_SD) * (1.0 if angle.turn != FLEXION else OFF_AXIS_SHARE)
        out.append(float(np.linalg.norm([ZERO_SD, axis, SKIN_SD])))
    return np.array(out)


def skin_shares(angles: Sequence[Angle]) -> Float[Array, " a"]:
    """Standard deviation of each angle as a share of what the joint is turned."""
    last = [angle.joint.endswith(("_dip", "_ip")) for angle in angles]
    return np.where(last, SKIN_SHARE_LAST, SKIN_SHARE)


def detectable(sd: float, floor: float = LEAST_SEM) -> float:
    """Minimal detectable change between two such measurements, in the unit of both."""
    return float(DETECTABLE * max(sd, floor))
