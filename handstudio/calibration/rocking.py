"""Boards that rock on skin: how much a sensor pitches for what a joint beside it bends.

A joint that bends pitches the boards on both its sides; the boards beyond stay as they are on
their bones. So while one joint swings and its neighbours are still, the turn of a board against the
one beyond it is its own rocking. Where the joint between moves along by nature (a DIP with its PIP)
accelerations tell: seen from a board that rocks the link to the next joint leans as the joint
bends, and the search for the centres finds by how much (`leaning`). Where no board lies beyond it
cannot be told, and none is assumed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.axes import JointAxis
from handstudio.calibration.chain import Chain
from handstudio.calibration.swings import Swings, relative_turn
from handstudio.hand.skeleton import JOINTS, Joint
from handstudio.maths import so3

Rocking: TypeAlias = dict[tuple[int, str], float]
"""Turn of a sensor about a joint's axis per turn of the joint, by sensor and joint."""

_MOST = 0.15  # rad/rad: more is another joint that moves along
_LEAST_RANGE = np.deg2rad(25.0)


def rocking(swings: Swings, axes: Mapping[str, JointAxis]) -> Rocking:
    """How sensors rock, as far as it can be told from the swings of single joints."""
    found: Rocking = {}
    for joint in JOINTS:
        if joint.name not in axes or joint.parent is None:
            continue
        parent, child = swings.drivers(joint.name)
        beyond = [j for j in JOINTS if j.parent == joint.child and not _follows(j)]
        slopes = [s for j in beyond if (s := _slope(swings, axes[joint.name], j)) is not None]
        if child is not None and slopes:
            _note(found, child, joint.name, -float(np.median(slopes)))
        above = next(j for j in JOINTS if j.child == joint.parent)
        slope = None if _follows(joint) else _slope(swings, axes[joint.name], above)
        if parent is not None and slope is not None:
            _note(found, parent, joint.name, slope)
    return found


def leaning(swings: Swings, axes: Mapping[str, JointAxis], chain: Chain) -> Rocking:
    """How boards rock by how the links in them lean; of links that were let to."""
    found: Rocking = {}
    for joint in JOINTS:
        above = next((j for j in JOINTS if j.child == joint.parent), None)
        lean, driver = chain.lean(joint.name), swings.drivers(joint.name)[0]
        if above is None or above.name not in axes or lean is None or driver is None:
            continue
        # a board that turns one way sees what lies fixed on the bone turn the other way
        turned = np.cross(axes[above.name].seen_from(swings, driver), chain.link(joint.name)[0])
        _note(found, driver, above.name, -float(lean @ turned / (turned @ turned)))
    return found


def steadied(swings: Swings, axes: Mapping[str, JointAxis], found: Rocking) -> Swings:
    """The same course as if boards did not rock: frames that stay where they are on the bone."""
    q, gyr, dgyr, acc = (
        x.copy() for x in (swings.q_world_sensor, swings.gyr, swings.dgyr, swings.acc)
    )
    for sensor in {sensor for sensor, _ in found}:
        tilt, rate, more = (np.zeros((len(q), 3)) for _ in range(3))
        for (which, joint), share in found.items():
            if which == sensor:
                axis = share * axes[joint].seen_from(swings, sensor)
                angle = axes[joint].angle
                tilt += angle[0][:, None] * axis
                rate += angle[1][:, None] * axis
                more += angle[2][:, None] * axis
        q[:, sensor] = so3.multiply(q[:, sensor], so3.exp(-tilt))
        turned = so3.exp(tilt)
        gyr[:, sensor] = so3.rotate(turned, gyr[:, sensor] - rate)
        dgyr[:, sensor] = so3.rotate(turned, dgyr[:, sensor] - more)
        acc[:, sensor] = so3.rotate(turned, acc[:, sensor])
    return replace(swings, q_world_sensor=q, gyr=gyr, dgyr=dgyr, acc=acc)


def _follows(joint: Joint) -> bool:
    return joint.name.endswith("_dip")


def _note(found: Rocking, sensor: int, joint: str, share: float) -> None:
    if abs(share) <= _MOST:
        found[sensor, joint] = share


def _slope(swings: Swings, axis: JointAxis, still: Joint) -> float | None:
    """Turn of a joint that should be still, about another's axis, per turn of that one."""
    turn = relative_turn(swings, still.name)
    trials = swings.of_joint(axis.joint, flexion=True)
    parent, child = swings.drivers(still.name)
    if turn is None or not trials or parent == child:
        return None
    n = axis.in_world if parent is None else axis.seen_from(swings, parent)
    if parent is None:  # the world is no sensor: the axis as it lies in this swing
        return None
    sums = np.zeros(2)
    for swing in trials:
        x, y = _free(axis.angle[0][swing.moving]), _free(turn[swing.moving] @ n)
        if np.ptp(x) < _LEAST_RANGE:
            return None
        sums += [x @ y, x @ x]
    return float(sums[0] / sums[1])


def _free(x: Array) -> Array:
    """Without mean and trend."""
    t = np.linspace(-1.0, 1.0, len(x))
    x = x - x.mean()
    free: Array = x - t * (x @ t) / (t @ t)
    return free
