"""How long things take: counts in bins, all and of late, in memory that does not grow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from handstudio.health.limits import RECENT_WINDOWS

_LOWEST_MS = 0.01
_PER_DECADE = 50  # a bin is 4.7 % wide: no more than that is a percentile too high
_SURE = 0.999  # durations beyond a quantile; 1 but for rounding
_BINS = 6 * _PER_DECADE + 2  # up to 10 s; what is below or above goes to the first and last


@dataclass(frozen=True, slots=True)
class Quantiles:
    """Half, 99 of 100 and all of the durations were at most this [ms]."""

    p50_ms: float
    p99_ms: float
    max_ms: float


class Distribution:
    """Durations [ms]; what `turn` was called `RECENT_WINDOWS` times after is no longer recent."""

    def __init__(self) -> None:
        self._whole = np.zeros(_BINS, dtype=np.int64)
        self._recent = np.zeros((RECENT_WINDOWS, _BINS), dtype=np.int64)
        self._max = 0.0
        self._maxima = [0.0] * RECENT_WINDOWS
        self._at = 0

    def add(self, ms: float) -> None:
        """Count one duration."""
        place = _bin(ms)
        self._whole[place] += 1
        self._recent[self._at, place] += 1
        self._max = max(self._max, ms)
        self._maxima[self._at] = max(self._maxima[self._at], ms)

    def turn(self) -> None:
        """A window ended: forget the oldest of the recent ones."""
        self._at = (self._at + 1) % RECENT_WINDOWS
        self._recent[self._at] = 0
        self._maxima[self._at] = 0.0

    def quantile(self, share: float) -> float | None:
        """At least this share was at most so long, of all [ms]; None of nothing."""
        return _quantile(self._whole, share, self._max)

    def recent_quantile(self, share: float) -> float | None:
        """The same of the recent ones."""
        return _quantile(self._recent.sum(axis=0), share, max(self._maxima))

    def sure_quantile(self, share: float) -> float | None:
        """The same, None of so few that it is the longest: one slow moment is not a habit."""
        counts = self._recent.sum(axis=0)
        if counts.sum() * (1.0 - share) < _SURE:
            return None
        return _quantile(counts, share, max(self._maxima))

    def quantiles(self) -> Quantiles | None:
        """Of all."""
        return _quantiles(self._whole, self._max)

    def recent_quantiles(self) -> Quantiles | None:
        """Of the recent ones."""
        return _quantiles(self._recent.sum(axis=0), max(self._maxima))


def _bin(ms: float) -> int:
    if ms <= _LOWEST_MS:
        return 0
    return min(_BINS - 1, 1 + int(_PER_DECADE * math.log10(ms / _LOWEST_MS)))


def _quantiles(counts: np.ndarray, longest: float) -> Quantiles | None:
    half, most = _quantile(counts, 0.5, longest), _quantile(counts, 0.99, longest)
    return None if half is None or most is None else Quantiles(half, most, longest)


def _quantile(counts: np.ndarray, share: float, longest: float) -> float | None:
    up_to = np.cumsum(counts)
    if up_to[-1] == 0:
        return None
    place = int(np.searchsorted(up_to, math.ceil(share * int(up_to[-1]))))
    return min(longest, _LOWEST_MS * float(10.0 ** (place / _PER_DECADE)))
