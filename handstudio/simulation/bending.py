"""A finger held straight, then bent to and fro: what is asked of people whose joints are sought.

Paces and sizes are ours: 0.7 Hz, most of the joint's range. In a finger joint there is play, too:
the bone rolls and yaws a little, differently at every turn.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handstudio.hand.angles import DEVIATION, ROTATION, joint_index
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.reach import kept, raised, share
from handstudio.simulation.motions.swings import instants, through_reversals
from handstudio.simulation.trajectory import Trajectory, held, joined, labelled

STRAIGHT_S = 3.0
PERIOD_S = 1.4
PLAY_DEG = 1.0  # sd of deviation and rotation where the joint turns back
_FAR = 0.85  # of the joint's range
_VARIED = 0.07
_OTHERS_DEG = 0.8  # nobody holds the other joints quite still


def bending(actor: Actor, joint: str, seconds: float = 20.0) -> Trajectory:
    """``straight``, three seconds, then ``JOINT:flexion``; a finger's joint before follows.

    Args:
        actor: Who, and which performance.
        joint: ``index_dip``, ``index_pip``, ...
        seconds: How long it is bent to and fro.
    """
    rng = actor.rng(f"bending {joint}")
    flexion = f"{joint}_flexion"
    straight = kept(actor.subject, raised(actor.subject) | _straight(joint))
    still = labelled(held(actor.posture(straight), STRAIGHT_S), "straight")
    at = instants(rng, 0.5 * PERIOD_S, seconds)
    far = share(actor.subject, flexion, _FAR)
    postures = np.tile(actor.posture(straight), (len(at), 1))
    for row in range(1, len(at) - 1):
        bent = far * float(rng.normal(0.97 if row % 2 else 0.06, _VARIED))
        others = {n: v + float(rng.normal(0.0, _OTHERS_DEG)) for n, v in straight.items()}
        others |= {flexion: bent} | _along(joint, bent)
        postures[row] = actor.posture(kept(actor.subject, others))
        for turn in (DEVIATION, ROTATION):
            # play beyond the joint's own mechanism, in channels that no posture names
            channel = 3 * joint_index(joint) + turn
            postures[row, channel] += np.deg2rad(PLAY_DEG) * rng.standard_normal()
    swung = labelled(through_reversals(at, postures), f"{joint}:flexion")
    return joined([still, swung])


def hinge_only(trajectory: Trajectory, joint: str) -> Trajectory:
    """The same with every joint but this one's flexion at rest: a model out of wood on a table."""
    coefficients = trajectory.coefficients.copy()
    keep = 3 * joint_index(joint)
    still = np.arange(coefficients.shape[2]) != keep
    coefficients[:-1, :, still] = 0.0
    coefficients[-1, :, still] = trajectory.start[still][:, None]
    return replace(trajectory, coefficients=coefficients)


def _straight(joint: str) -> dict[str, float]:
    finger = joint.rpartition("_")[0]
    names = ("mcp", "ip") if finger == "thumb" else ("mcp", "pip", "dip")
    return {f"{finger}_{name}_flexion": 0.0 for name in names}


def _along(joint: str, bent: float) -> dict[str, float]:
    """What comes along where a last joint is bent: the other hand holds the finger, not well."""
    finger, _, kind = joint.rpartition("_")
    return {f"{finger}_pip_flexion": 0.15 * bent} if kind == "dip" else {}
