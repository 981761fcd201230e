"""Instants as frames of an even rate, for formats that know no times."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Int64

from handstudio.arrays import Array
from handstudio.export.part import BLOCK, Part
from handstudio.pipeline import Motion

_EXACT = 1e-3  # frames: within this the nominal rate is the rate


@dataclass(frozen=True, slots=True)
class Frames:
    """Which frame each instant is; frame k lies ``k / rate_hz`` after the take's first instant.

    Attributes:
        rate_hz: Frames a second.
        at: The frame of every instant; what is skipped is missing.
        off_s: How far an instant lies off its frame at most.
    """

    rate_hz: float
    at: Int64[Array, " n"]
    off_s: float

    @property
    def first(self) -> int:
        """The first frame, from the take's first instant."""
        return int(self.at[0])

    @property
    def count(self) -> int:
        """Frames from the first to the last, those without an instant included."""
        return int(self.at[-1]) - self.first + 1

    def facts(self) -> dict[str, Any]:
        """What a reader has to know of them."""
        return {
            "frame_rate_hz": self.rate_hz,
            "first_frame": self.first,
            "frames": self.count,
            "frames_without_an_instant": self.count - len(self.at),
            "largest_time_deviation_s": self.off_s,
        }


def frames_of(part: Part) -> Frames:
    """The even frames that come nearest: at the nominal rate where that is exact.

    Else at the rate that is measured, over steps of a whole number of usual ones.
    """
    time_s = part.seconds(part.motion)
    nominal = part.setup.rate_hz
    at = np.rint(time_s * nominal).astype(np.int64)
    if np.all(np.diff(at) > 0) and np.abs(time_s * nominal - at).max() <= _EXACT:
        return _judged(nominal, at, time_s)
    steps = np.diff(time_s)
    usual = float(np.median(steps)) if len(steps) else 1.0 / nominal
    passed = np.concatenate([[0], np.cumsum(np.maximum(1, np.rint(steps / usual)))])
    rate = float(passed[-1] / (time_s[-1] - time_s[0])) if len(steps) else nominal
    first = np.rint(time_s[0] * rate)
    return _judged(rate, (first + passed).astype(np.int64), time_s)


def blocks(part: Part, frames: Frames) -> Iterator[tuple[int, int, Motion, Int64[Array, " n"]]]:
    """Some frames at a time: the first, how many, their instants, and which of these each is."""
    end = frames.first + frames.count
    for first in range(frames.first, end, BLOCK):
        count = min(BLOCK, end - first)
        a, b = np.searchsorted(frames.at, [first, first + count])
        yield first, count, part.motion[a:b], frames.at[a:b] - first
        part.tell(min(1.0, (first + count - frames.first) / frames.count))


def _judged(rate_hz: float, at: Array, time_s: Array) -> Frames:
    off = float(np.abs(at / rate_hz - time_s).max())
    return Frames(rate_hz, at, round(off, 7))
