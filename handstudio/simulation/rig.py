"""What perfect sensors on a moving hand would read, exactly: no differences, no integration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.hand.angles import joint_angles
from handstudio.hand.skeleton import DISTALS, SEGMENTS
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import ImuSamples
from handstudio.simulation.mechanism import hand_moving
from handstudio.simulation.mounting import Mounting, nominal_mounting, segment_indices
from handstudio.simulation.moving import Moving
from handstudio.simulation.subject import Subject
from handstudio.simulation.trajectory import JointMotion, Trajectory
from handstudio.simulation.world import World


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What was true at every instant; angles [rad] in the order of `hand.angles.hand_angles`."""

    time_us: Int64[Array, " n"]
    q_world_segment: Float[Array, "n k 4"]
    q_world_sensor: Float[Array, "n s 4"]
    t_world_joint: Float[Array, "n k 3"]
    t_world_sensor: Float[Array, "n s 3"]
    t_world_tip: Float[Array, "n 5 3"]
    angles: Float[Array, "n a"]


@dataclass(frozen=True, slots=True, eq=False)
class Felt:
    """What perfect sensors feel: [rad/s], [m/s²] and [µT], in their own axes."""

    gyr: Float[Array, "n s 3"]
    acc: Float[Array, "n s 3"]
    mag: Float[Array, "n s 3"]


def signals(
    subject: Subject,
    layout: Layout,
    trajectory: Trajectory,
    time_us: Int64[Array, " n"],
    *,
    mounting: Mounting | None = None,
    world: World | None = None,
) -> tuple[ImuSamples, Truth]:
    """Read every sensor of a layout, fixed to its segment, at the given instants of a motion.

    Raises:
        LayoutError: a sensor sits on something that is not a segment of the hand.
    """
    world = World() if world is None else world
    mounting = nominal_mounting(layout, subject.skeleton) if mounting is None else mounting
    _, segments = hand_at(subject, trajectory, time_us * 1e-6, world)
    on = segments[:, segment_indices(layout)]
    sensors = on.carrying(mounting.q_segment_sensor, mounting.t_segment_sensor)
    felt = feel(sensors, world)
    flags = np.ones(felt.gyr.shape[:2], dtype=bool)
    samples = ImuSamples(time_us, felt.gyr, felt.acc, felt.mag, flags, flags, ~flags)
    return samples, truth_of(subject, time_us, segments, sensors, world)


def hand_at(
    subject: Subject, trajectory: Trajectory, time_s: Float[Array, " n"], world: World
) -> tuple[JointMotion, Moving]:
    """Joints, and every segment in the world, (n, k), at any instants of a motion [s]."""
    joints = trajectory.at(time_s)
    return joints, hand_moving(subject.skeleton, subject.mechanism, joints, world.q_world_start)


def feel(sensors: Moving, world: World) -> Felt:
    """What perfect sensors that move in the world read, (n, s)."""
    q_sensor_world = so3.conjugate(sensors.q)
    lift = sensors.a.copy()
    lift[..., 2] += world.gravity_mps2
    return Felt(
        gyr=so3.rotate(q_sensor_world, sensors.omega),
        acc=so3.rotate(q_sensor_world, lift),
        mag=so3.rotate(q_sensor_world, world.field_at(sensors.t)),
    )


def truth_of(
    subject: Subject,
    time_us: Int64[Array, " n"],
    segments: Moving,
    sensors: Moving,
    world: World,
) -> Truth:
    """Gather what is true; angles come from the segments' attitudes as they do in the pipeline."""
    distal = segments[:, [SEGMENTS.index(name) for name in DISTALS]]
    start = np.tile(world.q_world_start, (len(time_us), 1))
    return Truth(
        time_us=time_us,
        q_world_segment=segments.q,
        q_world_sensor=sensors.q,
        t_world_joint=segments.t,
        t_world_sensor=sensors.t,
        t_world_tip=distal.t + so3.rotate(distal.q, subject.skeleton.t_distal_tip),
        angles=joint_angles(subject.skeleton, segments.q, start),
    )
