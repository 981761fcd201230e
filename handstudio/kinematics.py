"""From the motion of sensors to the motion of a hand: memoryless, over any stretch of time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.hand.angles import (
    ROOT_ANGLES,
    Angle,
    hand_angles,
    joint_angles,
)
from handstudio.hand.pose import Pose, posed
from handstudio.hand.skeleton import PARENTS, SEGMENTS, Skeleton, joints_of
from handstudio.hand.skin import taken_off
from handstudio.hand_fit import HandFit, fit_of
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.pipeline import Motion
from handstudio.setup import Setup


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
    carried = sorted(set(range(len(SEGMENTS))) - set(driven))
    _carry(skeleton, carried, out)
    if fit.skin is not None:
        out = taken_off(fit.skin, skeleton, out)
        _carry(skeleton, carried, out)
    return out


def _carry(skeleton: Skeleton, segments: Sequence[int], q_world_segment: Array) -> None:
    for index in segments:
        above = q_world_segment[:, PARENTS[index]]
        q_world_segment[:, index] = so3.multiply(above, skeleton.q_parent_rest[index])


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
    """The angles between segments that both carry a sensor; root angles need only the forearm.

    A palm that is not hinged has no angle of its own, and where it is one block the ring and little
    finger turn on the hand.
    """
    if not layout.is_hand:
        return ()
    carrying = {None, *layout.drivers}
    joints = joints_of(layout.hand_type)
    measured = {j.name for j in joints if {j.parent, j.child} <= carrying}
    return tuple(angle for angle in hand_angles() if angle.joint in measured)


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
    skin = fit_of(setup).skin if setup.layout.is_hand else None
    if skin is not None and skin.by_hand:
        out[:, SEGMENTS.index("forearm")] |= out[:, SEGMENTS.index("hand")]
    return out
