"""Readings of a running process: every chunk's latency, memory, the time of each thread."""

from __future__ import annotations

import resource
import sys
import threading
import time
from pathlib import Path

import numpy as np

from handstudio.arrays import Array
from handstudio.device.capture import Capture
from handstudio.device.host_clock import now_ns
from handstudio.device.line import Line
from handstudio.pipeline import Motion


class Latencies:
    """How long every chunk took from its arrival until its pose was published.

    The rows are made beforehand, so that a long run does not look as if it grew.

    Args:
        most: Chunks there is room for.
    """

    def __init__(self, most: int) -> None:
        self._rows = np.zeros((most, 2), dtype=np.int64)  # arrival, until published [ns]
        self._rows[:] = -1  # touched now, not when they are filled
        self._count = self._first = 0

    def watch(self, capture: type[Capture]) -> None:
        """Note every chunk that this kind of capture publishes, the publishing included."""
        publish = capture._publish

        def noted(self_: Capture, motion: Motion, arrival_ns: int, line: Line) -> None:
            publish(self_, motion, arrival_ns, line)
            if self._count < len(self._rows):
                self._rows[self._count] = arrival_ns, now_ns() - arrival_ns
                self._count += 1

        capture._publish = noted  # type: ignore[assignment]

    def begin(self) -> None:
        """What was published until now does not count."""
        self._first, self._began_ns = self._count, now_ns()

    def end(self) -> tuple[Array, Array]:
        """When each chunk since then arrived [s] and how long it took [ms].

        Raises:
            RuntimeError: there were more than there is room for.
        """
        if self._count == len(self._rows):
            raise RuntimeError(f"there is room for {self._count} chunks only")
        rows = self._rows[self._first : self._count]
        return (rows[:, 0] - self._began_ns) * 1e-9, rows[:, 1] * 1e-6


def thread_seconds() -> dict[str, float]:
    """CPU time of every thread that lives [s], by name; those without one of ours together."""
    ours = {"MainThread": "page loop", "capture": "capture", "take writer": "take writer"}
    found = dict.fromkeys([*ours.values(), "others"], 0.0)
    for thread in threading.enumerate():
        if thread.ident is not None and sys.platform == "linux":
            clock = time.pthread_getcpuclockid(thread.ident)
            found[ours.get(thread.name, "others")] += time.clock_gettime(clock)
    return found


def rss_bytes() -> int:
    """Memory of this process; where the system does not say, the most it ever had."""
    statm = Path("/proc/self/statm")
    if statm.exists():
        return int(statm.read_text().split()[1]) * resource.getpagesize()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
