"""The tracker thread: owns the line to a tracker, gives its poses to the take, and keeps them.

Nothing else reads that line, so that a pose's arrival is when it arrived. A tracker that goes away
is looked for until it is back; neither it nor what it tells ever stops a take.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol, runtime_checkable

import numpy as np

from handstudio.device.host_clock import now_ns
from handstudio.device.lsl import LslTracker
from handstudio.device.recorder import Recorder
from handstudio.errors import DeviceError, HandstudioError
from handstudio.recording.tracker_message import Poses, TrackerFacts
from handstudio.trackers.track import Track

LSL = "lsl:"
SILENT_S = 1.0
"""Without a word from it for so long a tracker counts as gone."""

_FIND_S = 2.0
_READ_S = 0.1
_RETRY_S = 1.0
_FROZEN = 30  # poses that are the same to the last bit: a tracker that rests still has noise
_KEPT = 4000  # batches for whoever follows; half a minute without a reader, and more


class TrackerPhase(Enum):
    """Where the line to a tracker stands."""

    LOOKING = "looking"
    STREAMING = "streaming"
    GONE = "gone"  # it was there and says nothing any more


@dataclass(frozen=True, slots=True)
class TrackerNow:
    """What the tracker thread knows, at one moment.

    Attributes:
        facts: What was chosen.
        phase: Where the line stands.
        terminals: Those that it tells of.
        count: Poses so far.
        unseen: Whether the newest says that nothing is seen.
        frozen: Whether it tells the same pose again and again.
        problem: Why it cannot be had.
    """

    facts: TrackerFacts
    phase: TrackerPhase = TrackerPhase.LOOKING
    terminals: tuple[str, ...] = ()
    count: int = 0
    unseen: bool = False
    frozen: bool = False
    problem: HandstudioError | None = None


@runtime_checkable
class Recording(Protocol):
    """Whoever knows the take that is on."""

    def recorder(self) -> Recorder | None:
        """The take that poses go into now."""


class TrackerReader:
    """The thread and the doors to it.

    Args:
        facts: Which tracker.
        takes: Who knows the take that is on.

    Raises:
        DeviceError: that is no address of a tracker.
    """

    def __init__(self, facts: TrackerFacts, takes: Recording) -> None:
        if not facts.source.startswith(LSL) or facts.source == LSL:
            raise DeviceError(
                "{address!r} is not the address of a tracker.",
                "Write lsl:NAME, the name of its stream of the Lab Streaming Layer.",
                address=facts.source,
            )
        self.newest = TrackerNow(facts)
        self._takes = takes
        self._poses: deque[Poses] = deque(maxlen=_KEPT)
        self._ended = threading.Event()
        self._same = 0
        self._before: Poses | None = None
        self._thread = threading.Thread(target=self._run, name="tracker", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def drain(self) -> list[Poses]:
        """What came since the last call, oldest first; for one reader."""
        return [self._poses.popleft() for _ in range(len(self._poses))]

    def end(self) -> None:
        """Let go of the line; returns at once."""
        self._ended.set()

    def join(self) -> None:
        """Wait until the thread has ended."""
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                self._read_on()
            except HandstudioError as error:
                self.newest = replace(self.newest, problem=error)
            except Exception as error:  # a thread must not die unseen
                problem = DeviceError(
                    "The tracker's stream cannot be read ({kind}: {reason}).",
                    "Start its streaming anew; it is looked for until it is there.",
                    kind=type(error).__name__,
                    reason=error,
                )
                self.newest = replace(self.newest, problem=problem)
            self._ended.wait(_RETRY_S)

    def _read_on(self) -> None:
        line = LslTracker(self.newest.facts.source.removeprefix(LSL), _FIND_S)
        heard = time.monotonic()
        try:
            while not self._ended.is_set():
                tracks, arrival_ns = line.read(_READ_S), now_ns()
                if len(tracks[0].time_us):
                    heard = time.monotonic()
                    self._take_in(tracks, arrival_ns)
                elif time.monotonic() - heard > SILENT_S and self.newest.count:
                    self.newest = replace(self.newest, phase=TrackerPhase.GONE)
        finally:
            line.close()

    def _take_in(self, tracks: tuple[Track, ...], arrival_ns: int) -> None:
        names = tuple(track.name for track in tracks)
        wanted = self.newest.facts.terminal
        if wanted and wanted not in names:
            raise DeviceError(
                "The tracker tells of no terminal {wanted}.",
                "Choose another: {names}.",
                wanted=wanted,
                names=", ".join(names),
            )
        track = tracks[names.index(wanted) if wanted else 0]
        arrival = np.full(len(track.time_us), arrival_ns, dtype=np.int64)
        poses = Poses(
            arrival, track.time_us, track.t_room_terminal, track.q_room_terminal, track.quality
        )
        recorder = self._takes.recorder()
        if recorder is not None:
            recorder.put_poses(poses)
        self._poses.append(poses)
        self._note_frozen(poses)
        self.newest = replace(
            self.newest,
            phase=TrackerPhase.STREAMING,
            terminals=names,
            count=self.newest.count + len(poses),
            unseen=not bool(np.isfinite(poses.t_room_terminal[-1]).all()),
            frozen=self._same >= _FROZEN,
            problem=None,
        )

    def _note_frozen(self, poses: Poses) -> None:
        for k in range(len(poses)):
            before, now = self._before, poses[k : k + 1]
            alike = before is not None and all(
                np.array_equal(getattr(before, name), getattr(now, name))
                for name in ("t_room_terminal", "q_room_terminal")
            )
            self._same = self._same + 1 if alike else 0
            self._before = now
