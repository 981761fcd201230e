"""An open line to a device: the small contract behind which all of them look alike."""

from __future__ import annotations

from typing import Protocol, runtime_checkable


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
