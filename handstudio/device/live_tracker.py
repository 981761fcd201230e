"""A tracker that is in use: the thread that reads it, and the one that follows the hand by it.

The second may take its time, to align or because the machine is busy: nobody waits for it.
"""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass

from handstudio.device.capture import Capture
from handstudio.device.following import Following, RootNow
from handstudio.device.orders import SetTracker, ShareMoves
from handstudio.device.tracker import TrackerNow, TrackerReader
from handstudio.errors import HandstudioError
from handstudio.recording.tracker_message import TrackerFacts

_STEP_S = 0.02
_PLACES = 4000  # kept for `drain`


@dataclass(frozen=True, slots=True, eq=False)
class LiveNow:
    """What is known of a tracker that is in use.

    Attributes:
        tracker: Of its line.
        root: Of the hand in its room.
        problem: What ended the following, which should not happen; recording goes on.
    """

    tracker: TrackerNow
    root: RootNow = RootNow()
    problem: HandstudioError | None = None


class LiveTracker:
    """Both threads, and the doors to them.

    Args:
        facts: Which tracker.
        capture: Whose hand and whose takes.

    Raises:
        DeviceError: that is no address of a tracker.
    """

    def __init__(self, facts: TrackerFacts, capture: Capture) -> None:
        self._capture, self._reader = capture, TrackerReader(facts, capture)
        self._following = Following(facts)
        self._root = RootNow()
        self._problem: HandstudioError | None = None
        self._places: deque[RootNow] = deque(maxlen=_PLACES)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="root", daemon=True)

    def start(self) -> None:
        """Begin: takes that begin from now on have the tracker's poses."""
        self._capture.send(SetTracker(self._reader.newest.facts))
        self._capture.send(ShareMoves(on=True))
        self._reader.start()
        self._thread.start()

    @property
    def newest(self) -> LiveNow:
        """What is known now."""
        return LiveNow(self._reader.newest, self._root, self._problem)

    def drain(self) -> list[RootNow]:
        """Every place since the last call, oldest first; for one reader."""
        return [self._places.popleft() for _ in range(len(self._places))]

    def end(self) -> None:
        """Let go; returns at once."""
        self._capture.send(SetTracker(None))
        self._capture.send(ShareMoves(on=False))
        self._ended.set()
        self._reader.end()

    def join(self) -> None:
        """Wait until both threads have ended."""
        self._reader.join()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(_STEP_S):
            before = self._root.time_us
            try:
                self._root = self._following.step(self._capture.drain_moves(), self._reader.drain())
            except Exception as error:  # a thread must not die unseen
                self._problem = HandstudioError(
                    "The hand cannot be followed in the tracker's room ({kind}: {reason}).",
                    "Choose the tracker again and report this; what is recorded is whole.",
                    kind=type(error).__name__,
                    reason=error,
                )
                raise
            if self._root.time_us != before:
                self._places.append(self._root)
