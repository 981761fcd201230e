"""The measuring itself: that what is lost is counted, and what is late is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hour import by_minute
from benchmarks.live import Pass, figures_of, limits_of, read_again
from benchmarks.observed import Observed
from benchmarks.pages import Sent
from benchmarks.probes import Latencies, rss_bytes, thread_seconds
from handstudio.device.capture import Capture
from handstudio.device.host_clock import now_ns
from handstudio.recording.simulated import simulate
from handstudio.recording.take import Take, open_take
from handstudio.recording.writer import TakeWriter


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Take:
    return open_take(simulate(tmp_path_factory.mktemp("sessions"), seconds=3.0))


def seen(take: Take, **changes: object) -> Observed:
    latency_ms = np.linspace(1.0, 2.0, 1000)
    told = Observed(
        take=str(take.path),
        seconds=100.0,
        cpu_s=60.0,
        thread_cpu_s={"capture": 40.0},
        missing=0,
        dropped_by_device=0,
        missing_before=0,
        rss=[(0.0, 90_000_000), (100.0, 91_000_000)],
        arrival_s=np.linspace(0.0, 99.9, 1000).tolist(),
        latency_ms=latency_ms.tolist(),
    )
    for name, value in changes.items():
        setattr(told, name, value)
    return told


def figures(take: Take, **changes: object) -> Pass:
    return figures_of(100, seen(take, **changes), take, Sent())


def test_figures_are_of_all_chunks_and_of_the_first_and_last_quarter(take: Take) -> None:
    got = figures(take)
    assert got.lost_packets == 0
    assert got.packets == 301
    assert (got.cpu_cores, got.capture_cores) == (0.6, 0.4)
    assert got.p99_ms == pytest.approx(1.99, abs=0.001)
    assert got.p99_first_ms == pytest.approx(1.25, abs=0.01)
    assert got.p99_last_ms == pytest.approx(1.9975, abs=0.001)
    assert got.max_ms == 2.0


@pytest.mark.parametrize("who", ["missing", "dropped_by_device"])
def test_what_anybody_misses_is_lost(take: Take, who: str) -> None:
    assert figures(take, **{who: 7}).lost_packets == 7


def test_a_file_that_lacks_a_chunk_has_lost_what_was_in_it(take: Take, tmp_path: Path) -> None:
    writer = TakeWriter(tmp_path / "short.mcap", take.header)
    for k, (arrival_ns, chunk) in enumerate(take.chunks()):
        if k != 20:
            writer.write(arrival_ns, chunk)
    short = open_take(writer.close(take.summary))
    whole, _ = read_again(take)
    instants, missing = read_again(short)
    assert instants < whole
    assert missing == whole - instants
    assert figures(short).lost_packets >= whole - instants


def test_limits_are_kept_or_not(take: Take) -> None:
    good = figures(take)
    assert all(limit.met for limit in limits_of(good, good))
    for worse in ({"lost_packets": 1}, {"p99_ms": 10.1}, {"capture_cores": 1.0}):
        assert [limit.met for limit in limits_of(replace(good, **worse), None)].count(False) == 1
    assert not limits_of(replace(good, p99_first_ms=4.0, p99_last_ms=6.1), None)[3].met
    (lost,) = [limit for limit in limits_of(good, replace(good, lost_packets=1)) if not limit.met]
    assert lost.hard


def test_every_minute_has_its_own_percentile(take: Take) -> None:
    assert by_minute(seen(take)) == [pytest.approx(1.59, abs=0.02), pytest.approx(2.0, abs=0.01)]


def test_every_chunk_that_is_published_is_noted() -> None:
    class Quick:
        def _publish(self, motion: object, arrival_ns: int, line: object) -> None:
            """Nothing takes no time."""

    latencies = Latencies(10)
    latencies.watch(Quick)  # type: ignore[arg-type]
    Quick()._publish(None, now_ns(), None)
    latencies.begin()
    for _ in range(3):
        Quick()._publish(None, now_ns() - 5_000_000, None)
    arrival_s, latency_ms = latencies.end()
    assert len(arrival_s) == 3
    assert (latency_ms >= 5.0).all()
    for _ in range(6):
        Quick()._publish(None, now_ns(), None)
    with pytest.raises(RuntimeError, match="room"):
        latencies.end()


def test_the_capture_still_has_what_is_watched() -> None:
    assert callable(Capture._publish)


def test_threads_and_memory_are_told() -> None:
    assert thread_seconds()["page loop"] > 0.0
    assert rss_bytes() > 10_000_000
