"""Functional axes: the principal axis of a joint's whole rotation (5.1), and angles about it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.swings import Swing, Swings, relative_turn, smooth
from handstudio.maths import so3


@dataclass(frozen=True, slots=True, eq=False)
class JointAxis:
    """The flexion axis of a joint, extension positive, at the flat hand.

    Attributes:
        joint: Which joint.
        in_world: Unit vector, the hand lying flat.
        sd_rad: How well its direction is known.
        angle: Turn about it against the flat hand, and two derivatives [rad, s].
        sideways: The same about the second axis; None where that was not swung.
        across: The second axis, square to the first, in the world at the flat hand.
    """

    joint: str
    in_world: Float[Array, " 3"]
    sd_rad: float
    angle: tuple[Float[Array, " n"], Float[Array, " n"], Float[Array, " n"]]
    sideways: tuple[Float[Array, " n"], Float[Array, " n"], Float[Array, " n"]] | None = None
    across: Float[Array, " 3"] | None = None

    def seen_from(self, swings: Swings, sensor: int) -> Float[Array, " 3"]:
        """The axis in the frame of a sensor, the hand lying flat."""
        return so3.rotate(so3.conjugate(swings.q_flat(sensor)), self.in_world)


def flexion_axis(swings: Swings, joint: str) -> JointAxis | None:
    """The axis of a joint's flexion; None where it was not swung or a sensor is missing.

    A joint's first axis stays where it is in the parent, so it is found there, and carried
    over to the child through the flat hand. The whole rotation counts, not one sample of it.
    """
    turn = relative_turn(swings, joint)
    trials = swings.of_joint(joint, flexion=True)
    if turn is None or not trials:
        return None
    rates = np.concatenate([_rate_in_parent(swings, swing) for swing in trials])
    axis, sd = principal_axis(rates)
    parent, _ = swings.drivers(joint)
    in_world = axis if parent is None else so3.rotate(swings.q_flat(parent), axis)
    if in_world @ _lateral(swings, joint) < 0.0:
        axis, in_world = -axis, -in_world
    sideways, across = None, None
    others = swings.of_joint(joint, flexion=False)
    if others:
        second, _ = principal_axis(np.concatenate([_rate_in_parent(swings, s) for s in others]))
        second = second - axis * (second @ axis)
        second = second / np.linalg.norm(second)
        sideways = _derived(swings, turn @ second)
        across = second if parent is None else so3.rotate(swings.q_flat(parent), second)
    return JointAxis(joint, in_world, sd, _derived(swings, turn @ axis), sideways, across)


def _derived(swings: Swings, angle: Array) -> tuple[Array, Array, Array]:
    value, rate, more = (smooth(angle, swings.rate_hz, order) for order in (0, 1, 2))
    return value, rate, more


def principal_axis(rates: Float[Array, "n 3"]) -> tuple[Float[Array, " 3"], float]:
    """Direction that angular velocities lie along best, and how well it is known [rad].

    The standard deviation counts a swing, not a sample, as one observation: what leads a joint off
    its axis lasts as long as the swing does.
    """
    _, singular, v = np.linalg.svd(rates, full_matrices=False)
    along = rates @ v[0]
    swings = max(2.0, 0.5 * float(np.count_nonzero(np.diff(np.sign(along)) != 0)))
    return v[0], float(singular[1] / singular[0] / np.sqrt(swings))


def _rate_in_parent(swings: Swings, swing: Swing) -> Array:
    parent, child = swings.drivers(swing.joint)
    part = swing.moving
    rate = so3.rotate(swings.q_world_sensor[part, child], swings.gyr[part, child])
    if parent is None:
        return rate
    rate = rate - so3.rotate(swings.q_world_sensor[part, parent], swings.gyr[part, parent])
    return so3.rotate(so3.conjugate(swings.q_world_sensor[part, parent]), rate)


def _lateral(swings: Swings, joint: str) -> Array:
    """Roughly where x of the child points: sensors lie on the back, their x across the bone."""
    _, child = swings.drivers(joint)
    assert child is not None
    return so3.rotate(swings.q_flat(child), np.array([1.0, 0.0, 0.0]))
