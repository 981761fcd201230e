"""Commands with arguments: made by a host, read by a device."""

from __future__ import annotations

import struct

from handstudio.protocol.packets import Command, Request

PERFORM = 0xC0
"""A virtual glove's own command: do this (README.md)."""

LONGEST_PERFORMANCE = 255
"""[bytes of UTF-8]"""

_RATE = struct.Struct("<H")
_BLINK = struct.Struct("<BH")


def set_rate(tag: int, rate_hz: int) -> Request:
    """Ask for another rate of IMU packets."""
    return Request(Command.SET_RATE, tag, _packed(_RATE, rate_hz))


def blink(tag: int, sensor: int, duration_ms: int) -> Request:
    """Ask that the light of a sensor (by number) blinks; 0 ms ends it."""
    return Request(Command.BLINK, tag, _packed(_BLINK, sensor, duration_ms))


def perform(tag: int, motions: str) -> Request:
    """Ask a virtual glove that its wearer does this, from now on.

    Raises:
        ValueError: the description is longer than a command can be.
    """
    argument = motions.encode()
    if len(argument) > LONGEST_PERFORMANCE:
        raise ValueError(f"{len(argument)} bytes, at most {LONGEST_PERFORMANCE}")
    return Request(PERFORM, tag, argument)


def performance_asked(request: Request) -> str | None:
    """The motions of a PERFORM; None when the argument is no text."""
    try:
        return request.argument.decode()
    except UnicodeDecodeError:
        return None


def rate_asked(request: Request) -> int | None:
    """The rate [Hz] of a SET_RATE; None when the argument is none (reply BAD_ARGUMENT)."""
    fields = _unpacked(_RATE, request)
    return None if fields is None else fields[0]


def blink_asked(request: Request) -> tuple[int, int] | None:
    """Sensor number and duration [ms] of a BLINK; None when the argument is none."""
    fields = _unpacked(_BLINK, request)
    return None if fields is None else (fields[0], fields[1])


def _packed(layout: struct.Struct, *values: int) -> bytes:
    try:
        return layout.pack(*values)
    except struct.error as error:
        raise ValueError(f"{values} do not fit the wire: {error}") from error


def _unpacked(layout: struct.Struct, request: Request) -> tuple[int, ...] | None:
    return layout.unpack(request.argument) if len(request.argument) == layout.size else None
