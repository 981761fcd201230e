"""Manners: the same motion, done otherwise. Mostly sloppily, as people do.

A manner keeps what is named in a motion, and its rest at both ends. Sizes and shares are ours.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from handstudio.errors import SetupError
from handstudio.hand.skeleton import FINGERS, JOINTS
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.pace import halting
from handstudio.simulation.motions.reach import reach
from handstudio.simulation.motions.unrest import unrest
from handstudio.simulation.postures import channel_of
from handstudio.simulation.trajectory import Trajectory, layered, scaled, stretched

_ALONG = (0.25, 0.55)  # how far the wrong joint goes, per degree of the right one
_LONGEST_S = 1200.0
_MOVING_RAD = 0.02  # less than this is no movement that another could follow


@dataclass(frozen=True, slots=True)
class Manner:
    """A way of doing things.

    Attributes:
        what: A sentence without its full stop.
        of: Changes a motion of that name.
    """

    what: str
    of: Callable[[Actor, str, Trajectory], Trajectory]


def _wrong_joint(actor: Actor, name: str, part: Trajectory) -> Trajectory:
    """A neighbour of the joint that moves most moves along, as far as it can."""
    rng = actor.rng(f"{name} wrong joint")
    neighbour, ratio = str(rng.choice(_neighbours(part))), rng.uniform(*_ALONG)
    at = np.linspace(0.0, part.duration_s, max(2, round(part.duration_s / 0.02)))
    posture = part.posture(at)
    main = _busiest(part)
    moved = posture[:, main] - posture[0, main]
    if np.ptp(moved) < _MOVING_RAD:
        return part
    channel = channel_of(neighbour)
    ratio *= _room(actor, neighbour, posture[:, channel], ratio * moved)
    coefficients = part.coefficients.copy()
    coefficients[:, :, channel] += ratio * coefficients[:, :, main]
    coefficients[-1, :, channel] -= ratio * part.start[main]
    return replace(part, coefficients=coefficients)


def _restless(actor: Actor, name: str, part: Trajectory) -> Trajectory:
    _refuse_long(part)
    return layered(part, unrest(actor, name, part.duration_s))


def _jerky(actor: Actor, name: str, part: Trajectory) -> Trajectory:
    _refuse_long(part)
    return halting(part, actor.rng(f"{name} jerky"))


def _sloppy(actor: Actor, name: str, part: Trajectory) -> Trajectory:
    """One to four of: too slow, too small, with the wrong joint, restless."""
    rng = actor.rng(f"{name} sloppy")
    slow, small, wrong, restless = rng.random(4) < 0.5
    moves = float(np.ptp(part.posture(_instants(part)), axis=0).max()) > _MOVING_RAD
    if moves and wrong:
        part = _wrong_joint(actor, name, part)
    if moves and small:
        part = scaled(part, float(rng.uniform(0.3, 0.6)))
    if moves and slow:
        part = stretched(part, float(rng.uniform(1.4, 2.2)))
    if restless or not (moves and (wrong or small or slow)):
        _refuse_long(part)
        over = unrest(actor, name, part.duration_s, float(rng.uniform(0.4, 1.2)))
        part = layered(part, over)
    return part


MANNERS = {
    "slow": Manner("Half as fast", lambda _actor, _name, part: stretched(part, 2.0)),
    "fast": Manner("Half as fast again", lambda _actor, _name, part: stretched(part, 1.0 / 1.5)),
    "small": Manner("A third as far", lambda _actor, _name, part: scaled(part, 1.0 / 3.0)),
    "wrong_joint": Manner("A neighbouring joint moves along", _wrong_joint),
    "restless": Manner("Never still: tremor and drift, at rest too", _restless),
    "jerky": Manner("With halts and sudden starts", _jerky),
    "sloppy": Manner("Too slow, too small, restless or with the wrong joint, as it falls", _sloppy),
}
"""By name."""


def _refuse_long(part: Trajectory) -> None:
    """Raise a SetupError if pieces of 10 to 20 ms would be too many to hold."""
    if part.duration_s > _LONGEST_S:
        raise SetupError(
            "A motion of {seconds:.0f} s is too long to be done so.",
            "Restless, jerky and sloppy ones last {most:.0f} s at most; repeat a shorter one.",
            seconds=part.duration_s,
            most=_LONGEST_S,
        )


def _instants(part: Trajectory) -> np.ndarray:
    return np.linspace(0.0, part.duration_s, max(2, round(part.duration_s / 0.05)))


def _busiest(part: Trajectory) -> int:
    """The channel that turns through most, all its ways added up."""
    ways = np.abs(np.diff(part.posture(_instants(part)), axis=0)).sum(axis=0)
    return int(np.argmax(ways[:-3]))


def _neighbours(part: Trajectory) -> list[str]:
    """Flexions that people confuse with that of the joint that moves most."""
    busiest = _busiest(part)
    joint = JOINTS[busiest // 3].name
    own = [f"{joint}_flexion"] if busiest % 3 else []  # abducted, and bent with it
    if joint in _NEXT:
        return own + [f"{name}_flexion" for name in _NEXT[joint]]
    finger, _, kind = joint.partition("_")
    if kind == "mcp":
        beside = {FINGERS.index(finger) - 1, FINGERS.index(finger) + 1} & {1, 2, 3, 4}
        names = [f"{finger}_pip", *(f"{FINGERS[i]}_mcp" for i in sorted(beside))]
    else:
        names = [f"{finger}_mcp", f"{finger}_pip" if kind == "dip" else "wrist"]
    return own + [f"{name}_flexion" for name in names]


_NEXT = {
    "elbow": ("wrist",),
    "wrist": ("elbow", "middle_mcp"),
    "ulnar_cmc": ("wrist", "little_pip"),
    "thumb_cmc": ("thumb_mcp", "wrist"),
    "thumb_mcp": ("thumb_ip", "thumb_cmc"),
    "thumb_ip": ("thumb_mcp",),
}


def _room(actor: Actor, name: str, now: np.ndarray, more: np.ndarray) -> float:
    """Share of a movement [rad] for which a joint has room beside what it does already."""
    low, high = (np.deg2rad(end) for end in reach(actor.subject, name))
    sign = 1.0 if name.startswith("elbow") else -1.0  # of a turn about x
    ends = sorted((sign * low, sign * high))
    up, down = float(more.max()), float(more.min())
    above = (ends[1] - float(now.max())) / up if up > 0.0 else 1.0
    below = (ends[0] - float(now.min())) / down if down < 0.0 else 1.0
    return float(np.clip(min(above, below), 0.0, 1.0))
