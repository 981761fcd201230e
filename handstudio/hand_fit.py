"""The hand that a setup describes, and the mechanism that its sensors sit on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.mounting import nominal_mounting, nominal_places
from handstudio.calibration.subject import SubjectCalibration
from handstudio.errors import LayoutError
from handstudio.fusion.mechanism import AS_SHIPPED, CALIBRATED, FREE, Mechanism, bare
from handstudio.hand.angles import ROTATION, hand_angles, sign_of
from handstudio.hand.possible import possible
from handstudio.hand.skeleton import (
    FINGERS,
    JOINTS,
    PARENTS,
    SEGMENTS,
    WRIST_ULNAR,
    HandSide,
    Skeleton,
    joints_of,
    nominal_skeleton,
)
from handstudio.hand.skin import Skin, skin_of
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.setup import JointGeometry, Setup


@dataclass(frozen=True, slots=True, eq=False)
class HandFit:
    """What is known of this hand and of how the glove sits on it.

    Attributes:
        skeleton: Joint centres, segment frames, fingertips.
        q_sensor_segment: Attitude of each sensor's segment in the sensor.
        skin: How boards move on the bones; None: nothing is known of it.
    """

    skeleton: Skeleton
    q_sensor_segment: Float[Array, "s 4"]
    skin: Skin | None = None


def fit_of(setup: Setup) -> HandFit:
    """The hand a setup describes: the calibrated one, else mean proportions of its length.

    The same object for the same setup, as long as it is among those asked about last.

    Raises:
        LayoutError: the layout is not a hand's.
    """
    return _fit(_Same(setup))


def fit_of_calibration(calibration: SubjectCalibration, layout: Layout) -> HandFit:
    """The hand a calibration describes, on a glove of this layout.

    A sensor that the calibration does not know sits as the maker meant it.
    """
    known = {segment.name: segment for segment in calibration.segments}
    tips = {tip.finger: tip for tip in calibration.tips}
    nominal = nominal_skeleton(calibration.side, calibration.hand_length_m, calibration.hand_type)
    joint, rest = nominal.t_parent_joint.copy(), nominal.q_parent_rest.copy()
    for index, name in enumerate(SEGMENTS):
        if name in known:
            joint[index] = known[name].t_parent_joint
            rest[index] = known[name].q_parent_rest
    ends = nominal.t_distal_tip.copy()
    for index, finger in enumerate(FINGERS):
        if finger in tips:
            ends[index] = tips[finger].t_distal_tip
    q_sensor_segment = nominal_mounting(layout)
    for sensor, place in enumerate(layout.sensors):
        segment = known.get(place.segment)
        if segment is not None and segment.sensor == place.sensor:
            q_sensor_segment[sensor] = segment.q_sensor_segment
    skeleton = Skeleton(calibration.side, joint, rest, ends)
    return HandFit(skeleton, q_sensor_segment, skin_of_calibration(calibration, layout))


def skin_of_calibration(calibration: SubjectCalibration, layout: Layout) -> Skin:
    """What a calibration tells of skin, as far as this layout's sensors are the ones it knows."""
    names, drivers = layout.names, layout.drivers
    on = {
        s.sensor: s.name
        for s in calibration.segments
        if s.name in drivers and names[drivers[s.name]] == s.sensor
    }
    both = joints_of(layout.hand_type)
    joints = {joint.name for joint in both if {joint.parent, joint.child} <= set(on.values())}
    rocking = [(on[r.sensor], r.joint, r.share) for r in calibration.rocking if r.sensor in on]
    swung = {axis.joint for axis in calibration.axes} & joints
    return skin_of([rock for rock in rocking if rock[1] in joints], by_hand="wrist" in swung)


def mechanism_of(setup: Setup) -> Mechanism:
    """What joins the sensors of a setup; kept for the setups asked about last."""
    return _mechanism(_Same(setup))


class _Same:
    """A setup by identity: to compare calibrations costs more than to fuse a sample."""

    __slots__ = ("setup",)

    def __init__(self, setup: Setup) -> None:
        self.setup = setup

    def __hash__(self) -> int:
        return id(self.setup)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.setup is self.setup


@lru_cache(maxsize=16)
def _fit(same: _Same) -> HandFit:
    setup = same.setup
    if not setup.layout.is_hand:
        raise LayoutError(
            "There is no hand in this recording.",
            "{why} {why.remedy}",
            why=setup.layout.no_hand,
        )
    if setup.subject is not None:
        return fit_of_calibration(setup.subject, setup.layout)
    side: HandSide = "left" if setup.layout.side == "left" else "right"
    skeleton = nominal_skeleton(side, setup.hand.hand_length_m, setup.layout.hand_type)
    return HandFit(skeleton, nominal_mounting(setup.layout))


@lru_cache(maxsize=16)
def _mechanism(same: _Same) -> Mechanism:
    setup = same.setup
    share = AS_SHIPPED if setup.sensors is None else CALIBRATED
    return replace(_joined(setup), gyr_share=share, mean_rates=setup.mean_rates)


def _joined(setup: Setup) -> Mechanism:
    heading = np.array(setup.heading_rad or (0.0,) * len(setup.layout.sensors))
    if not setup.layout.is_hand:
        return _of_joints(setup.layout, setup.joints, heading)
    calibration = setup.subject
    fit = fit_of(setup)
    places = nominal_places(setup.layout, fit.skeleton)
    if calibration is not None:
        places = _calibrated_places(calibration, setup.layout, fit, places)
    return hand_mechanism(setup.layout, fit, places, heading, calibration)


def _of_joints(layout: Layout, joints: Sequence[JointGeometry], heading: Array) -> Mechanism:
    """What joins sensors that are on no hand, as far as the setup tells."""
    found = replace(bare(len(layout.sensors)), heading_rad=heading)
    known = {joint.joint: joint for joint in joints}
    for joint in layout.instrumented_joints:
        if joint.name not in known:
            continue
        given = known[joint.name]
        parent, child = layout.drivers[joint.parent], layout.drivers[joint.child]
        found.parent[child] = parent
        found.t_parent_joint[child] = given.t_parent_joint_m
        found.t_sensor_joint[child] = given.t_child_joint_m
        found.lever_sd_m[child] = given.sd_m
        found.t_sensor_joint[parent] = 0.0
        if given.parent_axis is not None and given.child_axis is not None:
            found.axes[child] = joint.axes
            found.axis_sd_rad[child] = given.axis_sd_rad
            ends = [_X, _X if joint.axes == 1 else _Z]
            found.q_parent_joint[child] = _taking(ends[0], np.array(given.parent_axis))
            found.q_sensor_joint[child] = _taking(ends[1], np.array(given.child_axis))
    return found


_X, _Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def _taking(a: Array, b: Array) -> Array:
    """A rotation that takes one unit vector to another."""
    if a @ b < -1.0 + 1e-9:
        return so3.exp(np.pi * np.array([0.0, 1.0, 0.0]))  # square to both x and z
    return so3.normalize(np.concatenate([[1.0 + a @ b], np.cross(a, b)]))


def hand_mechanism(
    layout: Layout,
    fit: HandFit,
    t_segment_sensor: Float[Array, "s 3"],
    heading_rad: Float[Array, " s"],
    calibration: SubjectCalibration | None = None,
) -> Mechanism:
    """Joints of a hand as its sensors see them.

    A second sensor on a segment stands for itself: skin moves it otherwise than the first, and
    what both feel at their joint says too little. Without a calibration axes and places are those
    of mean proportions.
    """
    found = replace(bare(len(layout.sensors)), heading_rad=heading_rad)
    drivers = layout.drivers
    joint_before = {joint.child: joint for joint in layout.joints}
    known = {} if calibration is None else {axis.joint: axis.sd_rad for axis in calibration.axes}
    for sensor, place in enumerate(layout.sensors):
        q_sensor_segment = fit.q_sensor_segment[sensor]
        found.q_sensor_joint[sensor] = q_sensor_segment
        found.t_sensor_joint[sensor] = so3.rotate(q_sensor_segment, -t_segment_sensor[sensor])
        found.lever_sd_m[sensor] = _LEVER_SD_M[calibration is not None]
        found.chain_root[sensor] = _chain_root(layout, place.segment)
        joint = joint_before.get(place.segment)
        if drivers[place.segment] != sensor or joint is None or joint.parent not in drivers:
            continue
        parent = drivers[joint.parent]
        axes = FREE if joint.name in _SADDLES else joint.axes
        rest, centre = _seen_from(fit.skeleton, joint.parent, place.segment)
        q_parent_segment = fit.q_sensor_segment[parent]
        found.parent[sensor], found.axes[sensor] = parent, axes
        found.q_parent_joint[sensor] = so3.multiply(q_parent_segment, rest)
        found.t_parent_joint[sensor] = so3.rotate(
            q_parent_segment, centre - t_segment_sensor[parent]
        )
        found.axis_sd_rad[sensor] = _axis_sd(joint.name, axes, known, calibration is not None)
        found.range_rad[sensor] = _range(joint.name, fit.skeleton.side)
    return found


def _range(joint: str, side: HandSide) -> Array:
    """What the joint's flexion and deviation can be, as turns about x and z of its frame."""
    found = np.tile([-np.inf, np.inf], (2, 1))
    for angle in hand_angles():
        ends = possible(angle)
        if angle.joint == joint and angle.turn != ROTATION and ends is not None:
            found[angle.turn] = np.sort(sign_of(angle, side) * np.deg2rad(ends))
    return found


def _seen_from(skeleton: Skeleton, parent: str, segment: str) -> tuple[Array, Array]:
    """Attitude and joint of a segment at rest, in one that carries it, however many lie between."""
    k = SEGMENTS.index(segment)
    rest, centre = skeleton.q_parent_rest[k], skeleton.t_parent_joint[k]
    while (k := PARENTS[k]) > 0 and SEGMENTS[k] != parent:
        q = skeleton.q_parent_rest[k]
        rest = so3.multiply(q, rest)
        centre = skeleton.t_parent_joint[k] + so3.rotate(q, centre)
    return rest, centre


_FIRST_IN_CHAIN = {"thumb": "SN3", "index": "SN1", "middle": "SN1", "ring": "SN2", "little": "SN2"}
"""Which of the forearm's sensors each finger's chain begins with (the thesis's table 3.6)."""


def _chain_root(layout: Layout, segment: str) -> int:
    """Where that sensor is worn; -1: it is not, or the segment is no finger's."""
    name = _FIRST_IN_CHAIN.get(segment.partition("_")[0], "")
    worn = [k for k, p in enumerate(layout.sensors) if (p.sensor, p.segment) == (name, "forearm")]
    return worn[0] if worn else -1


_SADDLES = ("thumb_cmc",)
"""Joints whose two axes turn the bone about its own as well: opposition."""

_WRISTS = ("wrist", WRIST_ULNAR.name)

_LEVER_SD_M = {False: 0.010, True: 0.003}
_AXIS_SD_NOMINAL = float(np.deg2rad(8.0))
_SKIN_SD = float(np.deg2rad(1.0))
"""How far skin turns a board off its bone about other axes than the joint's."""

_OFF_AXES_SD = float(np.deg2rad(4.0))
"""How far a joint of two axes turns about the third; capsules give."""

_FOREARM_LAG_SD = float(np.deg2rad(12.0))
"""Skin of the forearm stays behind when it turns about its long axis."""


def _axis_sd(joint: str, axes: int, known: dict[str, float], calibrated: bool) -> float:
    own = known.get(joint, _AXIS_SD_NOMINAL) if calibrated else _AXIS_SD_NOMINAL
    parts = [own, _SKIN_SD]
    if axes > 1:
        parts.append(_FOREARM_LAG_SD if joint in _WRISTS else _OFF_AXES_SD)
    return float(np.linalg.norm(parts))


def _calibrated_places(
    calibration: SubjectCalibration, layout: Layout, fit: HandFit, nominal: Array
) -> Array:
    """Where sensors sit on their segments: as measured, where that was done."""
    places = nominal.copy()
    own_joint = {joint.child: joint.name for joint in JOINTS}
    found = {(centre.joint, centre.sensor): centre.from_centre_m for centre in calibration.centres}
    for sensor, place in enumerate(layout.sensors):
        centre = found.get((own_joint[place.segment], place.sensor))
        if centre is not None:
            q_segment_sensor = so3.conjugate(fit.q_sensor_segment[sensor])
            places[sensor] = so3.rotate(q_segment_sensor, np.array(centre))
    return places
