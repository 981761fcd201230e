"""A device on a socket."""

from __future__ import annotations

import contextlib
import select
import socket

from handstudio.device.source import SourceLost
from handstudio.errors import DeviceError

CONNECT_S = 2.0
"""How long a device may take to answer the call."""


class TcpSource:
    """A device on a socket (a plain one: pyserial's own yields single bytes).

    Args:
        place: ``HOST:PORT``; an IPv6 address stands in brackets.

    Raises:
        DeviceError: it does not answer; says why, and what to do.
    """

    def __init__(self, place: str) -> None:
        host, number = _host_and_port(place)
        try:
            self._socket = socket.create_connection((host, number), timeout=CONNECT_S)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except (OSError, ValueError) as error:
            raise _no_answer(place, host, number, error) from error

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


def _host_and_port(place: str) -> tuple[str, int]:
    host, _, port = place.rpartition(":")
    if host and port.isascii() and port.isdigit() and 0 < int(port[:9]) <= 65535:
        return host.removeprefix("[").removesuffix("]"), int(port)
    raise DeviceError(
        "tcp:{place} is not a host and a port.",
        "Write them as in tcp:192.168.1.20:5555 or tcp:glove.local:5555.",
        place=place,
    )


def _no_answer(place: str, host: str, number: int, error: Exception) -> DeviceError:
    if isinstance(error, socket.gaierror | UnicodeError):
        return DeviceError(
            "tcp:{place} does not answer: no machine called {host} is known.",
            "Check the spelling, or write its address in numbers; check the network of this "
            "computer.",
            place=place,
            host=host,
        )
    if isinstance(error, ConnectionRefusedError):
        return DeviceError(
            "tcp:{place} does not answer: {host} is there, but the connection was refused: nothing "
            "listens at port {port}.",
            "Check the port, and that the device is switched on and not in use by another program.",
            place=place,
            host=host,
            port=number,
        )
    if isinstance(error, TimeoutError):
        return DeviceError(
            "tcp:{place} does not answer within {seconds:g} s.",
            "Check host and port, that the device is switched on and in the same network, and that "
            "no firewall is between.",
            place=place,
            seconds=CONNECT_S,
        )
    return DeviceError(
        "tcp:{place} does not answer ({reason}).",
        "Check host and port, and that the device is switched on.",
        place=place,
        reason=getattr(error, "strerror", None) or error,
    )
