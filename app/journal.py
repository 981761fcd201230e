"""What the studio did, for the log: told from its states, without a word about subjects."""

from __future__ import annotations

import logging

from app.diagnostics import learn_names
from app.state import State
from handstudio.device.orders import Newest, Phase
from handstudio.device.recorder import Recorder
from handstudio.scrub import Scrubber

_log = logging.getLogger(__name__)

_WORSE = {Phase.LOST, Phase.FAILED}


class Journal:
    """Compares each state with the one before; for one thread."""

    def __init__(self, scrubber: Scrubber) -> None:
        self._scrubber = scrubber
        self._before: State | None = None

    def note(self, state: State) -> None:
        """Log what is new in this state."""
        before, self._before = self._before, state
        self._learn(state, before)
        was = Newest() if before is None else before.newest
        now = state.newest
        if now is not was:
            _note_phase(was, now)
            _note_device(was, now)
            _note_problem(was, now)
            _note_take(was.recorder, now.recorder)
        for message in state.messages:
            if message.alarm:
                _log.warning("told: %s", message.text)

    def _learn(self, state: State, before: State | None) -> None:
        """Names are private before anything that may hold them is logged."""
        settings = state.settings
        self._scrubber.now((settings.subject, settings.take_name, settings.visit))
        if before is None or state.shelf.takes is not before.shelf.takes:
            learn_names(self._scrubber, state.shelf.takes)
        recorder = state.newest.recorder
        if recorder is not None and (before is None or recorder is not before.newest.recorder):
            self._scrubber.names((recorder.header.subject, recorder.header.name))


def _note_phase(was: Newest, now: Newest) -> None:
    if now.phase is was.phase and now.address == was.address:
        return
    level = logging.WARNING if now.phase in _WORSE else logging.INFO
    scheme, _, place = now.address.partition(":")
    told = f"{scheme}:{place}" if scheme in ("serial", "tcp") else scheme
    _log.log(level, "device %s: %s, before: %s", told, now.phase.value, was.phase.value)
    if now.phase is Phase.LOST:
        form = "so far: %d packets, %d missing, %d damaged, %d restarts"
        health = now.health
        _log.info(form, health.packets, health.missing, health.damaged, health.restarts)


def _note_device(was: Newest, now: Newest) -> None:
    one = now.description
    if one is not None and one != was.description:
        form = "it is %s (%s), firmware %s, protocol %d, %d sensors at %d Hz"
        known = (one.name, one.serial_number, one.firmware, one.protocol, len(one.sensors))
        _log.info(form, *known, one.rate_hz)


def _note_problem(was: Newest, now: Newest) -> None:
    if now.problem is None or (was.problem is not None and str(was.problem) == str(now.problem)):
        return
    _log.warning("%s: %s", type(now.problem).__name__, now.problem.what)


def _note_take(was: Recorder | None, now: Recorder | None) -> None:
    """Of a take only how long and how large."""
    if now is was:
        return
    if was is not None:
        _log.info("a take ended: %.1f s, %d bytes", was.seconds, was.bytes)
        if was.failure is not None:
            _log.error("it could not be written: %s", was.failure.what)
    if now is not None:
        _log.info("a take begins")
