"""Judging every sensor by its windows, and what became of it in all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.health import limits
from handstudio.health.field import FieldReference
from handstudio.health.findings import Kind
from handstudio.health.measures import Measures


@dataclass(frozen=True, slots=True, eq=False)
class SensorValues:
    """A window's values of every sensor; unit as `Kind` says, NaN unknown."""

    silent: Float[Array, " s"]
    stuck: Float[Array, " s"]
    saturated: Float[Array, " s"]
    noisy: Float[Array, " s"]
    magnetic: Float[Array, " s"]

    def by_kind(self) -> dict[Kind, Array]:
        """Each under the kind of finding it may raise."""
        return {
            Kind.SILENT: self.silent,
            Kind.STUCK: self.stuck,
            Kind.SATURATED: self.saturated,
            Kind.NOISY: self.noisy,
            Kind.MAGNETIC: self.magnetic,
        }


class SensorJudge:
    """Turns measures into values; remembers what takes longer than a window."""

    def __init__(self, sensors: int, rate_hz: float) -> None:
        self.saturated = np.zeros(sensors, dtype=np.int64)  # instants, in total
        self.silent = np.zeros(sensors, dtype=np.int64)
        self._stuck_s = np.zeros(sensors)
        self._period_s = 1.0 / rate_hz
        self._per_root_hz = (0.5 * rate_hz) ** -0.5  # of white noise limited to half the rate
        self._field = FieldReference(sensors)

    def judge(self, measures: Measures, disturbed: Bool[Array, " s"]) -> SensorValues:
        """The values of the next window.

        Args:
            measures: Of the window.
            disturbed: Whose field is known to be wrong, and no guide to what is right.
        """
        count = measures.instants
        silent = count - measures.answered
        self.saturated += measures.saturated
        self.silent += silent
        seconds = (measures.end_us - measures.start_us) * 1e-6 + self._period_s
        still = _still(measures)
        share = 100.0 / count if measures.telling else np.nan
        field = np.where(measures.telling, measures.field, np.nan)
        return SensorValues(
            silent=share * silent,
            stuck=self._stuck(measures, seconds),
            saturated=share * measures.saturated,
            noisy=self._noisy(measures, still),
            magnetic=self._field.deviation(field, measures.dip, still, seconds, disturbed),
        )

    def _stuck(self, measures: Measures, seconds: float) -> Array:
        """How long gyroscope and accelerometer, or one while the other moves, stay as they are."""
        gyr, acc = measures.spread_gyr == 0.0, measures.spread_acc == 0.0
        moves = (measures.spread_acc > limits.STILL_ACC, measures.spread_gyr > limits.STILL_GYR)
        frozen = (gyr & acc) | (gyr & moves[0]) | (acc & moves[1])
        answering = ~np.isnan(measures.spread_gyr)
        # all at once is not a sensor: a device that repeats itself, or a rest without any noise
        alone = bool((answering & ~frozen).any()) or len(frozen) == 1
        self._stuck_s = np.where(frozen & alone, self._stuck_s + seconds, 0.0)
        return self._stuck_s.copy()

    def _noisy(self, measures: Measures, still: Array) -> Array:
        """Noise as a multiple of what is usual; NaN unless the hand rests."""
        nothing = np.full(len(still), np.nan)
        known = ~np.isnan(measures.noise_gyr)
        resting = still.sum() >= max(1.0, limits.STILL_SHARE * known.sum())
        if not (measures.telling and resting):
            return nothing
        gyr = _ratio(measures.noise_gyr * self._per_root_hz, still, limits.TYPICAL_GYR_DENSITY)
        acc = _ratio(measures.noise_acc * self._per_root_hz, still, limits.TYPICAL_ACC_DENSITY)
        return np.where(still, np.maximum(gyr, acc), np.nan)


def _ratio(density: Array, still: Array, typical: float) -> Array:
    ratio: Array = density / max(typical, float(np.median(density[still])))
    return ratio


def _still(measures: Measures) -> Array:
    """Who does not move, its own noise apart; False where that is unknown.

    Not a single count of noise: what does not change tells nothing of rest.
    """
    gyr = limits.STILL_GYR + limits.STILL_NOISE * measures.noise_gyr
    acc = limits.STILL_ACC + limits.STILL_NOISE * measures.noise_acc
    alive = (measures.spread_gyr > 0.0) & (measures.spread_acc > 0.0)
    still: Array = alive & (measures.spread_gyr <= gyr) & (measures.spread_acc <= acc)
    return still
