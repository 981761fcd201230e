"""The host's clock: UTC that never runs backwards."""

from __future__ import annotations

import time

_UTC_AT_START = time.time_ns() - time.monotonic_ns()


def now_ns() -> int:
    """Nanoseconds since 1970 UTC, as known when the program started, counted steadily since.

    Setting the computer's clock during a take moves no chunk.
    """
    return _UTC_AT_START + time.monotonic_ns()
