"""A long recording with a page open, in real time: memory and latency over the time.

    python -m benchmarks.hour --seconds 3600 --json FILE

The same studio, glove and page as in `benchmarks.live`, at the rate people work with. The same hour
in two minutes, without a page, is a test (tests/faults/test_hour.py).
"""

from __future__ import annotations

import json
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from benchmarks.live import figures_of, observe
from benchmarks.observed import Observed, UnmeasuredError
from benchmarks.pages import small_page
from handstudio.recording.take import open_take
from handstudio.shell import err, out, print_table

MINUTE_S = 60.0


def main(
    *,
    rate: int = 100,
    seconds: float = 3600.0,
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
) -> None:
    """Record for long; memory every ten seconds, latency of every minute.

    Args:
        rate: Samples a second of each of the twenty sensors.
        seconds: How long.
        json_file: Where to write the figures.
    """
    try:
        with tempfile.TemporaryDirectory() as temporary:
            place = Path(temporary)
            seen, sent = observe(f"virtual:?rate={rate}", seconds, small_page, place)
            whole = figures_of(rate, seen, open_take(Path(seen.take)), sent)
    except (UnmeasuredError, RuntimeError) as error:
        err.print(f"Not measured: {error}")
        sys.exit(2)
    minutes = by_minute(seen)
    rss_mb = [(round(at_s, 1), round(size / 1e6, 2)) for at_s, size in seen.rss]
    grown_mb = round(rss_mb[-1][1] - _settled(rss_mb, seconds), 2)
    _show(minutes, rss_mb)
    out.print(
        f"{whole.packets} instants, {whole.lost_packets} lost; memory grew by {grown_mb} MB "
        f"after the first tenth; p99 {whole.p99_first_ms} ms in the first quarter, "
        f"{whole.p99_last_ms} ms in the last"
    )
    if json_file is not None:
        figures = asdict(whole) | {
            "grown_mb": grown_mb,
            "rss_mb_over_s": rss_mb,
            "p99_ms_by_minute": minutes,
        }
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(figures, indent=2), encoding="utf-8")


def by_minute(seen: Observed) -> list[float]:
    """The 99th percentile of every minute's chunks [ms]."""
    arrival_s, latency_ms = np.array(seen.arrival_s), np.array(seen.latency_ms)
    minute = (arrival_s // MINUTE_S).astype(int)
    return [
        round(float(np.percentile(latency_ms[minute == k], 99)), 3)
        for k in range(int(minute.max()) + 1)
    ]


def _settled(rss_mb: list[tuple[float, float]], seconds: float) -> float:
    """Memory once a tenth of the time is over."""
    return next(size for at_s, size in rss_mb if at_s >= 0.1 * seconds)


def _show(minutes: list[float], rss_mb: list[tuple[float, float]]) -> None:
    rows = [
        [str(k), f"{p99:.2f}", f"{_at(rss_mb, k * MINUTE_S):.1f}"] for k, p99 in enumerate(minutes)
    ]
    print_table("Minute by minute", ["minute", "p99 [ms]", "memory [MB]"], rows)
    out.print()


def _at(rss_mb: list[tuple[float, float]], at_s: float) -> float:
    return next((size for when_s, size in rss_mb if when_s >= at_s), rss_mb[-1][1])


if __name__ == "__main__":
    tyro.cli(main)
