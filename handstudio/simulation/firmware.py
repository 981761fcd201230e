"""The program inside a glove: commands in, frames out, on its own clock. No port, no waiting.

What it owes the wire is protocol/README.md; where that leaves a choice, it is said here.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from jaxtyping import Bool, Float, Int16, Int64

from handstudio.arrays import Array
from handstudio.protocol.codec import Sent, encode
from handstudio.protocol.commands import PERFORM, blink_asked, performance_asked, rate_asked
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

_SECOND_US = 1_000_000
RATES_HZ = tuple(rate for rate in range(50, 1001) if _SECOND_US % rate == 0)
"""Rates whose period is whole microseconds: those the clock keeps exactly."""

_HEALTH_EVERY_US = 1 * _SECOND_US
_TEMPERATURE_EVERY_US = 10 * _SECOND_US
_SUPPLY_MV = 5000
_CELSIUS = 31.0  # of every sensor before it was ever read: warmed by the hand it sits on
_LONGEST_TEXT = 255  # of a reply [bytes of UTF-8]


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Consecutive instants of all sensors, as the wire has them.

    Attributes:
        counts: Accelerometer, gyroscope, magnetometer; x y z each.
        fresh: The magnetometer reading is new.
        answering: The sensor gave a reading.
        celsius: How warm the sensors were at the last of these instants.
    """

    counts: Int16[Array, "n s 9"]
    fresh: Bool[Array, "n s"]
    answering: Bool[Array, "n s"]
    celsius: Float[Array, " s"]


Sensors: TypeAlias = Callable[[Int64[Array, " n"], int], Readings]
"""Reads the next instants [µs since START], which are one period apart, at a rate [Hz]."""

Performer: TypeAlias = Callable[[str], tuple[Result, str]]
"""Has the wearer do what the text says; how that went, and a word about it."""


class Firmware:
    """A device of the wire protocol: whole packets or nothing.

    Its clock starts at 0 and is told the time; what it receives happens at the instant it was
    last told. Every START begins the motion anew. Sequence, noise and totals run on.

    Args:
        description: Of the device, with the rate to begin with (one of `RATES_HZ`).
        sensors: What to read.
        tx_buffer: Size of the transmit buffer [bytes].
        performer: Whoever can be asked to perform; None: nobody, the command is unknown.
        wire: What becomes of a frame on its way: as it is, damaged, or nothing.
        read_ahead: Instants read in one go: 0.1 s of them unless told. One by one costs 50 times
            as much; what is asked of the wearer happens after those already read.

    Attributes:
        blinking: Sensor number (0: the device) and duration [ms] last asked for, if any.
    """

    def __init__(
        self,
        description: Description,
        sensors: Sensors,
        tx_buffer: int = 4096,
        *,
        performer: Performer | None = None,
        wire: Callable[[bytes], bytes] | None = None,
        read_ahead: int | None = None,
    ) -> None:
        self.blinking: tuple[int, int] | None = None
        self._description = description
        self._sensors = sensors
        self._tx_buffer = tx_buffer
        self._performer = performer
        self._wire, self._read_ahead = wire, read_ahead
        self._celsius = np.full(len(description.sensors), _CELSIUS)
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

    @property
    def streams_since_us(self) -> int | None:
        """When its stream was started [µs since it was switched on]; None: it is stopped."""
        return None if self._stream is None else self._stream.began_us

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
            rate_hz = self._description.rate_hz
            self._stream = _Stream(self._sensors, self._now_us, rate_hz, self._read_ahead)
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

    def _perform(self, request: Request) -> tuple[Result, str]:
        if self._performer is None:
            return self._refuse(request)
        asked = performance_asked(request)
        if asked is None:
            return Result.BAD_ARGUMENT, "not UTF-8"
        result, text = self._performer(asked)
        return result, text.encode()[:_LONGEST_TEXT].decode(errors="ignore")

    # --- what is due --------------------------------------------------------------------------

    def _say_due(self) -> None:
        sensors = len(self._description.sensors)
        if self._stream is not None and self._stream.due_us == self._now_us:
            self._say_instant(*self._stream.take())
        if self._health_due_us == self._now_us:
            self._health_due_us += _HEALTH_EVERY_US
            errors = (0,) * sensors
            self._put(Health(self._now_us, self._sent, self._dropped, _SUPPLY_MV, errors))
        if self._temperature_due_us == self._now_us:
            self._temperature_due_us += _TEMPERATURE_EVERY_US
            self._put(Temperature(self._now_us, self._celsius))

    def _say_instant(self, block: Readings, at: int) -> None:
        self._celsius = block.celsius
        packet = ImuPacket(
            epoch=self._description.epoch & 0xFF,
            status=Status.DROPPED if self._dropping else Status(0),
            sequence=self._sequence,
            clock_us=self._now_us,
            answering=block.answering[at],
            fresh=block.fresh[at],
            counts=block.counts[at],
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
            self._buffer += frame if self._wire is None else self._wire(frame)
        return fits


_ACTIONS: dict[int, Callable[[Firmware, Request], tuple[Result, str]]] = {
    Command.DESCRIBE: Firmware._describe,
    Command.START: Firmware._start,
    Command.STOP: Firmware._stop,
    Command.SET_RATE: Firmware._set_rate,
    Command.BLINK: Firmware._blink,
    PERFORM: Firmware._perform,
}


class _Stream:
    """The instants between START and STOP, a block ahead."""

    def __init__(self, sensors: Sensors, began_us: int, rate_hz: int, block: int | None) -> None:
        self._sensors, self._size = sensors, block
        self.began_us = began_us
        self._rate_hz = rate_hz
        self._ahead = self._block(began_us)

    @property
    def due_us(self) -> int:
        """When the next instant is [µs]."""
        return self._ahead[0][0]

    def change_rate(self, now_us: int, rate_hz: int) -> None:
        """Go on at another rate, one of its periods from now."""
        self._rate_hz = rate_hz
        self._ahead = self._block(now_us + self._period_us)

    def take(self) -> tuple[Readings, int]:
        """The block and where in it the instant is that is due; the next becomes due."""
        due_us, block, at = self._ahead[0]
        if len(self._ahead) == 1:
            self._ahead = self._block(due_us + self._period_us)
        else:
            self._ahead.popleft()
        return block, at

    @property
    def _period_us(self) -> int:
        return _SECOND_US // self._rate_hz

    def _block(self, first_us: int) -> deque[tuple[int, Readings, int]]:
        """The next instants: when each is due, and where its readings are."""
        size = self._size or max(1, self._rate_hz // 10)
        due_us = first_us + self._period_us * np.arange(size)
        block = self._sensors(due_us - self.began_us, self._rate_hz)
        return deque((due, block, at) for at, due in enumerate(due_us.tolist()))
