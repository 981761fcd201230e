"""The real studio in a process of its own, with probes on it, for one recording.

    python -m benchmarks.observed --address virtual: --seconds 60 --sessions DIR --out FILE

Started by `benchmarks.live` and `benchmarks.hour`: it says where its page is as the studio does,
waits for a line on standard input, records for so long, writes what it saw and ends. The studio
is the product's own loop (`app.__main__.run`); a thread beside it asks for what a person would.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import tyro

import app.__main__ as product
from app import intents
from app.studio import Studio
from benchmarks.probes import Latencies, rss_bytes, thread_seconds
from handstudio.device.capture import Capture
from handstudio.device.orders import Phase
from handstudio.recording.atomic import write_atomically

WITHIN_S = 60.0
"""How long the device or the end of a take may take on a busy machine."""

_SAMPLE_S = 10.0
_MOST_CHUNKS_PER_S = 300  # `device.line` reads every 4 ms at most


class Observed(msgspec.Struct):
    """What one recording was like, from inside the studio."""

    take: str
    seconds: float  # as measured
    cpu_s: float  # of the whole process, without children
    thread_cpu_s: dict[str, float]  # by name
    missing: int  # instants, as the decoder counted them during the recording
    dropped_by_device: int
    missing_before: int  # while the page opened
    rss: list[tuple[float, int]]  # [s since the recording began], [bytes]
    arrival_s: list[float]  # of every chunk, since the recording began
    latency_ms: list[float]  # from there to its published pose


class UnmeasuredError(Exception):
    """What was to be measured did not happen."""


@dataclass
class Conductor:
    """Does what a person would, beside the studio, and takes the readings."""

    studio: Studio
    latencies: Latencies
    seconds: float
    out: Path
    failure: str = ""
    _rss: list[tuple[float, int]] = field(default_factory=list)

    def run(self) -> None:
        """Record once; then end the studio."""
        try:
            write_atomically(self.out, msgspec.msgpack.encode(self._observe()))
            sys.stdin.readline()  # the page is closed first
        except Exception as error:
            self.failure = f"{type(error).__name__}: {error}"
        finally:
            os.kill(os.getpid(), signal.SIGINT)  # as Ctrl-C does

    def _observe(self) -> Observed:
        self._wait("the device streams", lambda: self._newest.phase is Phase.STREAMING)
        if not sys.stdin.readline():
            raise UnmeasuredError("nobody said when to begin")
        before = self._newest.health
        cpu, threads, began = time.process_time(), thread_seconds(), time.monotonic()
        self.latencies.begin()
        self.studio.send(intents.SetCountdown(0))
        self.studio.send(intents.SaveSubject("bench", "right", 187.0, then_record=True))
        self._wait("a take is on", lambda: self._newest.recorder is not None)
        recorder = self._newest.recorder
        assert recorder is not None
        self._let_it_run(began)
        seconds = time.monotonic() - began
        cpu, threads = time.process_time() - cpu, _difference(thread_seconds(), threads)
        arrival_s, latency_ms = self.latencies.end()
        self.studio.send(intents.ToggleRecording())
        self._wait("the take is whole", lambda: recorder.finished)
        after = self._newest.health
        return Observed(
            str(recorder.path),
            seconds,
            cpu,
            threads,
            after.missing - before.missing,
            after.dropped_by_device - before.dropped_by_device,
            before.missing,
            self._rss,
            arrival_s.tolist(),
            latency_ms.tolist(),
        )

    @property
    def _newest(self) -> Any:
        return self.studio.capture.newest

    def _let_it_run(self, began: float) -> None:
        due = began
        while (now := time.monotonic()) < began + self.seconds:
            if now >= due:
                self._rss.append((now - began, rss_bytes()))
                due += _SAMPLE_S
            time.sleep(min(0.5, max(0.0, began + self.seconds - now)))
            if self._newest.recorder is None:
                reports = [str(report) for report in self.studio.state.messages]
                raise UnmeasuredError(f"the take ended by itself: {reports}")
        self._rss.append((time.monotonic() - began, rss_bytes()))

    def _wait(self, what: str, condition: Any) -> None:
        end = time.monotonic() + WITHIN_S
        while not condition():
            if time.monotonic() > end:
                problem = self._newest.problem
                raise UnmeasuredError(f"{what}: not within {WITHIN_S:g} s; {problem}")
            time.sleep(0.02)


def _difference(after: dict[str, float], before: dict[str, float]) -> dict[str, float]:
    return {name: after[name] - before[name] for name in after}


def main(address: str, seconds: float, sessions: Path, out: Path, port: int = 8865) -> None:
    """Run the studio, and a recording in it."""
    conductors: list[Conductor] = []
    latencies = Latencies(int(seconds * _MOST_CHUNKS_PER_S) + 10_000)
    latencies.watch(Capture)
    begin = product._begin

    def begun(studio: Studio, address: str | None) -> None:
        begin(studio, address)
        conductors.append(Conductor(studio, latencies, seconds, out))
        threading.Thread(target=conductors[0].run, name="conductor", daemon=True).start()

    product._begin = begun
    options = product.Options(sessions, address=address, port=port, browser=False)
    code = product.run(options)
    if conductors and conductors[0].failure:
        print(conductors[0].failure, file=sys.stderr)
        code = 1
    sys.exit(code)


if __name__ == "__main__":
    tyro.cli(main)
