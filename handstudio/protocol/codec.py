"""Packets to frames and payloads to packets, version 1, byte by byte as README.md says.

Counters are *wrapped* here: a parsed packet carries the u32 that was on the wire. Whatever is
accepted is canonical: encoding it again gives the same payload.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from enum import IntEnum
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Bool

from handstudio.arrays import Array
from handstudio.protocol.framing import frame
from handstudio.protocol.packets import (
    Description,
    ForeignVersion,
    Health,
    ImuPacket,
    Reason,
    Reply,
    Request,
    Side,
    Status,
    Temperature,
)

VERSION = 1
MAX_SENSORS = 32
MAX_ARGUMENT = 255
"""Longest argument of a command [bytes]."""

Sent: TypeAlias = Description | ImuPacket | Temperature | Health | Reply
Parsed: TypeAlias = Sent | ForeignVersion


class Kind(IntEnum):
    """First byte of a device's payload."""

    DESCRIPTION = 0x01
    IMU = 0x02
    TEMPERATURE = 0x03
    HEALTH = 0x04
    REPLY = 0x05


FIRST_COMMAND = 0x80
"""First bytes from here on are commands of the host."""

_SIDES: tuple[Side, ...] = ("unknown", "left", "right")
_UNKNOWN_CELSIUS = -0x8000
_WRAP = 0xFFFFFFFF

_DESCRIPTION = struct.Struct("<BBIBB")
_RATES = struct.Struct("<HHHfff")
_IMU = struct.Struct("<BBHIIB")
_TEMPERATURE = struct.Struct("<BIB")
_HEALTH = struct.Struct("<BIIIHB")
_REPLY = struct.Struct("<BBBB")
_REQUEST = struct.Struct("<BB")


def encode(packet: Sent | Request) -> bytes:
    """Wire bytes of a packet: one whole frame. Sequence and clock wrap to 32 bits.

    Raises:
        ValueError: a value does not fit its field; nothing is cut off or rounded into place.
    """
    try:
        return frame(_payload(packet))
    except (struct.error, OverflowError) as error:
        raise ValueError(f"{type(packet).__name__} does not fit the wire: {error}") from error


def parse(payload: bytes) -> Parsed | Reason:
    """The packet of a device's payload, or why it is none. Never raises."""
    reader = _READERS.get(payload[0]) if payload else None
    if reader is None:
        return Reason.UNKNOWN_TYPE if payload else Reason.LENGTH
    try:
        return reader(payload)
    except struct.error:
        return Reason.LENGTH
    except _RefusedError as refused:
        return refused.reason


def parse_request(payload: bytes) -> Request | Reason:
    """The command of a host's payload, or why it is none. The argument is not looked at."""
    if payload and payload[0] < FIRST_COMMAND:
        return Reason.UNKNOWN_TYPE
    if not _REQUEST.size <= len(payload) <= _REQUEST.size + MAX_ARGUMENT:
        return Reason.LENGTH
    return Request(payload[0], payload[1], payload[_REQUEST.size :])


class _RefusedError(Exception):
    """A payload that is no packet; never leaves this file."""

    def __init__(self, reason: Reason) -> None:
        self.reason = reason


# --- packet to payload ------------------------------------------------------------------------


def _payload(packet: Sent | Request) -> bytes:
    match packet:
        case ImuPacket():
            return _imu(packet)
        case Description():
            return _description(packet)
        case Temperature():
            return _temperature(packet)
        case Health():
            return _health(packet)
        case Reply(command, tag, result, text):
            return _REPLY.pack(Kind.REPLY, command, tag, result) + _text(text)
        case Request(command, tag, argument):
            _check(command >= FIRST_COMMAND, f"command 0x{command:02X} is not from 0x80 on")
            _check(len(argument) <= MAX_ARGUMENT, f"an argument of {len(argument)} bytes, max 255")
            return _REQUEST.pack(command, tag) + argument


def _imu(packet: ImuPacket) -> bytes:
    n = _count(packet.answering)
    shapes = packet.answering.shape, packet.fresh.shape, packet.counts.shape
    _check(shapes == ((n,), (n,), (n, 9)), f"an instant of shapes {shapes}")
    _check(packet.counts.dtype == np.int16, f"counts of type {packet.counts.dtype}, not int16")
    sequence, clock_us = packet.sequence & _WRAP, packet.clock_us & _WRAP
    head = _IMU.pack(Kind.IMU, packet.epoch, packet.status, sequence, clock_us, n)
    counts = packet.counts.astype("<i2", copy=False).tobytes()
    return b"".join((head, _bitmap(packet.answering), _bitmap(packet.fresh), counts))


def _description(packet: Description) -> bytes:
    _check(packet.protocol == VERSION, f"protocol {packet.protocol}, this is {VERSION}")
    fault = _implausible(packet)
    _check(fault is None, fault or "")
    side, n = _SIDES.index(packet.side), _count(packet.sensors)
    head = _DESCRIPTION.pack(Kind.DESCRIPTION, VERSION, packet.epoch, side, n)
    rates = _RATES.pack(
        packet.rate_hz,
        packet.max_rate_hz,
        packet.magnetometer_rate_hz,
        packet.accelerometer_range_g,
        packet.gyroscope_range_dps,
        packet.magnetometer_range_ut,
    )
    texts = map(_text, (packet.name, packet.serial_number, packet.firmware))
    return b"".join((head, bytes(packet.sensors), rates, *texts))


def _temperature(packet: Temperature) -> bytes:
    n, centi = _count(packet.celsius), np.round(packet.celsius * 100)
    _check(not bool((np.abs(centi) > 0x7FFF).any()), "a temperature beyond ±327.67 °C")
    counts = np.where(np.isnan(centi), _UNKNOWN_CELSIUS, centi).astype("<i2")
    return _TEMPERATURE.pack(Kind.TEMPERATURE, packet.clock_us & _WRAP, n) + counts.tobytes()


def _health(packet: Health) -> bytes:
    n, clock_us = _count(packet.sensor_errors), packet.clock_us & _WRAP
    head = _HEALTH.pack(
        Kind.HEALTH, clock_us, packet.sent & _WRAP, packet.dropped & _WRAP, packet.supply_mv, n
    )
    return head + struct.pack(f"<{n}H", *packet.sensor_errors)


def _text(text: str) -> bytes:
    data = text.encode()
    _check(len(data) <= 255, f"a text of {len(data)} bytes, max 255")
    return bytes((len(data),)) + data


def _count(values: Any) -> int:
    n = len(values)
    _check(1 <= n <= MAX_SENSORS, f"{n} sensors, not 1 to {MAX_SENSORS}")
    return n


def _bitmap(bits: Bool[Array, " s"]) -> bytes:
    return np.packbits(bits, bitorder="little").tobytes()


def _check(right: bool, fault: str) -> None:
    if not right:
        raise ValueError(fault)


# --- payload to packet ------------------------------------------------------------------------


def _read_imu(payload: bytes) -> ImuPacket:
    _, epoch, status, sequence, clock_us, n = _IMU.unpack_from(payload)
    wide = (n + 7) // 8
    counts_at = _IMU.size + 2 * wide
    _expect(n, len(payload) == counts_at + 18 * n)
    if n % 8 and (payload[_IMU.size + wide - 1] | payload[counts_at - 1]) >> n % 8:
        raise _RefusedError(Reason.CONTENT)
    packed = np.frombuffer(payload, np.uint8, 2 * wide, _IMU.size).reshape(2, wide)
    bits = np.unpackbits(packed, axis=1, bitorder="little").view(np.bool_)
    counts = np.frombuffer(payload, "<i2", 9 * n, counts_at).reshape(n, 9)
    return ImuPacket(epoch, Status(status), sequence, clock_us, bits[0, :n], bits[1, :n], counts)


def _read_description(payload: bytes) -> Description | ForeignVersion:
    if len(payload) >= 2 and payload[1] != VERSION:
        return ForeignVersion(payload[1])
    _, protocol, epoch, side, n = _DESCRIPTION.unpack_from(payload)
    rates_at = _DESCRIPTION.size + n
    _expect(n, len(payload) > rates_at)
    rates = _RATES.unpack_from(payload, rates_at)
    name, serial_number, firmware = _read_texts(payload, rates_at + _RATES.size, 3)
    if side >= len(_SIDES):
        raise _RefusedError(Reason.CONTENT)
    sensors = tuple(payload[_DESCRIPTION.size : rates_at])
    packet = Description(
        protocol, epoch, name, serial_number, firmware, _SIDES[side], sensors, *rates
    )
    if _implausible(packet) is not None:
        raise _RefusedError(Reason.CONTENT)
    return packet


def _read_temperature(payload: bytes) -> Temperature:
    _, clock_us, n = _TEMPERATURE.unpack_from(payload)
    _expect(n, len(payload) == _TEMPERATURE.size + 2 * n)
    counts = np.frombuffer(payload, "<i2", n, _TEMPERATURE.size)
    return Temperature(clock_us, np.where(counts == _UNKNOWN_CELSIUS, np.nan, counts / 100))


def _read_health(payload: bytes) -> Health:
    _, clock_us, sent, dropped, supply_mv, n = _HEALTH.unpack_from(payload)
    _expect(n, len(payload) == _HEALTH.size + 2 * n)
    errors = struct.unpack_from(f"<{n}H", payload, _HEALTH.size)
    return Health(clock_us, sent, dropped, supply_mv, errors)


def _read_reply(payload: bytes) -> Reply:
    _, command, tag, result = _REPLY.unpack_from(payload)
    (text,) = _read_texts(payload, _REPLY.size, 1)
    return Reply(command, tag, result, text)


def _read_texts(payload: bytes, at: int, number: int) -> list[str]:
    """The length-prefixed texts that must fill the rest of a payload."""
    ends = [at]
    for _ in range(number):
        if ends[-1] >= len(payload):
            raise _RefusedError(Reason.LENGTH)
        ends.append(ends[-1] + 1 + payload[ends[-1]])
    if ends[-1] != len(payload):
        raise _RefusedError(Reason.LENGTH)
    try:
        return [payload[start + 1 : end].decode() for start, end in pairwise(ends)]
    except UnicodeDecodeError:
        raise _RefusedError(Reason.CONTENT) from None


def _expect(sensors: int, whole: bool) -> None:
    if not 1 <= sensors <= MAX_SENSORS:
        raise _RefusedError(Reason.CONTENT)
    if not whole:
        raise _RefusedError(Reason.LENGTH)


def _implausible(packet: Description) -> str | None:
    """Why a description cannot be true, or None. Rate 0 or range 0: it has no magnetometer."""
    ranges = packet.accelerometer_range_g, packet.gyroscope_range_dps
    if 0 in packet.sensors or len(set(packet.sensors)) < len(packet.sensors):
        return f"sensor numbers {packet.sensors}: 0 or the same twice"
    if not 1 <= packet.rate_hz <= packet.max_rate_hz:
        return f"a rate of {packet.rate_hz} Hz, not 1 to {packet.max_rate_hz}"
    if not all(math.isfinite(value) and value > 0 for value in ranges):
        return f"ranges {ranges}: not positive"
    if not math.isfinite(packet.magnetometer_range_ut) or packet.magnetometer_range_ut < 0:
        return f"a magnetometer range of {packet.magnetometer_range_ut} µT"
    return None


_READERS: dict[int, Callable[[bytes], Parsed]] = {
    Kind.DESCRIPTION: _read_description,
    Kind.IMU: _read_imu,
    Kind.TEMPERATURE: _read_temperature,
    Kind.HEALTH: _read_health,
    Kind.REPLY: _read_reply,
}
