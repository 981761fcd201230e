"""A recorded take fused with its future: the pipeline, and back over overlapping blocks.

Memory stays flat however long the take is. What lies farther ahead than the overlap moves no
orientation by more than the filter's own drift over it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import accumulate
from typing import Any, cast

import msgspec
import numpy as np

from handstudio import pipeline
from handstudio.errors import SetupError
from handstudio.fusion.tree_filter import TreeFilter
from handstudio.fusion.tree_smoother import Stretch, Taping, smoothed
from handstudio.hand_fit import mechanism_of
from handstudio.pipeline import Motion, State
from handstudio.samples import Event
from handstudio.setup import Setup

AHEAD_S = 30.0
"""How much of the future is taken in, at least, where the take goes on for so long."""

_BLOCK_S = 60.0  # given out in one go


class Smoother:
    """Runs the pipeline and keeps back what its future is still awaited for.

    Raises:
        SetupError: only the tree filter can be smoothed.
    """

    def __init__(self, setup: Setup) -> None:
        if not isinstance(setup.filter, TreeFilter):
            raise SetupError(
                "Only the tree filter can be smoothed.", "Choose it, or do without smoothing."
            )
        self._setup, self._taping = setup, Taping(setup.filter)
        # it stands in for the filter it tapes
        self._taped = msgspec.structs.replace(setup, filter=cast(Any, self._taping))
        self._motions: list[Motion] = []
        self._ahead = round(AHEAD_S * setup.rate_hz)
        self._most = self._ahead + round(_BLOCK_S * setup.rate_hz)

    def run(self, state: State, events: Iterable[Event]) -> tuple[Motion, State]:
        """Take in events; the motion that is ready, and the state to go on from."""
        motion, state = pipeline.run(self._taped, state, events)
        self._motions.append(motion)
        count = sum(len(motion) for motion in self._motions)
        return self._given(count - self._ahead if count >= self._most else 0), state

    def rest(self) -> Motion:
        """The motion that nothing comes after."""
        return self._given(sum(len(motion) for motion in self._motions))

    def _given(self, count: int) -> Motion:
        """The first instants that are kept; the stretches behind them are let go."""
        if count == 0:
            return pipeline.empty(len(self._setup.layout.sensors))
        whole = pipeline.join(self._motions)
        stretches = self._taping.stretches
        q, sd = smoothed(stretches, mechanism_of(self._setup))
        ends = list(accumulate(_shown(stretch) for stretch in stretches))
        done = int(np.searchsorted(ends, count, side="right"))
        count = ends[done - 1] if done else 0  # stretches are not cut
        del stretches[:done]
        self._motions = [whole[count:]]
        sure = sd[:count].astype(np.float32)
        return replace(whole[:count], q_world_sensor=q[:count], sd_rad=sure)


def _shown(stretch: Stretch | None) -> int:
    return len(stretch.q_world_sensor) if stretch is not None and stretch.shown else 0
