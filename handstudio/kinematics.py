"""From the motion of sensors to the motion of a hand: memoryless, over any stretch of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.mounting import nominal_mounting
from handstudio.calibration.subject import SubjectCalibration
from handstudio.errors import LayoutError
from handstudio.hand.angles import (
    ROOT_ANGLES,
    Angle,
    hand_angles,
    joint_angles,
    joint_index,
)
from handstudio.hand.pose import Pose, posed
from handstudio.hand.skeleton import (
    FINGERS,
    JOINTS,
    PARENTS,
    SEGMENTS,
    HandSide,
    Skeleton,
    nominal_skeleton,
)
from handstudio.hand.skin import Skin, skin_of, taken_off
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.pipeline import Motion
from handstudio.setup import Setup


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

    Raises:
        LayoutError: the layout is not a hand's.
    """
    if not setup.layout.is_hand:
        raise LayoutError(
            "There is no hand in this recording.",
            "{why} {why.remedy}",
            why=setup.layout.no_hand,
        )
    if setup.subject is not None:
        return fit_of_calibration(setup.subject, setup.layout)
    side: HandSide = "left" if setup.layout.side == "left" else "right"
    skeleton = nominal_skeleton(side, setup.hand.hand_length_m)
    return HandFit(skeleton, nominal_mounting(setup.layout))


def fit_of_calibration(calibration: SubjectCalibration, layout: Layout) -> HandFit:
    """The hand a calibration describes, on a glove of this layout.

    A sensor that the calibration does not know sits as the maker meant it.
    """
    known = {segment.name: segment for segment in calibration.segments}
    tips = {tip.finger: tip for tip in calibration.tips}
    nominal = nominal_skeleton(calibration.side, calibration.hand_length_m)
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
    joints = {joint.name for joint in JOINTS if {joint.parent, joint.child} <= set(on.values())}
    rocking = [(on[r.sensor], r.joint, r.share) for r in calibration.rocking if r.sensor in on]
    swung = {axis.joint for axis in calibration.axes} & joints
    return skin_of([rock for rock in rocking if rock[1] in joints], by_hand="wrist" in swung)


def segment_attitudes(
    setup: Setup, q_world_sensor: Float[Array, "n s 4"], fit: HandFit | None = None
) -> Float[Array, "n k 4"]:
    """Attitude of every segment: by its own sensor, else carried along by its parent at rest.

    What is known of skin is taken off. ``fit`` is the setup's own unless given, here and below.

    Raises:
        LayoutError: the layout is not a hand's.
    """
    fit = fit_of(setup) if fit is None else fit
    skeleton, q_sensor_segment = fit.skeleton, fit.q_sensor_segment
    drivers = setup.layout.drivers
    out = np.empty((len(q_world_sensor), len(SEGMENTS), 4))
    driven = [index for index, name in enumerate(SEGMENTS) if name in drivers]
    sensors = [drivers[SEGMENTS[index]] for index in driven]
    out[:, driven] = so3.multiply(q_world_sensor[:, sensors], q_sensor_segment[sensors])
    if fit.skin is not None:
        out = taken_off(fit.skin, skeleton, out)
    for index in sorted(set(range(len(SEGMENTS))) - set(driven)):
        out[:, index] = so3.multiply(out[:, PARENTS[index]], skeleton.q_parent_rest[index])
    return out


def pose_of(
    setup: Setup, q_world_sensor: Float[Array, "n s 4"], fit: HandFit | None = None
) -> Pose:
    """The placed hand.

    Raises:
        LayoutError: the layout is not a hand's.
    """
    fit = fit_of(setup) if fit is None else fit
    return posed(fit.skeleton, segment_attitudes(setup, q_world_sensor, fit))


def measured_angles(layout: Layout) -> tuple[Angle, ...]:
    """The angles between segments that both carry a sensor; root angles need only the forearm."""
    drivers = layout.drivers

    def measured(angle: Angle) -> bool:
        child = joint_index(angle.joint)
        parent = PARENTS[child]
        return SEGMENTS[child] in drivers and (parent < 0 or SEGMENTS[parent] in drivers)

    return tuple(angle for angle in hand_angles() if layout.is_hand and measured(angle))


def angles_of(
    setup: Setup,
    motion: Motion,
    angles: Sequence[Angle] | None = None,
    fit: HandFit | None = None,
) -> Float[Array, "n a"]:
    """Joint angles [rad], columns as `measured_angles`; root angles are NaN before the start.

    The start is as the forearm's own sensor had it: a hand that lies flat then drags no skin.

    Raises:
        LayoutError: the layout is not a hand's.
    """
    fit = fit_of(setup) if fit is None else fit
    attitudes = segment_attitudes(setup, motion.q_world_sensor, fit)
    q_sensor_forearm = fit.q_sensor_segment[setup.layout.drivers["forearm"]]
    start = so3.multiply(motion.q_world_start, q_sensor_forearm)
    wanted = measured_angles(setup.layout) if angles is None else angles
    return joint_angles(fit.skeleton, attitudes, start, wanted)


def has_start(motion: Motion) -> bool:
    """Whether angles relative to the start can be given anywhere in this motion."""
    return bool(np.isfinite(motion.q_world_start).any())


def exported_angles(setup: Setup, motion: Motion) -> tuple[Angle, ...]:
    """The angles a file should hold: root angles only where the motion has a start."""
    started = has_start(motion)
    return tuple(
        angle for angle in measured_angles(setup.layout) if started or angle.name not in ROOT_ANGLES
    )


def relative_rotations(
    layout: Layout, q_world_sensor: Float[Array, "n s 4"]
) -> dict[str, Float[Array, "n 4"]]:
    """``q_parent_child`` between the sensors across each joint that has one on both sides."""
    drivers = layout.drivers
    return {
        joint.name: so3.multiply(
            so3.conjugate(q_world_sensor[:, drivers[joint.parent]]),
            q_world_sensor[:, drivers[joint.child]],
        )
        for joint in layout.instrumented_joints
    }


def doubtful_segments(setup: Setup, doubt: Array) -> Bool[Array, "n k"]:
    """Whether a segment's attitude is in doubt; one without a sensor is as its parent.

    Where the hand tells how the forearm is turned, doubt of the hand is the forearm's too.
    """
    drivers = setup.layout.drivers
    out = np.zeros((len(doubt), len(SEGMENTS)), dtype=bool)
    for index, name in enumerate(SEGMENTS):
        if name in drivers:
            out[:, index] = doubt[:, drivers[name]] != 0
        elif PARENTS[index] >= 0:
            out[:, index] = out[:, PARENTS[index]]
    if setup.subject is not None and skin_of_calibration(setup.subject, setup.layout).by_hand:
        out[:, SEGMENTS.index("forearm")] |= out[:, SEGMENTS.index("hand")]
    return out
