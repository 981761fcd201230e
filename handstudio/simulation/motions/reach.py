"""How far a subject's joints go, in named angles, and postures that keep to it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.angles import DEVIATION, FLEXION, joint_index
from handstudio.hand.skeleton import FINGERS
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.swings import through_reversals
from handstudio.simulation.postures import ELBOW, Posture, Script, thumb
from handstudio.simulation.subject import Subject
from handstudio.simulation.trajectory import Trajectory

_PRONATION = (-160.0, 20.0)  # from palm down; the shoulder helps at both ends. Ours
_CMC_ROTATION = (-10.0, 40.0)  # comes with opposition. Ours


def reach(subject: Subject, name: str) -> tuple[float, float]:
    """From where to where a named angle goes [deg], in its own sign."""
    if name == "forearm_pronation":
        return _PRONATION
    if name == "thumb_cmc_rotation":
        return _CMC_ROTATION
    joint, turn, sign = _limited(name)
    ends = sign * np.rad2deg(subject.range_of_motion[joint_index(joint), turn])
    return float(ends.min()), float(ends.max())


def share(subject: Subject, name: str, part: float) -> float:
    """A share of the way from zero to the limit [deg]: of the lower one where it is negative."""
    low, high = reach(subject, name)
    return part * high if part >= 0.0 else -part * low


def kept(subject: Subject, posture: Posture) -> dict[str, float]:
    """The posture, as far as the subject's joints go [deg]; the elbow's place is free."""
    return {
        name: value if name in ELBOW else float(np.clip(value, *reach(subject, name)))
        for name, value in posture.items()
    }


def bent(
    subject: Subject,
    mcp: float,
    pip: float,
    abduction: float = 0.0,
    fingers: Sequence[str] = FINGERS[1:],
) -> dict[str, float]:
    """Fingers alike [deg]; their last joints follow as this subject's do."""
    out = {}
    for finger in fingers:
        out[f"{finger}_mcp_flexion"] = mcp
        out[f"{finger}_mcp_abduction"] = abduction
        out[f"{finger}_pip_flexion"] = pip
        out[f"{finger}_dip_flexion"] = following(subject, finger, pip)
    return kept(subject, out)


def following(subject: Subject, finger: str, pip: float) -> float:
    """Flexion of a finger's last joint [deg] when the one before bends by itself."""
    ratio = float(subject.dip_per_pip[FINGERS.index(finger) - 1])
    return float(np.clip(ratio * pip, *reach(subject, f"{finger}_dip_flexion")))


def raised(subject: Subject) -> dict[str, float]:
    """The hand at ease in the air, the elbow on the table."""
    ease = {"elbow_flexion": 35.0, "wrist_flexion": -8.0, "wrist_deviation_ulnar": 0.0}
    ease |= bent(subject, 12.0, 14.0) | thumb(0.0, 12.0, 8.0, 8.0)
    return kept(subject, ease)


def acted(
    actor: Actor,
    motion: str,
    begin: Posture,
    steps: Script,
    *,
    seconds: float | None = None,
    curve: Callable[[Array, Array], Trajectory] = through_reversals,
) -> Trajectory:
    """Go through postures as people do: no time and no angle twice quite the same.

    Times vary by a tenth, angles by a twentieth; an angle that is named twice in a row is held.

    Args:
        begin: Posture at the start [deg].
        steps: Seconds to take, and the posture to be in then.
        seconds: Of the whole, if that matters.
        curve: From instants and postures to a trajectory.
    """
    rng = actor.rng(motion)
    times, postures = [0.0], [_done(actor, begin)]
    last: Posture = begin
    factors = dict.fromkeys(begin, 1.0)
    for step, posture in steps:
        times.append(times[-1] + step * float(np.clip(rng.normal(1.0, 0.1), 0.75, 1.3)))
        drawn = np.clip(rng.normal(1.0, 0.05, len(posture)), 0.88, 1.12)
        # what stays, stays
        factors = {
            name: factors[name] if last.get(name) == value else float(new)
            for (name, value), new in zip(posture.items(), drawn, strict=True)
        }
        postures.append(_done(actor, {n: v * factors[n] for n, v in posture.items()}))
        last = posture
    total = times[-1] if seconds is None else seconds
    at = np.round(np.array(times) * total / times[-1], 6)
    return curve(at, np.stack(postures))


def _done(actor: Actor, posture: Posture) -> Float[Array, " c"]:
    return actor.posture(kept(actor.subject, posture))


@cache
def _limited(name: str) -> tuple[str, int, float]:
    """Joint and turn whose range limits an angle, and the angle's sign there."""
    joint, _, kind = name.rpartition("_")
    if name == "elbow_rotation":
        return "elbow", DEVIATION, 1.0
    if name == "wrist_deviation_ulnar":
        return "wrist", DEVIATION, 1.0
    if kind == "flexion":
        return joint, FLEXION, 1.0
    # ranges count ulnar deviation; abduction leads away from the middle finger
    return joint, DEVIATION, -1.0 if joint in ("index_mcp", "middle_mcp") else 1.0
