"""The tracker that is in use, as the settings have it: started, followed, and let go."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from urllib.parse import parse_qsl, urlencode

from app.state import State, Tracking
from handstudio.device import lsl
from handstudio.device.addresses import is_virtual
from handstudio.device.capture import Capture
from handstudio.device.following import RootNow, RootPhase
from handstudio.device.live_tracker import LiveTracker
from handstudio.device.tracker import LSL
from handstudio.errors import HandstudioError
from handstudio.recording.tracker_message import TrackerFacts

VIRTUAL = "virtual:"
"""Begin of the address of a tracker on the virtual glove; its segment follows."""


@dataclass(frozen=True, slots=True)
class StreamsFound:
    """What streams there are, or why nobody can know."""

    names: tuple[str, ...]
    problem: HandstudioError | None = None


@dataclass
class Tracker:
    """Owner of the tracker; one thread.

    Args:
        capture: Whose takes it goes into.
        hear: Is told which streams were found; called in a thread of its own.
    """

    capture: Capture
    hear: Callable[[StreamsFound], None]
    shown: Tracking = Tracking()
    _live: LiveTracker | None = None
    _facts: TrackerFacts | None = None
    _left: list[LiveTracker] = field(default_factory=list)

    def look(self) -> None:
        """Look for streams, beside everything else."""
        if self.shown.searching:
            return
        self.shown = replace(self.shown, searching=True)
        threading.Thread(target=self._look, name="find trackers", daemon=True).start()

    def found(self, told: StreamsFound) -> None:
        """Take in what was found."""
        self.shown = replace(self.shown, searching=False, streams=told.names)

    def follow(self, state: State) -> Tracking:
        """Use what the settings say; what is known now."""
        settings = state.settings
        wanted = facts_of(settings.tracker, settings.tracker_terminal, settings.tracker_sensor)
        if wanted != self._facts:
            self._use(wanted)
        now = None if self._live is None else self._live.newest
        anchor = self.shown.anchor
        root = RootNow() if now is None else now.root
        if root.phase is not RootPhase.FOLLOWING:
            anchor = None
        elif anchor is None and root.t_room_elbow is not None and root.q_room_world is not None:
            anchor = root.t_room_elbow, root.q_room_world
        self.shown = replace(self.shown, now=now, anchor=anchor)
        return self.shown

    def face_anew(self) -> None:
        """Let the picture begin where the hand is now."""
        self.shown = replace(self.shown, anchor=None)

    def end(self) -> None:
        """Let go of everything."""
        self._use(None)
        for live in self._left:
            live.join()

    def _use(self, facts: TrackerFacts | None) -> None:
        self._facts = facts
        if self._live is not None:
            self._live.end()
            self._left.append(self._live)
            self._live = None
        if facts is not None:
            self._live = LiveTracker(facts, self.capture)
            self._live.start()

    def _look(self) -> None:
        try:
            names = tuple(name for name in lsl.stream_names() if name != _own_stream())
            self.hear(StreamsFound(names))
        except HandstudioError as error:
            self.hear(StreamsFound((), error))


def facts_of(source: str, terminal: str, sensor: str) -> TrackerFacts | None:
    """What the settings say; None where no tracker is wanted."""
    if source.startswith(VIRTUAL):
        return TrackerFacts(LSL + _own_stream(), source.removeprefix(VIRTUAL), sensor)
    if not source.startswith(LSL) or source == LSL:
        return None
    return TrackerFacts(source, terminal, sensor)


def with_tracker(address: str, source: str) -> str:
    """The address of a glove that streams the virtual tracker, where it is virtual and that wanted.

    Raises:
        DeviceError: it is wanted, and there is nothing to stream with.
    """
    if not is_virtual(address) or not source.startswith(VIRTUAL):
        return address
    lsl.library()
    given = dict(parse_qsl(address.partition("?")[2]))
    given |= {"tracker": source.removeprefix(VIRTUAL), "tracker-name": _own_stream()}
    return f"virtual:?{urlencode(given)}"


def _own_stream() -> str:
    """Two studios on one machine are not to hear each other's."""
    return f"handstudio virtual tracker {os.getpid()}"
