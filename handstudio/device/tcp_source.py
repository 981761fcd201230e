"""A device on a socket."""

from __future__ import annotations

import contextlib
import select
import socket

from handstudio.device.source import SourceLost
from handstudio.errors import DeviceError


class TcpSource:
    """A device on a socket (a plain one: pyserial's own yields single bytes)."""

    def __init__(self, place: str) -> None:
        host, _, port = place.rpartition(":")
        try:
            self._socket = socket.create_connection((host, int(port)), timeout=2.0)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except (OSError, ValueError, OverflowError) as error:
            raise DeviceError(
                "tcp:{place} does not answer ({reason}).",
                "Check host and port, and that the device is switched on.",
                place=place,
                reason=error,
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
