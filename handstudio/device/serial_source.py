"""A serial port or pseudo-terminal."""

from __future__ import annotations

import contextlib
import select
import sys

import serial

from handstudio.device.port_trouble import cannot_open
from handstudio.device.source import SourceLost
from handstudio.errors import DeviceError

if sys.platform == "win32":
    _FAILURES: tuple[type[Exception], ...] = (serial.SerialException, OSError, ValueError)
else:
    import termios

    # a port that vanishes while it is opened fails in ways that pyserial passes on as they are
    _FAILURES = (serial.SerialException, OSError, ValueError, termios.error)


BAUD = 1_000_000
"""Bits a second unless the address says otherwise; USB devices take no notice of it."""

_FULL = 3000
"""The system hands over 4095 bytes at a time: with so many there are more behind them."""

_AT_ONCE = 32768
"""Whoever is behind reads up to so many bytes together: long runs cost less to fuse."""

_BAUD_RANGE = range(300, 12_000_001)
_BAUD_OPTION = "?baud="


class SerialSource:
    """A serial port or pseudo-terminal, for us alone.

    Args:
        place: The port, ``/dev/ttyUSB0`` or ``COM5``; ``?baud=115200`` behind it sets the speed of
            an adapter.

    Raises:
        DeviceError: it cannot be opened; says why, and what to do.
    """

    def __init__(self, place: str) -> None:
        port, _, speed = place.partition(_BAUD_OPTION)
        baud = _baud(place, speed) if _BAUD_OPTION in place else BAUD
        try:
            self._port = serial.Serial(
                port, baudrate=baud, timeout=0, write_timeout=1.0, exclusive=_exclusive()
            )
        except _FAILURES as error:
            raise cannot_open(port, error) from error

    def read(self, timeout_s: float) -> bytes:
        """Bytes that are there, waiting up to a time for the first."""
        try:
            self._wait(timeout_s)
            data = piece = self._read()
        except (*_FAILURES, TypeError) as error:
            raise SourceLost(str(error)) from error
        with contextlib.suppress(*_FAILURES, TypeError):  # the next read tells
            while len(piece) >= _FULL and len(data) < _AT_ONCE and self._port.in_waiting:
                piece = self._read()
                data += piece
        return data

    def _read(self) -> bytes:
        return bytes(self._port.read(max(1, self._port.in_waiting)))

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._port.write(data)
        except _FAILURES as error:
            raise SourceLost(str(error)) from error

    def close(self) -> None:
        """Let go."""
        with contextlib.suppress(*_FAILURES):
            self._port.close()

    def _wait(self, timeout_s: float) -> None:
        if hasattr(self._port, "fileno"):
            select.select([self._port.fileno()], [], [], timeout_s)
        else:  # Windows: pyserial waits by itself
            self._port.timeout = timeout_s


def _exclusive() -> bool | None:
    return True if hasattr(select, "poll") else None  # Windows ports are exclusive anyway


def _baud(place: str, speed: str) -> int:
    if speed.isascii() and speed.isdigit() and int(speed[:9]) in _BAUD_RANGE:
        return int(speed[:9])
    raise DeviceError(
        "serial:{place}: {speed!r} is not the speed of a line.",
        "Write the bits a second the device is set to, from {least} to {most}: ?baud=115200.",
        place=place,
        speed=speed,
        least=_BAUD_RANGE[0],
        most=_BAUD_RANGE[-1],
    )
