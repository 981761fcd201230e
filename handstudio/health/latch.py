"""On at once or after a hold, off after having been well for a while: findings do not flicker."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.health.findings import PER_SENSOR, Finding, Kind, Level
from handstudio.health.limits import KEEP, LIMITS, OFF_S

_A_MOMENT_S = 1e-3  # sums of windows end a rounding before what they should be


class Latch:
    """One kind of finding, of every sensor or, with one place, of the stream."""

    def __init__(self, kind: Kind, places: int) -> None:
        self.kind = kind
        self._limits = np.array([[LIMITS[kind].note], [LIMITS[kind].act]])
        self.on: Bool[Array, "2 k"] = np.zeros((2, places), dtype=bool)  # note, act
        self.bad_until_s = 0.0  # end of the last window that was bad anywhere
        self.shown: Float[Array, " k"] = np.zeros(places)  # the last bad value
        self._run = np.zeros((2, places), dtype=int)  # bad windows in a row
        self._well_s = np.zeros((2, places))
        self._began_s = np.zeros((2, places))

    def update(
        self, value: Float[Array, " k"], start_s: float, end_s: float, span_s: float
    ) -> None:
        """Take a window's values; NaN says nothing, neither good nor bad."""
        bad = value > np.where(self.on, self._limits * KEEP, self._limits)
        known = ~np.isnan(value)
        self._began_s = np.where(bad & (self._run == 0) & ~self.on, start_s, self._began_s)
        self._run = np.where(bad, self._run + 1, np.where(known, 0, self._run))
        self._well_s = np.where(bad, 0.0, self._well_s + np.where(known, span_s, 0.0))
        rise = bad & (self._run >= LIMITS[self.kind].hold)
        self.on = (self.on | rise) & (self._well_s < OFF_S - _A_MOMENT_S)
        self.shown = np.where(bad[0], value, self.shown)
        if (bad[0] & self.on[0]).any():
            self.bad_until_s = end_s

    @property
    def since_s(self) -> float:
        """When what is on now began."""
        return float(self._began_s[0][self.on[0]].min())

    def findings(self) -> list[Finding]:
        """What is on, the worse first."""
        note, act = self.on
        found = [self._finding("act", 1, act), self._finding("note", 0, note & ~act)]
        return [finding for finding in found if finding is not None]

    def _finding(self, level: Level, row: int, on: Bool[Array, " k"]) -> Finding | None:
        where = np.flatnonzero(on)
        if len(where) == 0:
            return None
        return Finding(
            self.kind,
            level,
            tuple(map(int, where)) if self.kind in PER_SENSOR else (),
            float(self.shown[where].max()),
            float(self._limits[row, 0]),
            float(self._began_s[row, where].min()),
        )
