"""An hour of a glove as fast as the studio takes it in, recorded; what that cost, as JSON.

    python tests/faults/hour.py FOLDER MINUTES

The product's own capture thread, recorder and studio, in a process without the tests' shape checks.
Only two things are played: the line, which has the next bytes at once, and the clock by which
chunks arrive, which is the glove's, so that the take is a real hour long.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from app import intents
from app.state import State
from app.studio import Studio
from app.work.jobs import Jobs
from benchmarks.probes import rss_bytes
from handstudio.device import capture as capture_module
from handstudio.device.capture import Capture
from handstudio.device.line import Line
from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import CommandDecoder
from handstudio.protocol.packets import (
    Command,
    Health,
    ImuPacket,
    Reply,
    Request,
    Result,
    Status,
    Temperature,
)
from handstudio.recording.take import open_take
from handstudio.samples import ImuSamples
from handstudio.settings import SettingsStore
from handstudio.simulation.glove import SENSORS, description, plain_glove

RATE_HZ = 100
PERIOD_US = 1_000_000 // RATE_HZ
AT_ONCE = 8  # instants in a chunk: more than 3000 bytes, and the line is read without a pause
ROUND_S = 40  # of the showcase; it begins and ends at rest
FIRST_US = (1 << 32) - 600_000_000  # the glove's clock wraps after ten minutes

BEGAN_NS = time.time_ns()


class HourOfBytes:
    """A line to a glove that has performed for an hour already: its bytes are there at once."""

    def __init__(self, minutes: float) -> None:
        self.told = description("right", 5, RATE_HZ, 1, "Virtual glove")
        self.sent = 0  # instants
        self.whole = round(minutes * 60 * RATE_HZ)
        self.may_start = threading.Event()
        self._commands, self._out = CommandDecoder(), bytearray(b"\0")
        self._streams = False
        worn, times_us = plain_glove("right", 5), PERIOD_US * np.arange(ROUND_S * RATE_HZ)
        self._readings = [
            worn.read(times_us[k : k + RATE_HZ], RATE_HZ) for k in range(0, len(times_us), RATE_HZ)
        ]

    @property
    def now_ns(self) -> int:
        """The hour's own time."""
        return BEGAN_NS + self.sent * PERIOD_US * 1000

    def read(self, timeout_s: float) -> bytes:
        """All that is there."""
        if self._streams and self.may_start.is_set():
            for _ in range(min(AT_ONCE, self.whole - self.sent)):
                self._say_instant()
        said = bytes(self._out)
        self._out.clear()
        if not said:
            time.sleep(timeout_s)
        return said

    def write(self, data: bytes) -> None:
        """Obey."""
        for request in self._commands.feed(data):
            assert isinstance(request, Request)
            self._out += encode(Reply(request.command, request.tag, Result.OK, ""))
            if request.command == Command.DESCRIBE:
                self._out += encode(self.told)
            self._streams = self._streams or request.command == Command.START

    def close(self) -> None:
        """Nothing to let go of."""

    def _say_instant(self) -> None:
        second, k = divmod(self.sent, RATE_HZ)
        readings = self._readings[second % ROUND_S]
        clock_us = (FIRST_US + self.sent * PERIOD_US) % (1 << 32)
        n = len(SENSORS)
        answering = np.ones(n, dtype=bool)
        fresh, counts = readings.fresh[k], readings.counts[k]
        self._out += encode(ImuPacket(1, Status(0), self.sent, clock_us, answering, fresh, counts))
        if k == 0:
            self._out += encode(Health(clock_us, self.sent, 0, 5000, (0,) * n))
            self._out += encode(Temperature(clock_us, np.full(n, 31.0)))
        self.sent += 1


class Costs:
    """CPU times with the share of the hour at which they were used; the room is made beforehand."""

    def __init__(self, room: int) -> None:
        self._rows = np.zeros((room, 2))
        self._rows[:] = np.nan  # touched now, not when they are filled
        self._count = 0

    def note(self, share: float, cost: float) -> None:
        """Something is over."""
        self._rows[self._count] = share, cost
        self._count += 1

    def ends(self) -> tuple[float, float]:
        """The median of the first tenth of the hour, and of the last."""
        share, cost = self._rows[: self._count].T
        first, last = (share > 0.0) & (share <= 0.1), (share >= 0.9) & (share < 1.0)
        return float(np.median(cost[first])), float(np.median(cost[last]))


class Observed:
    """What the studio used while the hour went by."""

    def __init__(self, line: HourOfBytes) -> None:
        self._line = line
        self.chunks = Costs(2 * line.whole // AT_ONCE + 1000)
        self.ticks = Costs(2 * line.whole // AT_ONCE + 1000)
        self.rss: list[tuple[float, int]] = []

    @property
    def share(self) -> float:
        """How much of the hour is over."""
        return self._line.sent / self._line.whole

    def watch(self, capture: type[Capture]) -> None:
        """Time what the capture thread makes of each chunk."""
        take_in = capture._take_in

        def timed(self_: Capture, chunk: bytes, arrival_ns: int, line: Line) -> None:
            began = time.thread_time()
            take_in(self_, chunk, arrival_ns, line)
            self.chunks.note(self.share, time.thread_time() - began)

        capture._take_in = timed  # type: ignore[assignment]

    def note(self, tick_s: float) -> None:
        """A tick of the studio is over."""
        self.ticks.note(self.share, tick_s)
        if not self.rss or self.share - self.rss[-1][0] >= 0.01:
            self.rss.append((round(self.share, 4), rss_bytes()))


def main(folder: Path, minutes: float) -> None:
    line = HourOfBytes(minutes)
    observed = Observed(line)
    observed.watch(Capture)
    capture_module.open_source = lambda address: line
    capture_module.now_ns = lambda: line.now_ns
    capture, jobs = Capture(), Jobs()
    capture.start()
    store = SettingsStore(folder / "settings.json")
    studio = Studio(capture, jobs, store, State(folder))
    try:
        path = record(studio, line, observed)
    finally:
        capture.stop()
        jobs.close()
    print(json.dumps(told(path, observed)))


def record(studio: Studio, line: HourOfBytes, observed: Observed) -> Path:
    """Let the hour pass while a take is on; the take."""
    studio.send(intents.ConnectDevice("serial:hour"))
    for _ in ticks(studio, observed):
        if studio.state.newest.setup is not None:
            break
    for intent in (
        intents.PagesOpen(1),
        intents.SetCountdown(0),
        intents.SaveSubject("S01", "right", 187.0, then_record=True),
    ):
        studio.send(intent)
    for _ in ticks(studio, observed):
        if studio.state.newest.recorder is not None:
            break
    recorder = studio.state.newest.recorder
    line.may_start.set()
    for _ in ticks(studio, observed):
        if studio.state.newest.health.packets == line.whole:
            break
    studio.send(intents.ToggleRecording())
    for _ in ticks(studio, observed):
        if recorder.finished and studio.state.review is not None:
            return recorder.path
    raise AssertionError


def ticks(studio: Studio, observed: Observed) -> Iterator[None]:
    """The studio's loop, sixty times a second of ours."""
    before = time.monotonic()
    while True:
        began, now = time.thread_time(), time.monotonic()
        studio.tick(now - before)
        before = now
        observed.note(time.thread_time() - began)
        time.sleep(1 / 60)
        yield


def told(path: Path, observed: Observed) -> dict[str, object]:
    take = open_take(path)
    assert take.summary is not None
    events = [event for events in take.events() for event in events]
    return {
        "packets": take.summary.packets,
        "missing": take.summary.missing,
        "instants_in_file": sum(len(event) for event in events if isinstance(event, ImuSamples)),
        "rss": observed.rss,
        "chunk_s": observed.chunks.ends(),
        "tick_s": observed.ticks.ends(),
    }


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]))
