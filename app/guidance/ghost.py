"""The hand that shows what is asked for: somebody ideal does it, over and over. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.course import Step
from handstudio.hand.pose import Pose, posed
from handstudio.hand.skeleton import JOINTS, PARENTS, SEGMENTS, HandSide, Skeleton
from handstudio.maths import so3
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.rig import hand_at
from handstudio.simulation.subject import ideal_subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.world import World

RATE_HZ = 30.0
LONGEST_S = 30.0
"""Of what takes longer its beginning is shown."""

_AWAY = np.pi / 2  # y of the picture: the forearm points away from the viewer
_STILL = {"fit": "static", "noise": "static"}  # what is shown of kinds that show nothing themselves


@dataclass(frozen=True, slots=True, eq=False)
class Ghost:
    """A movement, sampled.

    Attributes:
        skeleton: Of the ideal hand.
        poses: One every 1/30 s; the last goes on to the first.
        moving: Segments that the step is about; the others are only there with them.
    """

    skeleton: Skeleton
    poses: Pose
    moving: Bool[Array, " k"]

    def at(self, seconds: float) -> Pose:
        """The pose at a time; it repeats."""
        poses = self.poses
        i = int(seconds * RATE_HZ) % len(poses.t_world_joint)
        return Pose(poses.q_world_segment[i], poses.t_world_joint[i], poses.t_world_tip[i])


@lru_cache(maxsize=64)
def ghost_of(step: Step, side: HandSide, hand_length_m: float) -> Ghost:
    """What a step asks for, done by the ideal hand of this length; the elbow stays in its place."""
    subject = ideal_subject(side, hand_length_m)
    motion = _STILL.get(step.kind, step.perform) or "static"
    trajectory = perform(motion, Actor(subject))
    begin_s, end_s = _stretch(trajectory, step.name)
    end_s = min(max(end_s, begin_s + 1.0 / RATE_HZ), begin_s + LONGEST_S)
    time_s = np.arange(begin_s, end_s, 1.0 / RATE_HZ)
    world = World()
    _joints, moving = hand_at(subject, trajectory, time_s, world)
    q_picture_segment = so3.multiply(so3.about_z(_turn(world)), moving.q)
    return Ghost(subject.skeleton, posed(subject.skeleton, q_picture_segment), _beyond(step.joint))


def _stretch(trajectory: Trajectory, name: str) -> tuple[float, float]:
    """The part that the step is called by, else all of it [s]."""
    spans = [(span.start_s, span.end_s) for span in trajectory.spans if span.name == name]
    return spans[-1] if spans else (0.0, trajectory.duration_s)


def _turn(world: World) -> float:
    along: Float[Array, " 3"] = so3.rotate(world.q_world_start, np.array([0.0, 1.0, 0.0]))
    return float(_AWAY - np.arctan2(along[1], along[0]))


def _beyond(joint: str) -> Bool[Array, " k"]:
    """The segments that a joint carries; none, where the step is about no joint."""
    out = np.zeros(len(SEGMENTS), dtype=bool)
    for index, each in enumerate(JOINTS):
        out[index] = each.name == joint or (index > 0 and out[PARENTS[index]])
    return out
