"""Segment frames from functional axes and links (5.1, 5.2), and the skeleton they make.

x is the flexion axis of a segment's own joint, z stands on it and on the bone, y is the third. The
bone is the link to the segment's far end; in fingers it is what all their links and the flat hand
tell together (`lying`). Zero is the flat hand: how a segment lies in its parent then.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.axes import JointAxis
from handstudio.calibration.chain import Chain
from handstudio.calibration.lying import bones
from handstudio.calibration.swings import Swings
from handstudio.hand.skeleton import DISTALS, FINGERS, JOINTS, PARENTS, SEGMENTS, ULNAR, Skeleton
from handstudio.maths import so3


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Segments in the order of the skeleton.

    Attributes:
        driver: Sensor that defines each segment; None: it has none, and is as in mean proportions.
        q_sensor_segment: Attitude of each segment in that sensor.
        q_parent_rest: Attitude of each segment in its parent at the flat hand.
        t_parent_joint: Centre of each segment's joint in its parent [m].
        covariance: Of that [m²].
        t_distal_tip: Fingertips in the distal segments [m].
        tip_measured: Whether a sensor told where the tip is.
    """

    driver: tuple[int | None, ...]
    q_sensor_segment: Float[Array, "k 4"]
    q_parent_rest: Float[Array, "k 4"]
    t_parent_joint: Float[Array, "k 3"]
    covariance: Float[Array, "k 3 3"]
    t_distal_tip: Float[Array, "5 3"]
    tip_measured: tuple[bool, ...]


def framed(
    swings: Swings, axes: Mapping[str, JointAxis], chain: Chain, skeleton: Skeleton
) -> Frames:
    """Lay frames into the segments.

    Args:
        swings: The course, sensors freed of rocking.
        axes: Flexion axes by joint.
        chain: Joint centres.
        skeleton: Mean proportions, for what carries no sensor.
    """
    drivers = tuple(swings.drivers(joint.name)[1] for joint in JOINTS)
    q_sensor_segment = np.tile(so3.IDENTITY, (len(JOINTS), 1))
    lying = bones(swings, axes, chain)
    for k, sensor in enumerate(drivers):
        if sensor is not None and not _is_hands(swings, k):
            bone = lying.get(SEGMENTS[k])
            far = _far_end(swings, chain, k, sensor) if bone is None else bone
            q_sensor_segment[k] = _frame(swings, axes, k, sensor, far)
        elif sensor is not None:
            q_sensor_segment[k] = q_sensor_segment[PARENTS[k]]
    rest = skeleton.q_parent_rest.copy()
    joint, covariance = skeleton.t_parent_joint.copy(), np.zeros((len(JOINTS), 3, 3))
    for k, parent in enumerate(PARENTS):
        above, here = drivers[parent], drivers[k]
        if parent < 0 or above is None:
            continue
        q_segment_sensor = so3.conjugate(q_sensor_segment[parent])
        link, spread = chain.link(JOINTS[k].name)
        turn = so3.to_matrix(q_segment_sensor)
        joint[k], covariance[k] = turn @ link, turn @ spread @ turn.T
        if SEGMENTS[parent] in lying:  # the next joint is where its bone ends
            joint[k] = joint[k][0], np.hypot(joint[k][1], joint[k][2]), 0.0
        if here is not None:
            base = so3.multiply(swings.q_flat(above), q_sensor_segment[parent])
            mine = so3.multiply(swings.q_flat(here), q_sensor_segment[k])
            rest[k] = so3.multiply(so3.conjugate(base), mine)
    tips, measured = _tips(swings, chain, skeleton, joint, q_sensor_segment)
    drivers = tuple(None if _is_hands(swings, k) else s for k, s in enumerate(drivers))
    return Frames(drivers, q_sensor_segment, rest, joint, covariance, tips, measured)


_TIP_BOARD_M = 0.009  # height of the board of the sensor on the fingertip above the bone


def turning(swings: Swings, k: int) -> str:
    """The joint whose flexion a segment's x lies along: its own, or the wrist."""
    unhinged = SEGMENTS[k] == ULNAR and swings.layout.hand_type != 3
    return JOINTS[PARENTS[k] if unhinged else k].name


def _is_hands(swings: Swings, k: int) -> bool:
    """Whether a segment is one with the hand."""
    return SEGMENTS[k] == ULNAR and swings.layout.hand_type == 1


def _frame(swings: Swings, axes: Mapping[str, JointAxis], k: int, sensor: int, far: Array) -> Array:
    axis = axes.get(turning(swings, k))
    x = np.array([1.0, 0.0, 0.0]) if axis is None else axis.seen_from(swings, sensor)
    z = np.cross(x, far)
    z = z / np.linalg.norm(z)
    return so3.from_matrix(np.stack([x, np.cross(z, x), z], axis=-1))


def _far_end(swings: Swings, chain: Chain, k: int, sensor: int) -> Array:
    """Towards the farthest joint a segment carries, in its sensor's frame."""
    links = [chain.link(j.name)[0] for j in JOINTS if j.parent == SEGMENTS[k]]
    if links:
        return max(links, key=lambda link: float(np.linalg.norm(link)))
    before = PARENTS[k]  # a last bone: in line with the one before, the hand lying flat
    above = swings.drivers(JOINTS[k].name)[0]
    if above is None or SEGMENTS[before] in ("forearm", "hand"):
        return np.array([0.0, 1.0, 0.0])
    in_world = so3.rotate(swings.q_flat(above), chain.link(JOINTS[k].name)[0])
    return so3.rotate(so3.conjugate(swings.q_flat(sensor)), in_world)


def _tips(
    swings: Swings, chain: Chain, skeleton: Skeleton, joint: Array, q_sensor_segment: Array
) -> tuple[Array, tuple[bool, ...]]:
    """By the sensor on a fingertip, else as long as the bone before lets expect."""
    tips, measured = skeleton.t_distal_tip.copy(), []
    for finger, name in enumerate(DISTALS):
        k = SEGMENTS.index(name)
        extra = [s for s in swings.alive if swings.layout.sensors[s].sensor == "Tip"]
        mine = [s for s in extra if swings.layout.sensors[s].segment == name]
        driver = swings.drivers(JOINTS[k].name)[1]
        if mine and driver is not None:
            here = so3.multiply(swings.q_flat(driver), q_sensor_segment[k])
            in_world = so3.rotate(swings.q_flat(mine[0]), chain.sensor(mine[0])[0])
            tip = so3.rotate(so3.conjugate(here), in_world)
            tips[finger] = tip - [0.0, 0.0, _TIP_BOARD_M]
        else:
            usual = np.linalg.norm(skeleton.t_parent_joint[k])
            tips[finger] = tips[finger] * (np.linalg.norm(joint[k]) / usual)
        measured.append(bool(mine))
    assert len(tips) == len(FINGERS)
    return tips, tuple(measured)
