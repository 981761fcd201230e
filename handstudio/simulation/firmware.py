"""The program inside a glove: commands in, frames out, on its own clock. No port, no waiting.

What it owes the wire is protocol/README.md; where that leaves a choice, it is said here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Int64

from handstudio.arrays import Array
from handstudio.protocol.codec import Sent, encode
from handstudio.protocol.commands import blink_asked, rate_asked
from handstudio.protocol.decoder import CommandDecoder
from handstudio.protocol.framing import DELIMITER
from handstudio.protocol.packets import (
    Command,
    Description,
    Health,
    ImuPacket,
    Reply,
    Request,
    Result,
    Status,
    Temperature,
)
from handstudio.simulation.imperfections import Readings

_SECOND_US = 1_000_000
RATES_HZ = tuple(rate for rate in range(50, 1001) if _SECOND_US % rate == 0)
"""Rates whose period is whole microseconds: those the clock keeps exactly."""

_HEALTH_EVERY_US = 1 * _SECOND_US
_TEMPERATURE_EVERY_US = 10 * _SECOND_US
_SUPPLY_MV = 5000
_CELSIUS = 31.0  # of every sensor: warmed by the hand it sits on


Sensors: TypeAlias = Callable[[Int64[Array, " n"], int], Readings]
"""Reads the next instants [µs since START], which are one period apart, at a rate [Hz]."""


class Firmware:
    """A device of the wire protocol: whole packets or nothing.

    Its clock starts at 0 and is told the time; what it receives happens at the instant it was
    last told. Every START begins the motion anew. Sequence, noise and totals run on.

    Args:
        description: Of the device, with the rate to begin with (one of `RATES_HZ`).
        sensors: What to read.
        tx_buffer: Size of the transmit buffer [bytes].

    Attributes:
        blinking: Sensor number (0: the device) and duration [ms] last asked for, if any.
    """

    def __init__(self, description: Description, sensors: Sensors, tx_buffer: int = 4096) -> None:
        self.blinking: tuple[int, int] | None = None
        self._description = description
        self._sensors = sensors
        self._tx_buffer = tx_buffer
        self._now_us = self._temperature_due_us = 0
        self._health_due_us = _HEALTH_EVERY_US
        self._sequence = self._sent = self._dropped = 0
        self._dropping = False
        self.plugged_in()

    @property
    def outgoing(self) -> bytes:
        """What waits in the transmit buffer."""
        return bytes(self._buffer)

    @property
    def next_due_us(self) -> int:
        """When it will next have something to say by itself [µs]."""
        due_us = min(self._health_due_us, self._temperature_due_us)
        return due_us if self._stream is None else min(due_us, self._stream.due_us)

    def plugged_in(self) -> None:
        """A line begins anew: forget the old one, do not stream, say who is here."""
        self._stream: _Stream | None = None
        self._commands = CommandDecoder()
        self._buffer = bytearray(DELIMITER)
        self._held: deque[bytes] = deque()
        self._put_held(self._description)

    def taken(self, size: int) -> None:
        """The line took the first ``size`` bytes of what was outgoing."""
        del self._buffer[:size]
        self._release()

    def receive(self, data: bytes) -> None:
        """Obey the commands that these bytes complete; damaged ones are passed over."""
        for command in self._commands.feed(data):
            if isinstance(command, Request):
                self._obey(command)

    def advance(self, now_us: int) -> None:
        """Say everything that is due until then [µs since it was switched on]."""
        while (due_us := self.next_due_us) <= now_us:
            self._now_us = due_us
            self._say_due()
        self._now_us = max(self._now_us, now_us)

    # --- commands -----------------------------------------------------------------------------

    def _obey(self, request: Request) -> None:
        action = _ACTIONS.get(request.command, Firmware._refuse)
        result, text = action(self, request)
        self._put_held(Reply(request.command, request.tag, result, text))
        if result is Result.OK and request.command in (Command.DESCRIBE, Command.SET_RATE):
            self._put_held(self._description)

    def _refuse(self, _: Request) -> tuple[Result, str]:
        return Result.UNKNOWN_COMMAND, ""

    def _describe(self, _: Request) -> tuple[Result, str]:
        return Result.OK, ""

    def _start(self, _: Request) -> tuple[Result, str]:
        if self._stream is None:
            self._stream = _Stream(self._sensors, self._now_us, self._description.rate_hz)
        return Result.OK, ""

    def _stop(self, _: Request) -> tuple[Result, str]:
        self._stream = None
        return Result.OK, ""

    def _set_rate(self, request: Request) -> tuple[Result, str]:
        rate_hz = rate_asked(request)
        if rate_hz not in RATES_HZ:
            return Result.BAD_ARGUMENT, f"rates are {' '.join(map(str, RATES_HZ))}"
        self._description = replace(self._description, rate_hz=rate_hz)
        if self._stream is not None:
            self._stream.change_rate(self._now_us, rate_hz)
        return Result.OK, ""

    def _blink(self, request: Request) -> tuple[Result, str]:
        asked = blink_asked(request)
        if asked is None or asked[0] not in (0, *self._description.sensors):
            return Result.BAD_ARGUMENT, "no such sensor"
        self.blinking = asked
        return Result.OK, ""

    # --- what is due --------------------------------------------------------------------------

    def _say_due(self) -> None:
        sensors = len(self._description.sensors)
        if self._stream is not None and self._stream.due_us == self._now_us:
            self._say_instant(self._stream.take())
        if self._health_due_us == self._now_us:
            self._health_due_us += _HEALTH_EVERY_US
            errors = (0,) * sensors
            self._put(Health(self._now_us, self._sent, self._dropped, _SUPPLY_MV, errors))
        if self._temperature_due_us == self._now_us:
            self._temperature_due_us += _TEMPERATURE_EVERY_US
            self._put(Temperature(self._now_us, np.full(sensors, _CELSIUS)))

    def _say_instant(self, instant: Readings) -> None:
        packet = ImuPacket(
            epoch=self._description.epoch & 0xFF,
            status=Status.DROPPED if self._dropping else Status(0),
            sequence=self._sequence,
            clock_us=self._now_us,
            answering=np.ones(len(self._description.sensors), dtype=bool),
            fresh=instant.fresh[0],
            counts=instant.counts[0],
        )
        self._sequence += 1
        self._dropping = not self._put(packet)
        self._sent += not self._dropping
        self._dropped += self._dropping

    # --- the transmit buffer ------------------------------------------------------------------

    def _put(self, packet: Sent) -> bool:
        """Send now or never; whether it fitted. Nothing overtakes what is held back."""
        return not self._held and self._append(encode(packet))

    def _put_held(self, packet: Sent) -> None:
        self._held.append(encode(packet))
        self._release()

    def _release(self) -> None:
        while self._held and self._append(self._held[0]):
            self._held.popleft()

    def _append(self, frame: bytes) -> bool:
        fits = len(self._buffer) + len(frame) <= self._tx_buffer
        if fits:
            self._buffer += frame
        return fits


_ACTIONS: dict[int, Callable[[Firmware, Request], tuple[Result, str]]] = {
    Command.DESCRIBE: Firmware._describe,
    Command.START: Firmware._start,
    Command.STOP: Firmware._stop,
    Command.SET_RATE: Firmware._set_rate,
    Command.BLINK: Firmware._blink,
}


class _Stream:
    """The instants between START and STOP, a block ahead: one by one costs 50 times as much."""

    _BLOCK = 64

    def __init__(self, sensors: Sensors, began_us: int, rate_hz: int) -> None:
        self._sensors = sensors
        self._began_us = began_us
        self._read_ahead(began_us, rate_hz)

    @property
    def due_us(self) -> int:
        """When the next instant is [µs]."""
        return int(self._block_us[self._at])

    def change_rate(self, now_us: int, rate_hz: int) -> None:
        """Go on at another rate, one of its periods from now."""
        self._read_ahead(now_us + _SECOND_US // rate_hz, rate_hz)

    def take(self) -> Readings:
        """The readings that are due, one instant; the next become due."""
        here = slice(self._at, self._at + 1)
        instant = Readings(self._block.counts[here], self._block.fresh[here])
        self._at += 1
        if self._at == self._BLOCK:
            self._read_ahead(int(self._block_us[-1]) + self._period_us, self._rate_hz)
        return instant

    def _read_ahead(self, first_us: int, rate_hz: int) -> None:
        self._rate_hz, self._period_us = rate_hz, _SECOND_US // rate_hz
        self._block_us = first_us + self._period_us * np.arange(self._BLOCK)
        self._block = self._sensors(self._block_us - self._began_us, rate_hz)
        self._at = 0
