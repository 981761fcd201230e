"""Events: what the pipeline eats. SI units, sensor frames, time of the device clock.

Conventions: gyroscope [rad/s]; accelerometer as specific force [m/s²], +9.81 upward at rest;
magnetometer [µT]; time [µs], integer, of the device's own clock since its start.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

import msgspec
import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.protocol.packets import Description, ImuPacket, Missing, Packet, Restart

STANDARD_GRAVITY = 9.80665  # [m/s²]
FULL_SCALE = 32768


@dataclass(frozen=True, slots=True, eq=False)
class ImuSamples:  # noqa: PLW1641 - arrays have no hash
    """A run of consecutive instants of all sensors, none missing between them."""

    time_us: Int64[Array, " n"]
    gyr: Float[Array, "n s 3"]
    acc: Float[Array, "n s 3"]
    mag: Float[Array, "n s 3"]
    fresh: Bool[Array, "n s"]  # the magnetometer reading is new
    valid: Bool[Array, "n s"]  # the sensor answered
    saturated: Bool[Array, "n s"]  # a gyroscope or accelerometer axis is at its limit

    def __len__(self) -> int:
        return len(self.time_us)

    def __getitem__(self, part: slice) -> ImuSamples:
        return ImuSamples(
            self.time_us[part],
            self.gyr[part],
            self.acc[part],
            self.mag[part],
            self.fresh[part],
            self.valid[part],
            self.saturated[part],
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ImuSamples) and all(
            np.array_equal(getattr(self, name), getattr(other, name), equal_nan=name == "mag")
            for name in self.__slots__
        )


class Why(Enum):
    """Why instants are missing."""

    LOST = "lost"  # packets of a running device did not arrive
    RESTART = "restart"  # the device began anew: its clock starts over


@dataclass(frozen=True, slots=True)
class Gap:
    """Instants are missing between the samples before and after."""

    why: Why
    missing: int  # instants known to be missing; 0 where nobody knows
    elapsed_us: int = 0  # host time from the last instant before to the first after a restart


Event: TypeAlias = ImuSamples | Gap


class Ranges(msgspec.Struct, frozen=True):
    """What an int16 of 32768 stands for: [m/s²], [rad/s], [µT]."""

    acc: float
    gyr: float
    mag: float

    @staticmethod
    def of(description: Description) -> Ranges:
        """Ranges of a device in SI."""
        return Ranges(
            acc=description.accelerometer_range_g * STANDARD_GRAVITY,
            gyr=float(np.deg2rad(description.gyroscope_range_dps)),
            mag=description.magnetometer_range_ut,
        )


def from_packets(packets: Iterable[Packet], ranges: Ranges) -> list[Event]:
    """Turn packets into events; whatever is not motion (replies, health, damage) is left out.

    How long a device that restarted was away is not in its packets: ``elapsed_us`` stays 0.
    """
    events: list[Event] = []
    run: list[ImuPacket] = []
    for packet in packets:
        match packet:
            case ImuPacket():
                run.append(packet)
            case Missing(count=count):
                _close(run, ranges, events)
                events.append(Gap(Why.LOST, count))
            case Restart():
                _close(run, ranges, events)
                events.append(Gap(Why.RESTART, 0))
            case _:
                pass
    _close(run, ranges, events)
    return events


def _close(run: list[ImuPacket], ranges: Ranges, events: list[Event]) -> None:
    if run:
        events.append(_samples(run, ranges))
        run.clear()


def _samples(run: Sequence[ImuPacket], ranges: Ranges) -> ImuSamples:
    counts = np.stack([p.counts for p in run])
    si = counts / FULL_SCALE
    inertial = counts[..., :6]
    at_limit = (inertial <= -FULL_SCALE + 1) | (inertial >= FULL_SCALE - 1)
    return ImuSamples(
        time_us=np.array([p.clock_us for p in run], dtype=np.int64),
        acc=si[..., 0:3] * ranges.acc,
        gyr=si[..., 3:6] * ranges.gyr,
        mag=si[..., 6:9] * ranges.mag,
        fresh=np.stack([p.fresh for p in run]),
        valid=np.stack([p.answering for p in run]),
        saturated=np.asarray(at_limit.any(axis=-1)),
    )
