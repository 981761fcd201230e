"""What a device and its host say to each other, checked and unwrapped.

A packet is a value. Damage is a packet too (`Corruption`), and so are packets that never came
(`Missing`) and a device that began anew (`Restart`): nothing about a stream is reported by
raising.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum, IntFlag
from typing import Literal, TypeAlias

import numpy as np
from jaxtyping import Bool, Float, Int16

from handstudio.arrays import Array

Side: TypeAlias = Literal["left", "right", "unknown"]

TIP_SENSOR = 21
"""Number of the extra sensor that sits on a fingertip during calibration only."""


def sensor_name(number: int) -> str:
    """Name of a sensor number as files and pages write it: ``SN1`` to ``SN20``, ``Tip``."""
    return "Tip" if number == TIP_SENSOR else f"SN{number}"


class Status(IntFlag):
    """Status bits of an IMU packet."""

    DROPPED = 1  # packets were dropped since the last one that was sent
    LOW_SUPPLY = 2
    BUTTON = 4  # the button on the device is held: a mark by the person who wears it


@dataclass(frozen=True, slots=True)
class Description:
    """A device describes itself.

    Ranges are the value that an int16 of 32768 would stand for: accelerometer in g
    (9.80665 m/s²), gyroscope in deg/s, magnetometer in µT.
    """

    protocol: int
    epoch: int  # u32, another one after each start of the device
    name: str
    serial_number: str
    firmware: str
    side: Side
    sensors: tuple[int, ...]
    rate_hz: int
    max_rate_hz: int
    magnetometer_rate_hz: int
    accelerometer_range_g: float
    gyroscope_range_dps: float
    magnetometer_range_ut: float


@dataclass(frozen=True, slots=True)
class ImuPacket:  # noqa: PLW1641 - arrays have no hash
    """One instant of all sensors, in counts; sequence and clock are unwrapped."""

    epoch: int  # low byte of the device's epoch
    status: Status
    sequence: int
    clock_us: int
    answering: Bool[Array, " s"]  # the sensor gave a reading for this instant
    fresh: Bool[Array, " s"]  # its magnetometer reading is new
    counts: Int16[Array, "s 9"]  # accelerometer, gyroscope, magnetometer; x y z each

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ImuPacket) and _equal(self, other)


@dataclass(frozen=True, slots=True)
class Temperature:  # noqa: PLW1641 - arrays have no hash
    """Temperature of every sensor, sent now and then; NaN where unknown."""

    clock_us: int
    celsius: Float[Array, " s"]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Temperature) and _equal(self, other)


@dataclass(frozen=True, slots=True)
class Health:
    """What the device knows of itself since it started."""

    clock_us: int
    sent: int
    dropped: int
    supply_mv: int
    sensor_errors: tuple[int, ...]


class Command(IntEnum):
    """What a host may ask. 0xC0 to 0xDF are reserved for a device's own commands."""

    DESCRIBE = 0x80
    START = 0x81
    STOP = 0x82
    SET_RATE = 0x83
    BLINK = 0x84


class Result(IntEnum):
    """How a command ended."""

    OK = 0
    UNKNOWN_COMMAND = 1
    BAD_ARGUMENT = 2
    BUSY = 3


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to a command, with the command's own code and tag."""

    command: int
    tag: int
    result: int
    text: str


@dataclass(frozen=True, slots=True)
class Request:
    """A command on its way to a device. ``argument`` is the raw argument bytes."""

    command: int
    tag: int
    argument: bytes = b""


class Reason(Enum):
    """Why bytes did not become a packet."""

    FRAMING = "framing"  # not COBS
    CHECKSUM = "checksum"
    LENGTH = "length"  # shorter or longer than its kind of packet
    CONTENT = "content"  # a value that its kind of packet, or this device, cannot have
    OVERLONG = "overlong"  # no end of frame within the largest frame
    UNKNOWN_TYPE = "unknown type"
    OUT_OF_ORDER = "out of order"  # an instant that is not later than the one before


@dataclass(frozen=True, slots=True)
class Corruption:
    """Bytes that are no packet. ``size`` is what they took on the wire, their end included."""

    reason: Reason
    size: int


@dataclass(frozen=True, slots=True)
class Missing:
    """IMU packets that the sequence counter says were sent or dropped but never came."""

    count: int


@dataclass(frozen=True, slots=True)
class Restart:
    """The device began anew: its clock and sequence start over, and what came before is no guide.

    Also said of a device that claims the same epoch but whose clock or sequence was found to
    have jumped back for good.
    """

    epoch: int  # low byte


@dataclass(frozen=True, slots=True)
class ForeignVersion:
    """The device speaks another version of the protocol."""

    version: int


Packet: TypeAlias = (
    Description
    | ImuPacket
    | Temperature
    | Health
    | Reply
    | Corruption
    | Missing
    | Restart
    | ForeignVersion
)


def _equal(a: ImuPacket | Temperature, b: ImuPacket | Temperature) -> bool:
    """Equal field by field; arrays by value, NaN equal to NaN."""
    return all(_same(getattr(a, name), getattr(b, name)) for name in a.__slots__)


def _same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    return a == b
