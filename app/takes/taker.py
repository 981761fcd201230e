"""Takes as they are made: counted in, watched while they grow, marked, and ended."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from app.shown import taking
from app.shown.taking import BYTES, Countdown, Disk, Ending, Watch
from app.sounds import Sound
from app.state import State
from handstudio.device.capture import Capture
from handstudio.device.orders import Newest, Phase, StartTake, StopTake
from handstudio.errors import HandstudioError, TakeError
from handstudio.recording import library
from handstudio.recording.notes import load_notes, save_notes, with_mark
from handstudio.settings import Settings

_DISK_EVERY_S = 2.0


@dataclass
class Taker:
    """Owner of the take that is on, or about to be."""

    capture: Capture
    sessions: Path
    countdown: Countdown | None = None
    disk: Disk | None = None
    marks: int = 0
    _watch: Watch = Watch()
    _disk_due_s: float = 0.0
    _warned: bool = False

    def begin(self, settings: Settings) -> None:
        """Count down to a take.

        Raises:
            TakeError: the disk has no room for one.
        """
        if self.disk is not None and self.disk.full:
            raise _full(self.sessions, self.disk)
        self.countdown = Countdown(settings.countdown_s)

    def begin_at_once(self, settings: Settings, name: str) -> None:
        """Begin a take of this name without a count.

        Raises:
            TakeError: the disk has no room for one, or it cannot be called so.
        """
        if self.disk is not None and self.disk.full:
            raise _full(self.sessions, self.disk)
        self.countdown = None
        self._start(settings, name)

    def cancel(self) -> None:
        """No take after all."""
        self.countdown = None

    def stop(self) -> None:
        """End the take that is on."""
        self.capture.send(StopTake())

    def tick(self, elapsed_s: float, state: State, settings: Settings) -> list[Sound]:
        """So much later; what is to be heard.

        Raises:
            HandstudioError: a take was not begun, or was ended, and why.
        """
        self._look_at_disk(elapsed_s, state)
        sounds = self._count(elapsed_s, state, settings)
        recording = state.newest.recorder is not None
        if not recording:
            self._watch = Watch()
            return sounds
        lost = state.newest.phase is Phase.LOST
        self._watch = taking.watched(self._watch, elapsed_s, pages=state.pages, lost=lost)
        ending = taking.ending_of(self._watch, self.disk)
        if ending is not None:
            self.stop()
            self._watch = Watch()
            raise _ended(ending, self.sessions, self.disk)
        self._warn()
        return sounds

    def mark(self, text: str) -> bool:
        """Put a mark into the take that is on; whether there was an instant to mark.

        Raises:
            TakeError: the notes cannot be written.
        """
        recorder, motion = self.capture.newest.recorder, self.capture.newest.motion
        if recorder is None or motion is None or recorder.first_us is None:
            return False
        at_s = (int(motion.time_us[-1]) - recorder.first_us) * 1e-6
        notes = with_mark(load_notes(recorder.path), max(0.0, at_s), text)
        save_notes(recorder.path, notes)
        self.marks = len(notes.marks)
        return True

    def _count(self, elapsed_s: float, state: State, settings: Settings) -> list[Sound]:
        before = self.countdown
        if before is None:
            return []
        if not state.can_record:
            self.countdown = None
            raise HandstudioError(
                "The device went away before the take began.", "Connect it, then record again."
            )
        now = taking.counted(before, elapsed_s)
        if not now.over:
            self.countdown = now
            begun = before.left_s == settings.countdown_s
            return [Sound.TICK] if begun or now.shown != before.shown else []
        if not state.newest.ready:  # it begins as soon as the device sends again
            return []
        self.countdown = None
        self._start(settings, settings.take_name)
        return [Sound.START]

    def _start(self, settings: Settings, name: str) -> None:
        now = datetime.now().astimezone()
        path = library.new_take_path(self.sessions, settings.subject, name, now, settings.visit)
        self.marks, self._warned = 0, False
        self.capture.send(StartTake(path, settings.subject))

    def _look_at_disk(self, elapsed_s: float, state: State) -> None:
        self._disk_due_s -= elapsed_s
        if self._disk_due_s > 0.0:
            return
        self._disk_due_s = _DISK_EVERY_S
        place = self.sessions
        while not place.exists() and place != place.parent:
            place = place.parent
        try:
            free = shutil.disk_usage(place).free
        except OSError:  # a share that is away just now: writing to it will tell
            self.disk = None
            return
        self.disk = Disk(free, _bytes_per_s(state.newest))

    def _warn(self) -> None:
        """Once a take, when the disk is getting full."""
        if self.disk is not None and self.disk.low and not self._warned:
            self._warned = True
            raise TakeError(
                "The disk of {folder} is getting full: {megabytes:.0f} MB left, about "
                "{minutes:.0f} min of recording.",
                "Free some space; the take is ended in good time and kept.",
                folder=self.sessions,
                megabytes=self.disk.free_bytes / 1e6,
                minutes=self.disk.seconds_left / 60.0,
            )


def _bytes_per_s(newest: Newest) -> float:
    setup = newest.setup
    if setup is None:
        return BYTES * 20 * 100.0
    return BYTES * len(setup.layout.sensors) * setup.rate_hz


def _ended(ending: Ending, sessions: Path, disk: Disk | None) -> HandstudioError:
    match ending:
        case Ending.ALONE:
            return HandstudioError(
                "The take was ended: no page had been open for {seconds:.0f} s.",
                "It is kept; find it under Review.",
                seconds=taking.ALONE_LIMIT_S,
            )
        case Ending.LOST:
            return HandstudioError(
                "The take was ended: the device had been away for {minutes:.0f} min.",
                "It is kept; find it under Review.",
                minutes=taking.LOST_LIMIT_S / 60.0,
            )
        case Ending.FULL:
            return _full(sessions, disk)


def _full(sessions: Path, disk: Disk | None) -> HandstudioError:
    return TakeError(
        "The disk of {folder} is full: {megabytes:.0f} MB left.",
        "What was recorded is kept. Free some space, or start the studio with --sessions on "
        "another disk.",
        folder=sessions,
        megabytes=disk.free_bytes / 1e6 if disk is not None else 0.0,
    )
