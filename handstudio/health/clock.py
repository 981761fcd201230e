"""How a device's clock runs against the host's.

A chunk cannot arrive before it is sent, so the smallest difference between arrival and device
time within a second is the least delayed; a line through these minima is offset and drift.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from handstudio.health.limits import DRIFT_BINS

_BIN_US = 1_000_000
_BINS = 120


class ClockEstimate:
    """Estimates host minus device time from arrivals; begins anew when the device does."""

    def __init__(self) -> None:
        self._bins: deque[tuple[int, int]] = deque(maxlen=_BINS)  # device µs, difference µs

    def restart(self) -> None:
        """The device's clock started over."""
        self._bins.clear()

    def observe(self, device_us: int, arrival_ns: int) -> None:
        """The newest instant in a chunk and when the chunk arrived."""
        difference = arrival_ns // 1000 - device_us
        if self._bins and device_us // _BIN_US == self._bins[-1][0] // _BIN_US:
            if difference < self._bins[-1][1]:
                self._bins[-1] = (device_us, difference)
        else:
            self._bins.append((device_us, difference))

    @property
    def drift_ppm(self) -> float | None:
        """How much faster the host's clock runs [1e-6]; None within the first ten seconds."""
        if len(self._bins) < 10:
            return None
        device, difference = np.array(self._bins, dtype=float).T
        return float(np.polyfit(device - device[0], difference - difference[0], 1)[0] * 1e6)

    @property
    def sure_drift_ppm(self) -> float | None:
        """The same from the least delayed of the first and of the last third alone [1e-6].

        Rougher, but a host that stood still for seconds does not look like a clock that runs
        fast. None within the first `DRIFT_BINS` seconds.
        """
        if len(self._bins) < DRIFT_BINS:
            return None
        bins, third = list(self._bins), len(self._bins) // 3
        first = min(bins[:third], key=lambda one: one[1])
        last = min(bins[-third:], key=lambda one: one[1])
        return (last[1] - first[1]) * 1e6 / (last[0] - first[0])

    def offset_ns(self) -> int | None:
        """Host minus device time now, least delay included; None before the first arrival."""
        if not self._bins:
            return None
        return min(difference for _, difference in list(self._bins)[-10:]) * 1000

    def delay_ms(self, device_us: int, arrival_ns: int) -> float:
        """How much later than the least delayed of late this instant arrived [ms]."""
        offset = self.offset_ns()
        if offset is None:
            return 0.0
        return (arrival_ns - device_us * 1000 - offset) * 1e-6
