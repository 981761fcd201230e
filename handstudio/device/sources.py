"""Where bytes come from, behind one small contract, and the addresses that name them.

========================  =========================================================
``serial:/dev/ttyACM0``   a serial port (``serial:COM5`` on Windows)
``tcp:host:port``         a device on a socket
``virtual:``              a virtual glove of one's own, started and ended with us
``replay:FILE.mcap``      the bytes of a take, at their own pace (tests and demos)
========================  =========================================================
"""

from __future__ import annotations

import contextlib
import select
import socket
from pathlib import Path
from typing import Protocol, runtime_checkable
from urllib.parse import parse_qsl, urlsplit

import serial

from handstudio.errors import DeviceError


class SourceLost(Exception):  # noqa: N818 - an event of daily life, not a mistake
    """The other end went away: cable out, process gone, file at its end."""


@runtime_checkable
class ByteSource(Protocol):
    """An open line to a device."""

    def read(self, timeout_s: float) -> bytes:
        """Bytes that are there, waiting up to a time for the first.

        Raises:
            SourceLost: the other end went away.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            SourceLost: the other end went away.
        """
        ...

    def close(self) -> None:
        """Let go; never raises."""
        ...


def open_source(address: str) -> ByteSource:
    """Open an address.

    Raises:
        DeviceError: it is no address, or cannot be opened; says what to do.
    """
    scheme, _, rest = address.partition(":")
    match scheme:
        case "serial":
            return SerialSource(rest)
        case "tcp":
            return TcpSource(rest)
        case "virtual":
            from handstudio.device.virtual_source import VirtualSource  # noqa: PLC0415 - heavy

            return VirtualSource(dict(parse_qsl(urlsplit(address).query)))
        case "replay":
            from handstudio.device.replay_source import ReplaySource  # noqa: PLC0415 - heavy

            return ReplaySource(Path(rest))
        case _:
            raise DeviceError(
                f"{address!r} is not the address of a device.",
                "Write serial:PORT, tcp:HOST:PORT, virtual: or replay:FILE.",
            )


class SerialSource:
    """A serial port or pseudo-terminal, for us alone."""

    def __init__(self, port: str) -> None:
        try:
            self._port = serial.Serial(
                port, baudrate=1_000_000, timeout=0, write_timeout=1.0, exclusive=_exclusive()
            )
        except (serial.SerialException, OSError, ValueError) as error:
            raise _cannot_open(port, error) from error

    def read(self, timeout_s: float) -> bytes:
        """Bytes that are there, waiting up to a time for the first."""
        try:
            self._wait(timeout_s)
            waiting = self._port.in_waiting
            return bytes(self._port.read(max(1, waiting)))
        except (serial.SerialException, OSError, TypeError) as error:
            raise SourceLost(str(error)) from error

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._port.write(data)
        except (serial.SerialException, OSError) as error:
            raise SourceLost(str(error)) from error

    def close(self) -> None:
        """Let go."""
        with contextlib.suppress(serial.SerialException, OSError):
            self._port.close()

    def _wait(self, timeout_s: float) -> None:
        if hasattr(self._port, "fileno"):
            select.select([self._port.fileno()], [], [], timeout_s)
        else:  # Windows: pyserial waits by itself
            self._port.timeout = timeout_s


class TcpSource:
    """A device on a socket (a plain one: pyserial's own yields single bytes)."""

    def __init__(self, place: str) -> None:
        host, _, port = place.rpartition(":")
        try:
            self._socket = socket.create_connection((host, int(port)), timeout=2.0)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except (OSError, ValueError, OverflowError) as error:
            raise DeviceError(
                f"tcp:{place} does not answer ({error}).",
                "Check host and port, and that the device is switched on.",
            ) from error

    def read(self, timeout_s: float) -> bytes:
        """Bytes that are there, waiting up to a time for the first."""
        try:
            ready, _, _ = select.select([self._socket], [], [], timeout_s)
            if not ready:
                return b""
            chunk = self._socket.recv(65536)
        except (OSError, ValueError) as error:
            raise SourceLost(str(error)) from error
        if not chunk:
            raise SourceLost("the connection was closed")
        return chunk

    def write(self, data: bytes) -> None:
        """Send bytes."""
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise SourceLost(str(error)) from error

    def close(self) -> None:
        """Let go."""
        with contextlib.suppress(OSError):
            self._socket.close()


def _exclusive() -> bool | None:
    return True if hasattr(select, "poll") else None  # Windows ports are exclusive anyway


def _cannot_open(port: str, error: Exception) -> DeviceError:
    text = str(error)
    if "ermission" in text or "Access is denied" in text:
        return DeviceError(
            f"{port}: you may not open this port.",
            "Linux: add yourself to the port's group, sudo usermod -aG dialout $USER, and log in "
            "again. Windows: close the program that has the port open.",
        )
    if "busy" in text or "lock" in text or "temporarily unavailable" in text:
        return DeviceError(
            f"{port}: another program has this port open.", "Close that program, then connect."
        )
    if "No such file" in text or "could not open port" in text or "FileNotFound" in text:
        return DeviceError(f"{port}: there is no such port.", "Plug the device in, or look for it.")
    return DeviceError(f"{port}: cannot be opened ({text}).", "Unplug the device and plug it in.")
