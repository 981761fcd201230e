"""A serial port or pseudo-terminal."""

from __future__ import annotations

import contextlib
import select
import sys

import serial

from handstudio.device.source import SourceLost
from handstudio.errors import DeviceError

if sys.platform == "win32":
    _FAILURES: tuple[type[Exception], ...] = (serial.SerialException, OSError, ValueError)
else:
    import termios

    # a port that vanishes while it is opened fails in ways that pyserial passes on as they are
    _FAILURES = (serial.SerialException, OSError, ValueError, termios.error)


_FULL = 3000
"""The system hands over 4095 bytes at a time: with so many there are more behind them."""

_AT_ONCE = 32768
"""Whoever is behind reads up to so many bytes together: long runs cost less to fuse."""


class SerialSource:
    """A serial port or pseudo-terminal, for us alone."""

    def __init__(self, port: str) -> None:
        try:
            self._port = serial.Serial(
                port, baudrate=1_000_000, timeout=0, write_timeout=1.0, exclusive=_exclusive()
            )
        except _FAILURES as error:
            raise _cannot_open(port, error) from error

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


def _cannot_open(port: str, error: Exception) -> DeviceError:
    text = str(error)
    if "ermission" in text or "Access is denied" in text:
        return DeviceError(
            "{port}: you may not open this port.",
            "Linux: add yourself to the port's group, sudo usermod -aG dialout $USER, and log in "
            "again. Windows: close the program that has the port open.",
            port=port,
        )
    if "busy" in text or "lock" in text or "temporarily unavailable" in text:
        return DeviceError(
            "{port}: another program has this port open.",
            "Close that program, then connect.",
            port=port,
        )
    if "No such file" in text or "No such device" in text or "FileNotFound" in text:
        return DeviceError(
            "{port}: there is no such port.", "Plug the device in, or look for it.", port=port
        )
    return DeviceError(
        "{port}: cannot be opened ({reason}).",
        "Unplug the device and plug it in.",
        port=port,
        reason=text,
    )
