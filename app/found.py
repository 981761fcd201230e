"""What was found in a take that is open: what was written, and what was grasped. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from handstudio.analysis.take_grasps import TakenGrasp, can_tell_grasps, grasps_in
from handstudio.analysis.take_writing import can_tell_writing, writings_in
from handstudio.analysis.writing import Writing
from handstudio.pipeline import Motion
from handstudio.setup import Setup


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Times are in seconds from the take's first instant."""

    writings: tuple[Writing, ...] = ()
    grasps: tuple[TakenGrasp, ...] = ()

    def writing_at(self, seconds: float) -> Writing | None:
        """The one that is going on, else the last one that was written."""
        begun = [writing for writing in self.writings if writing.time_s[0] <= seconds]
        return begun[-1] if begun else None

    def grasp_at(self, seconds: float) -> TakenGrasp | None:
        """The one that is going on."""
        for grasp in self.grasps:
            if grasp.segment.start_s <= seconds <= grasp.segment.end_s:
                return grasp
        return None


def found_in(setup: Setup, motion: Motion) -> Found:
    """All of it; nothing of what the layout cannot tell."""
    writings = writings_in(setup, motion) if can_tell_writing(setup.layout) else []
    if not can_tell_grasps(setup.layout):
        return Found(tuple(writings))
    return Found(tuple(writings), tuple(grasps_in(setup, motion, writings=writings)))
