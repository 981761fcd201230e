"""Manners: the same motion, done otherwise. Mostly sloppily, as people do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.trajectory import Trajectory, scaled, stretched


@dataclass(frozen=True, slots=True)
class Manner:
    """A way of doing things.

    Attributes:
        what: A sentence without its full stop.
        of: Changes a motion of that name.
    """

    what: str
    of: Callable[[Actor, str, Trajectory], Trajectory]


MANNERS = {
    "slow": Manner("Half as fast", lambda _actor, _name, part: stretched(part, 2.0)),
    "fast": Manner("Half as fast again", lambda _actor, _name, part: stretched(part, 1.0 / 1.5)),
    "small": Manner("A third as far", lambda _actor, _name, part: scaled(part, 1.0 / 3.0)),
}
"""By name."""
