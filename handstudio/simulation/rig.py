"""What perfect sensors on a moving hand would read, exactly: no differences, no integration.

World: z up, x along the horizontal field (magnetic north); the elbow is the origin and stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.hand.angles import compose, hand_angles, joint_index, sign_of
from handstudio.hand.pose import posed
from handstudio.hand.skeleton import PARENTS, Skeleton
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY, ImuSamples
from handstudio.simulation.mounting import Mounting, nominal_mounting, segment_indices
from handstudio.simulation.trajectory import JointMotion, Trajectory


@dataclass(frozen=True, slots=True)
class World:
    """Where the forearm starts, and what it feels there.

    Attributes:
        heading_rad: Direction the forearm points to at the start, palm down: anticlockwise from
            magnetic north, seen from above.
        field_ut: The Earth's field, pointing down in the north. Kyoto by the IGRF, rounded.
        gravity_mps2: Its size.
    """

    heading_rad: float = 0.6
    field_ut: tuple[float, float, float] = (31.0, 0.0, -35.0)
    gravity_mps2: float = STANDARD_GRAVITY

    @property
    def q_world_start(self) -> Float[Array, "4"]:
        """Attitude of the forearm at the start: along the heading, dorsal side up."""
        return so3.about_z(self.heading_rad - 0.5 * np.pi)


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What was true at every instant; angles [rad] in the order of `hand.angles.hand_angles`."""

    time_us: Int64[Array, " n"]
    q_world_segment: Float[Array, "n k 4"]
    q_world_sensor: Float[Array, "n s 4"]
    t_world_joint: Float[Array, "n k 3"]
    t_world_tip: Float[Array, "n 5 3"]
    angles: Float[Array, "n a"]


def signals(
    skeleton: Skeleton,
    layout: Layout,
    trajectory: Trajectory,
    time_us: Int64[Array, " n"],
    *,
    mounting: Mounting | None = None,
    world: World | None = None,
) -> tuple[ImuSamples, Truth]:
    """Read every sensor of a layout at the given instants of a motion.

    Raises:
        LayoutError: a sensor sits on something that is not a segment of the hand.
    """
    world = World() if world is None else world
    mounting = nominal_mounting(layout, skeleton) if mounting is None else mounting
    on = segment_indices(layout)
    joints = trajectory.at(time_us * 1e-6)
    q, omega, alpha, accel = _segment_motion(skeleton, joints, world)

    lever = so3.rotate(q[:, on], mounting.t_segment_sensor)
    q_world_sensor = so3.multiply(q[:, on], mounting.q_segment_sensor)
    q_sensor_world = so3.conjugate(q_world_sensor)
    lift = accel[:, on] + swing(omega[:, on], alpha[:, on], lever)
    lift[..., 2] += world.gravity_mps2
    flags = np.ones((len(time_us), len(on)), dtype=bool)
    samples = ImuSamples(
        time_us=time_us,
        gyr=so3.rotate(q_sensor_world, omega[:, on]),
        acc=so3.rotate(q_sensor_world, lift),
        mag=so3.rotate(q_sensor_world, np.asarray(world.field_ut)),
        fresh=flags,
        valid=flags,
        saturated=~flags,
    )
    pose = posed(skeleton, q)
    angles = _angles(skeleton, joints)
    return samples, Truth(time_us, q, q_world_sensor, pose.t_world_joint, pose.t_world_tip, angles)


def swing(
    omega: Float[Array, "*#n 3"], alpha: Float[Array, "*#n 3"], lever: Float[Array, "*#n 3"]
) -> Float[Array, "*n 3"]:
    """Acceleration of a point of a turning body against another one, ``lever`` away (3.1)."""
    return _cross(alpha, lever) + _cross(omega, _cross(omega, lever))


def _segment_motion(
    skeleton: Skeleton, joints: JointMotion, world: World
) -> tuple[Array, Array, Array, Array]:
    """Attitude, angular velocity and acceleration of every segment, acceleration of its joint.

    All in the world. Down the tree: a child turns with its parent and by its own joint, and the
    joint's axes are carried along by the parent, hence the cross term.
    """
    own_q, own_omega, own_alpha = _joint_turn(joints)
    n, segments = own_q.shape[:2]
    # one place more than segments: the world, at rest, which index -1 (the root's parent) finds
    q = np.empty((n, segments + 1, 4))
    q[:, -1] = world.q_world_start
    omega, alpha, accel = (np.zeros((n, segments + 1, 3)) for _ in range(3))
    for children, parents in _GENERATIONS:
        link = so3.rotate(q[:, parents], skeleton.t_parent_joint[children])
        q_world_rest = so3.multiply(q[:, parents], skeleton.q_parent_rest[children])
        turning = so3.rotate(q_world_rest, own_omega[:, children])
        carried = _cross(omega[:, parents], turning)
        q[:, children] = so3.multiply(q_world_rest, own_q[:, children])
        omega[:, children] = omega[:, parents] + turning
        alpha[:, children] = (
            alpha[:, parents] + carried + so3.rotate(q_world_rest, own_alpha[:, children])
        )
        accel[:, children] = accel[:, parents] + swing(omega[:, parents], alpha[:, parents], link)
    return q[:, :-1], omega[:, :-1], alpha[:, :-1], accel[:, :-1]


def _generations() -> list[tuple[list[int], list[int]]]:
    """Children and their parents, all whose parents are already placed at once."""
    depth: list[int] = []
    for parent in PARENTS:
        depth.append(0 if parent < 0 else depth[parent] + 1)
    levels = [[c for c, d in enumerate(depth) if d == level] for level in range(max(depth) + 1)]
    return [(children, [PARENTS[child] for child in children]) for children in levels]


_GENERATIONS = _generations()


def _joint_turn(joints: JointMotion) -> tuple[Array, Array, Array]:
    """Every joint's own rotation, angular velocity and acceleration in its rest frame.

    Three single-axis turns, x then z then y; each turns the axes of those that follow, which adds
    ``omega x (axis rate)`` to the angular acceleration.
    """
    shape = joints.turns.shape
    x = np.broadcast_to([1.0, 0.0, 0.0], shape)
    cos_x, sin_x = np.cos(joints.turns[..., 0]), np.sin(joints.turns[..., 0])
    cos_z, sin_z = np.cos(joints.turns[..., 1]), np.sin(joints.turns[..., 1])
    z = np.stack([np.zeros_like(sin_x), -sin_x, cos_x], axis=-1)  # Rx z
    y = np.stack([-sin_z, cos_x * cos_z, sin_x * cos_z], axis=-1)  # Rx Rz y
    omega, alpha = np.zeros(shape), np.zeros(shape)
    for turn, axis in enumerate((x, z, y)):
        own = axis * joints.rates[..., turn, None]
        alpha += axis * joints.accelerations[..., turn, None] + _cross(omega, own)
        omega += own
    return compose(joints.turns), omega, alpha


def _angles(skeleton: Skeleton, joints: JointMotion) -> Array:
    columns = [
        sign_of(angle, skeleton.side) * joints.turns[:, joint_index(angle.joint), angle.turn]
        for angle in hand_angles()
    ]
    return np.stack(columns, axis=-1)


def _cross(a: Array, b: Array) -> Array:
    # numpy.cross spends most of its time on generality that three components do not need
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)
