"""When poses were told, on the host's clock, whatever clock the tracker has.

A tracker's own times are even where arrivals are not; but they may be of another clock, stand
still, or be missing. Which of these it is, is decided once, from the first poses, so that live and
from a take the same times come out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int64

from handstudio.arrays import Array

FIRST = 120
"""So many poses decide; until then there are no times."""

_SAME_US = 2_000_000  # a clock that is nearer is the host's, and what is between them is delay
_PACE = 0.2  # what goes faster or slower by more is no clock; arrivals are uneven, come in bursts


@dataclass(frozen=True, slots=True)
class TrackerClock:
    """How a tracker's own times become the host's.

    Attributes:
        sound: Whether it has a clock at all; if not, arrivals are all there is.
        offset_us: What is added to its times.
    """

    sound: bool
    offset_us: int = 0

    def told_us(
        self, arrival_us: Int64[Array, " n"], own_us: Int64[Array, " n"]
    ) -> Int64[Array, " n"]:
        """When poses were told [µs], on the host's clock; where its own is far off, arrival."""
        told = own_us + self.offset_us
        far = np.abs(told - arrival_us) > _SAME_US
        return np.where(far | (not self.sound), arrival_us, told)


def clock_of(arrival_us: Int64[Array, " n"], own_us: Int64[Array, " n"]) -> TrackerClock | None:
    """The clock of a tracker by its first poses; None while there are too few."""
    if len(arrival_us) < FIRST:
        return None
    arrival, own = arrival_us[:FIRST], own_us[:FIRST]
    rises = np.mean(np.diff(own) > 0) >= 0.9
    late = arrival - own
    if rises and np.mean(np.abs(late) < _SAME_US) >= 0.9:
        return TrackerClock(sound=True)  # the host's, in whatever bursts it came
    half = FIRST // 2
    took = np.maximum(arrival[half:] - arrival[:-half], 1)
    pace = float(np.median((own[half:] - own[:-half]) / took))
    if not rises or abs(pace - 1.0) > _PACE:
        return TrackerClock(sound=False)
    # of another origin: the least delayed of the first tells where it begins
    return TrackerClock(True, int(late.min()))
