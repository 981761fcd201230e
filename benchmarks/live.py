"""How the studio keeps up: a glove of twenty sensors at 1000 Hz, recorded, with a page open.

    python -m benchmarks.live --rate 1000 --seconds 60 --json FILE

Two passes on the same two cores, each the product's own studio (`benchmarks.observed`) with the
virtual glove in its own process and a take on a real file: first a page that takes in whatever it
is sent and draws nothing, then a Chromium that draws in software, which alone can fill both cores.
Everything is counted, nothing sampled: instants that are missing, as the decoder tells, as the
glove tells, and as the recorded file says when it is read again; and for every chunk the time from
when the read returned until its pose was published.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import tyro

from benchmarks.observed import Observed, UnmeasuredError
from benchmarks.pages import Sent, browser_page, small_page
from handstudio.arrays import Array
from handstudio.protocol.packets import ImuPacket, Missing
from handstudio.recording.take import Take, open_take
from handstudio.shell import err, out, print_table
from handstudio.stream import EventStream

CORES = 2
P99_MS = 10.0
SETTLE_S = 3.0  # between the page's opening and the recording: shaders, fonts, first plots

OpenPage = Callable[[str], AbstractContextManager[Sent]]


@dataclass(frozen=True, slots=True)
class Pass:
    """The figures of one pass."""

    rate_hz: int
    seconds: float
    packets: int  # instants in the recorded file
    chunks: int
    lost_packets: int
    lost_before: int  # while the page opened: not part of the recording
    p50_ms: float
    p99_ms: float
    p99_first_ms: float  # in the first quarter of the pass
    p99_last_ms: float  # in the last
    max_ms: float
    cpu_cores: float  # of the whole studio process, without glove and browser
    capture_cores: float  # of the capture thread
    threads: dict[str, float]
    rss_mb: float  # at the end
    page: Sent


@dataclass(frozen=True, slots=True)
class Limit:
    """What a pass should keep."""

    words: str
    met: bool
    hard: bool = False


def main(
    *,
    rate: int = 1000,
    seconds: float = 60.0,
    json_file: Annotated[Path | None, tyro.conf.arg(name="json")] = None,
    browser: bool = True,
    check: bool = False,
    check_lost: bool = False,
) -> None:
    """Measure how the studio keeps up with a glove while it records and shows.

    Args:
        rate: Samples a second of each of the twenty sensors.
        seconds: How long each of the two passes records.
        json_file: Where to write the figures.
        browser: Make the pass with a real browser too.
        check: Exit with 1 where a limit is not met.
        check_lost: Exit with 1 where a packet was lost; the times are printed only.
    """
    share(CORES)
    try:
        small = measure(rate, seconds, small_page)
        drawn = measure(rate, seconds, browser_page) if browser else None
    except (UnmeasuredError, RuntimeError) as error:
        err.print(f"Not measured: {error}")
        sys.exit(2)
    _show(small, drawn)
    limits = limits_of(small, drawn)
    for limit in limits:
        out.print(f"{'met    ' if limit.met else 'NOT MET'}  {limit.words}")
    if json_file is not None:
        figures = asdict(small) | {"browser": asdict(drawn) if drawn else None}
        json_file.parent.mkdir(parents=True, exist_ok=True)
        json_file.write_text(json.dumps(figures, indent=2), encoding="utf-8")
    sys.exit(any(not limit.met and (check or (check_lost and limit.hard)) for limit in limits))


def limits_of(small: Pass, drawn: Pass | None) -> list[Limit]:
    """What should hold of the passes, and whether it does."""
    passes = [one for one in (small, drawn) if one is not None]
    lost = sum(one.lost_packets for one in passes)
    return [
        Limit(f"nothing lost: {lost} packets", lost == 0, hard=True),
        Limit(
            f"a pose within {P99_MS:g} ms of its bytes: p99 {small.p99_ms:.2f} ms",
            small.p99_ms <= P99_MS,
        ),
        Limit(
            f"capture under one core: {small.capture_cores:.2f}",
            small.capture_cores < 1.0,
        ),
        Limit(
            f"latency does not grow: p99 {small.p99_first_ms:.2f} ms in the first quarter, "
            f"{small.p99_last_ms:.2f} ms in the last",
            small.p99_last_ms <= max(1.5 * small.p99_first_ms, P99_MS / 2),
        ),
    ]


# --- one pass -------------------------------------------------------------------------------------


def measure(rate_hz: int, seconds: float, open_page: OpenPage) -> Pass:
    """One recording with a page open.

    Raises:
        UnmeasuredError: something that was to be seen did not happen.
    """
    with tempfile.TemporaryDirectory() as temporary:
        seen, sent = observe(f"virtual:?rate={rate_hz}", seconds, open_page, Path(temporary))
        return figures_of(rate_hz, seen, open_take(Path(seen.take)), sent)


def observe(
    address: str, seconds: float, open_page: OpenPage, place: Path
) -> tuple[Observed, Sent]:
    """Record in the real studio; what it saw, and what its page was sent.

    The take stays in ``place``.

    Raises:
        UnmeasuredError: something that was to be seen did not happen.
    """
    result = place / "observed"
    with _studio(address, seconds, place / "sessions", result) as (studio, url):
        with open_page(url) as sent:
            time.sleep(SETTLE_S)
            assert studio.stdin is not None
            studio.stdin.write("begin\n")
            studio.stdin.flush()
            _await(studio, result)
        studio.stdin.close()
        studio.wait()
    return msgspec.msgpack.decode(result.read_bytes(), type=Observed), sent


@contextmanager
def _studio(
    address: str, seconds: float, sessions: Path, result: Path
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    command = [sys.executable, "-m", "benchmarks.observed", "--address", address]
    command += ["--seconds", str(seconds), "--sessions", str(sessions), "--out", str(result)]
    studio = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        yield studio, _url(studio)
    finally:
        studio.kill()
        studio.wait()
        for pipe in (studio.stdin, studio.stdout):
            if pipe is not None:
                pipe.close()


def _url(studio: subprocess.Popen[str]) -> str:
    assert studio.stdout is not None
    for line in studio.stdout:
        if found := re.search(r"http://localhost:\d+", line):
            return found.group()
    raise UnmeasuredError("the studio ended before it served")


def _await(studio: subprocess.Popen[str], result: Path) -> None:
    while not result.exists():
        if studio.poll() is not None:
            raise UnmeasuredError("the studio ended before it had seen anything")
        time.sleep(0.1)


def share(cores: int) -> None:
    """Glove, studio, browser and all else share so many cores, as equals.

    A Chromium that root starts puts itself before everybody else, which nobody's can: here neither.
    """
    if sys.platform == "linux":
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])
        ctypes.CDLL(None).prctl(_PR_CAPBSET_DROP, _CAP_SYS_NICE)  # of what is started from now on


_PR_CAPBSET_DROP, _CAP_SYS_NICE = 24, 23


# --- figures --------------------------------------------------------------------------------------


def figures_of(rate_hz: int, seen: Observed, take: Take, sent: Sent) -> Pass:
    """What a recording comes to."""
    arrival_s, latency_ms = np.array(seen.arrival_s), np.array(seen.latency_ms)
    first, last = arrival_s < seen.seconds / 4, arrival_s >= seen.seconds * 3 / 4
    instants, lost_in_file = read_again(take)
    told = take.summary
    assert told is not None
    # the same stream, counted by different people: what anybody misses is lost
    lost = max(seen.missing, told.missing, lost_in_file, seen.dropped_by_device)
    return Pass(
        rate_hz=rate_hz,
        seconds=round(seen.seconds, 3),
        packets=instants,
        chunks=len(latency_ms),
        lost_packets=lost + abs(told.packets - instants),
        lost_before=seen.missing_before,
        p50_ms=_percentile(latency_ms, 50),
        p99_ms=_percentile(latency_ms, 99),
        p99_first_ms=_percentile(latency_ms[first], 99),
        p99_last_ms=_percentile(latency_ms[last], 99),
        max_ms=_percentile(latency_ms, 100),
        cpu_cores=round(seen.cpu_s / seen.seconds, 3),
        capture_cores=round(seen.thread_cpu_s["capture"] / seen.seconds, 3),
        threads={name: round(s / seen.seconds, 3) for name, s in seen.thread_cpu_s.items()},
        rss_mb=round(seen.rss[-1][1] / 1e6, 1),
        page=sent,
    )


def read_again(take: Take) -> tuple[int, int]:
    """Instants in a recorded file, and how many are missing between them."""
    setup = take.header.setup
    assert setup.decoder is not None
    # what was held of a half frame when the take began stands in its first state
    held = take.first_state.stream
    stream = EventStream(setup.decoder, setup.ranges)
    if held:
        stream = EventStream.resumed(setup.decoder, setup.ranges, held)
    instants = missing = 0
    for arrival_ns, chunk in take.chunks():
        packets, _ = stream.feed(chunk, arrival_ns)
        instants += sum(isinstance(packet, ImuPacket) for packet in packets)
        missing += sum(packet.count for packet in packets if isinstance(packet, Missing))
    return instants, missing


def _percentile(values: Array, percent: float) -> float:
    return round(float(np.percentile(values, percent)), 3)


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"


def _show(small: Pass, drawn: Pass | None) -> None:
    passes = [one for one in (small, drawn) if one is not None]
    rows = [
        ["instants recorded", *(str(one.packets) for one in passes)],
        ["lost", *(str(one.lost_packets) for one in passes)],
        ["lost while the page opened", *(str(one.lost_before) for one in passes)],
        ["bytes to pose, p50 [ms]", *(f"{one.p50_ms:.2f}" for one in passes)],
        ["bytes to pose, p99 [ms]", *(f"{one.p99_ms:.2f}" for one in passes)],
        ["  in the first quarter", *(f"{one.p99_first_ms:.2f}" for one in passes)],
        ["  in the last", *(f"{one.p99_last_ms:.2f}" for one in passes)],
        ["longest [ms]", *(f"{one.max_ms:.2f}" for one in passes)],
        ["whole studio [cores]", *(f"{one.cpu_cores:.2f}" for one in passes)],
        *([f"  {name}", *(f"{one.threads[name]:.2f}" for one in passes)] for name in small.threads),
        ["memory at the end [MB]", *(f"{one.rss_mb:.0f}" for one in passes)],
        ["page updates a second", *(_figure(one.page.messages_per_s) for one in passes)],
        ["longest without one [ms]", *(_figure(one.page.longest_silence_ms) for one in passes)],
    ]
    title = f"20 sensors at {small.rate_hz} Hz, {small.seconds:.0f} s recorded, {CORES} cores"
    print_table(title, ["", "a page that only listens", "a browser"][: len(passes) + 1], rows)
    out.print()


if __name__ == "__main__":
    tyro.cli(main)
