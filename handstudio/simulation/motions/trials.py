"""Calibration of one joint: two seconds still, then eight of swinging it both ways.

Named as the labels of a take. How far, how fast and how steadily people swing is ours: shares of
the range that feel natural, 0.7 Hz for the elbow to 1.3 Hz for a last joint, a tenth of variation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from handstudio.arrays import Array
from handstudio.hand.skeleton import FINGERS
from handstudio.simulation.motions.actor import Actor, Motion
from handstudio.simulation.motions.reach import following, kept, raised, share
from handstudio.simulation.motions.swings import instants, through_reversals
from handstudio.simulation.trajectory import Trajectory, held, joined, labelled

STILL_S = 2.0
SWINGING_S = 8.0

_UNSTEADY_DEG = 0.4  # nobody holds the other joints quite still while one moves
_UNSTEADY_MOST = 2.0  # of that
_OTHER_EASE_DEG = 1.5  # and no posture is taken up twice


@dataclass(frozen=True, slots=True)
class Trial:
    """One joint's exercise.

    Attributes:
        name: Label of a take.
        angle: What moves.
        low: Where it turns back, as a share of the range (negative: of its lower end).
        high: And at the other end.
        period_s: To and fro, on average.
        base: Posture it is done in, where it differs from the hand at ease [deg].
        along: What comes along by nature, per degree.
    """

    name: str
    angle: str
    low: float
    high: float
    period_s: float
    base: Mapping[str, float] = field(default_factory=dict)
    along: Mapping[str, float] = field(default_factory=dict)

    @property
    def follower(self) -> str:
        """Finger whose last joint follows this one; empty where none does."""
        finger, _, rest = self.angle.partition("_")
        return finger if rest == "pip_flexion" else ""


def perform_trial(trial: Trial, actor: Actor, _: str) -> Trajectory:
    """Two seconds still, labelled so, and eight of swinging, labelled with the joint."""
    rng = actor.rng(trial.name)
    base = _base(trial, actor, rng)
    still = labelled(held(actor.posture(base), STILL_S), "static")
    return joined([still, labelled(_swung(trial, actor, base, rng), trial.name)])


def _base(trial: Trial, actor: Actor, rng: np.random.Generator) -> dict[str, float]:
    base = raised(actor.subject) | dict(trial.base)
    ease = rng.normal(0.0, _OTHER_EASE_DEG, len(base))
    base = {n: v + e for (n, v), e in zip(base.items(), ease, strict=True)}
    low, high = (share(actor.subject, trial.angle, end) for end in (trial.low, trial.high))
    begin = {trial.angle: float(np.clip(base.get(trial.angle, 0.0), low, high))}
    return kept(actor.subject, base | begin)


def _swung(
    trial: Trial, actor: Actor, base: Mapping[str, float], rng: np.random.Generator
) -> Trajectory:
    at = instants(rng, 0.5 * trial.period_s, SWINGING_S)
    ends = np.array([share(actor.subject, trial.angle, end) for end in (trial.low, trial.high)])
    middle, half = ends.mean(), 0.5 * float(np.ptp(ends))
    vigour = rng.normal(0.95, 0.05)  # of this performance
    first = int(rng.integers(2))
    begin = base[trial.angle]
    postures = []
    for count in range(len(at)):
        towards = 1.0 if (count + first) % 2 else -1.0
        far = float(np.clip(vigour * rng.normal(1.0, 0.07), 0.7, 1.05))
        here = middle + towards * far * half
        postures.append(_with(trial, actor, base, here - begin))
    postures[0] = postures[-1] = actor.posture(base)
    return through_reversals(at, np.stack(postures) + _unsteadiness(trial, actor, rng, len(at)))


def _with(trial: Trial, actor: Actor, base: Mapping[str, float], moved: float) -> Array:
    """The posture in which the joint is moved by so much, with what comes along."""
    angle = base[trial.angle] + moved
    posture = {**base, trial.angle: angle}
    for other, ratio in trial.along.items():
        posture[other] = base.get(other, 0.0) + ratio * moved
    if trial.follower:
        last = f"{trial.follower}_dip_flexion"
        change = following(actor.subject, trial.follower, angle)
        change -= following(actor.subject, trial.follower, base[trial.angle])
        posture[last] = base[last] + change
    return actor.posture(kept(actor.subject, posture))


def _unsteadiness(trial: Trial, actor: Actor, rng: np.random.Generator, count: int) -> Array:
    """What the other joints do meanwhile: nothing anybody would notice; none at both ends."""
    names = [n for n in raised(actor.subject) if n not in (trial.angle, *trial.along)]
    wander = np.clip(rng.standard_normal((count, len(names))), -_UNSTEADY_MOST, _UNSTEADY_MOST)
    wander[[0, -1]] = 0.0
    zero = actor.posture({})
    return np.stack(
        [
            actor.posture(dict(zip(names, (_UNSTEADY_DEG * row).tolist(), strict=True))) - zero
            for row in wander
        ]
    )


_OUT_OF_THE_PALM = {"thumb_cmc_abduction": 22.0}
_SPREAD = {
    "index_mcp_abduction": 12.0,
    "ring_mcp_abduction": 8.0,
    "little_mcp_abduction": 14.0,
}


def _of_finger(finger: str) -> list[Trial]:
    # a middle finger has room on both sides only between spread neighbours
    inwards = -0.5 if finger == "middle" else -0.1
    outwards = 0.5 if finger == "middle" else 0.85
    mcp, pip, dip = (f"{finger}_{joint}" for joint in ("mcp", "pip", "dip"))
    return [
        Trial(f"{mcp}:flexion", f"{mcp}_flexion", -0.3, 0.75, 0.95),
        Trial(f"{mcp}:abduction", f"{mcp}_abduction", inwards, outwards, 0.85, _SPREAD),
        Trial(f"{pip}:flexion", f"{pip}_flexion", 0.05, 0.85, 0.85),
        # the other hand holds the finger; it gives a little
        Trial(f"{dip}:flexion", f"{dip}_flexion", 0.0, 0.55, 0.75, {}, {f"{pip}_flexion": 0.1}),
    ]


JOINT_TRIALS = (
    Trial("elbow:flexion", "elbow_flexion", 0.12, 0.6, 1.5),
    # flexed by 90 deg from a straight arm the forearm stands up, square to the upper arm, and its
    # second turn is then about the upper arm
    Trial("elbow:rotation", "elbow_rotation", -0.45, 0.45, 1.4, {"elbow_flexion": 90.0}),
    Trial("wrist:flexion", "wrist_flexion", -0.7, 0.65, 1.1, {"elbow_flexion": 50.0}),
    Trial("wrist:deviation", "wrist_deviation_ulnar", -0.7, 0.75, 1.0),
    Trial(
        "ulnar_cmc:flexion",
        "ulnar_cmc_flexion",
        0.0,
        0.75,
        0.9,
        {},
        {"little_mcp_flexion": 0.5, "ring_mcp_flexion": 0.3},
    ),
    Trial("thumb_cmc:flexion", "thumb_cmc_flexion", -0.7, 0.7, 0.95, _OUT_OF_THE_PALM),
    Trial("thumb_cmc:abduction", "thumb_cmc_abduction", 0.05, 0.75, 0.95),
    Trial("thumb_mcp:flexion", "thumb_mcp_flexion", 0.0, 0.8, 0.9, _OUT_OF_THE_PALM),
    Trial("thumb_mcp:abduction", "thumb_mcp_abduction", -0.7, 0.7, 0.85, _OUT_OF_THE_PALM),
    Trial("thumb_ip:flexion", "thumb_ip_flexion", -0.4, 0.75, 0.8, _OUT_OF_THE_PALM),
    *(trial for finger in FINGERS[1:] for trial in _of_finger(finger)),
)
"""In the order of joints in which a calibration takes them."""


def _what(trial: Trial) -> str:
    joint, _, turn = trial.name.partition(":")
    first, _, short = joint.partition("_")
    named = f"{first.capitalize()} {short.upper()}".strip()
    return f"{named} {_DONE[turn]}, after two seconds of rest"


_DONE = {
    "flexion": "bent and stretched",
    "abduction": "moved to both sides",
    "deviation": "moved to both sides",
    "rotation": "at a right angle, the forearm turned about the upper arm",
}

TRIALS = tuple(
    Motion(trial.name, _what(trial), partial(perform_trial, trial)) for trial in JOINT_TRIALS
)
