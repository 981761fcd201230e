"""Every motion there is, by name."""

from __future__ import annotations

from functools import cache

from handstudio.simulation.motions.actor import Actor, Motion
from handstudio.simulation.motions.calibration import CALIBRATION
from handstudio.simulation.motions.chores import CHORES
from handstudio.simulation.motions.exercises import EXERCISES
from handstudio.simulation.motions.grasping import GRASPS
from handstudio.simulation.motions.recorded import RECORDED
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.motions.writing import WRITING
from handstudio.simulation.trajectory import Trajectory


def _showcase(actor: Actor, _: str) -> Trajectory:
    return showcase(actor.subject.side)


SHOWCASE = (Motion("showcase", "What a hand can do, in forty seconds", _showcase),)

FAMILIES = (
    SHOWCASE,
    CALIBRATION,
    EXERCISES,
    CHORES,
    GRASPS,
    WRITING,
    RECORDED,
)


@cache
def motions() -> dict[str, Motion]:
    """Motions by name, in the order they are told."""
    return {motion.name: motion for family in FAMILIES for motion in family}
