"""Virtual people bend a finger, terminals beside a joint: how far methods are from the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handstudio.arrays import Array
from handstudio.hand.skeleton import JOINTS, SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.bending import bending, hinge_only
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.subject import subject, with_fixed_axes
from handstudio.simulation.trackers import ON_A_FINGER, Tracked, TrackerErrors, tracked
from handstudio.trackers.estimate import JointEstimate, apart_m, at_each
from handstudio.trackers.pair import Pair, joined, pair_of
from handstudio.trackers.poses import placed

JOINT = "index_dip"
SKIN = "ideal,soft_tissue,mounting"
MOCK = "ideal,mounting"
TAKES = 5
SECONDS = 20.0


@dataclass(frozen=True, slots=True, eq=False)
class BentJoint:
    """Takes of one person's joint.

    Attributes:
        pair: All takes as one.
        takes: Each by itself.
        q_room_bones: Attitudes of upper and lower bone at the frames of each take.
        t_room_centre: The true centre at them [m].
    """

    pair: Pair
    takes: tuple[Pair, ...]
    q_room_bones: tuple[Array, ...]
    t_room_centre: tuple[Array, ...]


def bent_joint(
    number: int,
    *,
    joint: str = JOINT,
    skin: str = SKIN,
    errors: TrackerErrors = ON_A_FINGER,
    takes: int = TAKES,
    mock: bool = False,
) -> BentJoint:
    """A person bends a joint, its transmitter on the palm; a mock is a hinge of wood.

    The person's number is also the seed of terminals, skin and tracker.
    """
    someone = with_fixed_axes(subject(number)) if mock else subject(number)
    segments = beside(joint)
    strengths = parse(MOCK if mock else skin)
    pairs, bones, centres = [], [], []
    for performance in range(takes):
        trajectory = bending(Actor(someone, seed=performance), joint, SECONDS)
        if mock:
            trajectory = hinge_only(trajectory, joint)
        told = tracked(
            someone,
            trajectory,
            segments,
            TrackerErrors() if mock else errors,
            number,
            skin=strengths,
            performance=performance,
            base="hand",
        )
        rest, moving = (during(told, name) for name in ("straight", f"{joint}:flexion"))
        one, other = told.tracks
        pair = pair_of(one, other, rest, moving)
        used = np.isin(one.time_us, pair.time_us)
        upper, lower = (SEGMENTS.index(name) for name in segments)
        pairs.append(pair)
        bones.append(told.q_room_segment[used][:, [upper, lower]])
        centres.append(told.t_room_joint[used][:, lower])
    return BentJoint(joined(pairs), tuple(pairs), tuple(bones), tuple(centres))


def beside(joint: str) -> tuple[str, str]:
    """Segments before and beyond a joint."""
    found = next(each for each in JOINTS if each.name == joint)
    assert found.parent is not None
    return found.parent, found.child


def during(told: Tracked, name: str) -> Array:
    """Instants at which this was done."""
    time_s = 1e-6 * told.tracks[0].time_us
    start, end = next((start, end) for start, end, each in told.spans if each == name)
    return np.asarray((time_s >= start) & (time_s < end))


def error_of(estimate: JointEstimate, bent: BentJoint) -> Array:
    """How far P_U and P_L are from the true centre, (2, 3) [m]; x of the bone is the hinge's axis.

    In the mean over all frames, P_U in the upper bone's frame and P_L in the lower's: what goes to
    and fro with every swing is not counted, a place that is off is.
    """
    total, frames = np.zeros((2, 3)), 0
    for pair, q, centre in zip(bent.takes, bent.q_room_bones, bent.t_room_centre, strict=True):
        for side, point in enumerate(at_each(estimate, pair)):
            room = placed(pair.q_room_upper, pair.t_room_upper, point)
            total[side] += so3.rotate(so3.conjugate(q[:, side]), room - centre).sum(axis=0)
        frames += len(pair)
    return np.asarray(total / frames)


def figures_of(estimate: JointEstimate, bent: BentJoint) -> dict[str, float]:
    """In millimetres and degrees: what the benchmark reports of one joint by one method."""
    error = 1e3 * error_of(estimate, bent)
    variance = 1e6 * (np.diag(estimate.upper_covariance) + np.diag(estimate.lower_covariance)) / 2.0
    return {
        "pu_pl_mm": 1e3 * apart_m(estimate, bent.pair),
        "error_mm": float(np.mean(np.linalg.norm(error, axis=1))),
        "across_axis_mm": float(np.mean(np.linalg.norm(error[:, 1:], axis=1))),
        "sd_mm": float(np.sqrt(variance.sum())),
    }


def summed(rows: Sequence[dict[str, float]]) -> dict[str, dict[str, float]]:
    """Mean, median and worst of figures."""
    return {
        name: {
            "mean": float(np.mean([row[name] for row in rows])),
            "median": float(np.median([row[name] for row in rows])),
            "worst": float(np.max([row[name] for row in rows])),
        }
        for name in rows[0]
    }


def skin_of_strength(**strengths: float) -> str:
    """The usual skin with some strengths changed, as text."""
    return ",".join([SKIN, *(f"{name}={value:g}" for name, value in strengths.items())])
