"""One packet after another: counters unwrapped, gaps and restarts told, what is late refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import msgspec

from handstudio.protocol.codec import Parsed
from handstudio.protocol.packets import (
    Corruption,
    Description,
    ForeignVersion,
    Health,
    ImuPacket,
    Missing,
    Packet,
    Reason,
    Reply,
    Restart,
    Temperature,
)

PATIENCE = 100
"""So many packets out of order in a row, and the device is believed: it began anew."""

_WRAP = 1 << 32


class Instant(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An instant of the sensors, unwrapped."""

    sequence: int
    clock_us: int


class Continuity(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What must be remembered of the packets so far to place the next one."""

    epoch_low: int | None = None
    epoch: int | None = None  # the whole of it, once described
    sensors: int | None = None  # how many, once described
    last: Instant | None = None  # of the last IMU packet
    clock_us: int | None = None  # of the last packet with a clock: it runs while IMUs rest
    strays: int = 0  # packets out of order in a row


def follow(state: Continuity, packet: Parsed, size: int) -> tuple[Continuity, Sequence[Packet]]:
    """Place the next parsed packet, which took ``size`` bytes of wire.

    Within an epoch the IMU packets that come out rise strictly in sequence and in clock. A jump
    of either is never fatal: forward it is taken, backward it is refused (OUT_OF_ORDER) until
    `PATIENCE` packets in a row say the same, then it is a `Restart`.
    """
    match packet:
        case ImuPacket():
            return _follow_imu(state, packet, size)
        case Description():
            return _follow_description(state, packet)
        case Temperature(celsius=values) | Health(sensor_errors=values):
            if not _fits(state, len(values)):
                return state, [Corruption(Reason.CONTENT, size)]
            clock_us = _nearest(packet.clock_us, state.clock_us)
            state = msgspec.structs.replace(state, clock_us=clock_us)
            return state, [replace(packet, clock_us=clock_us)]
        case Reply() | ForeignVersion():
            return state, [packet]


def _follow_imu(state: Continuity, packet: ImuPacket, size: int) -> tuple[Continuity, list[Packet]]:
    if state.epoch_low not in (None, packet.epoch):
        return _anew(packet)
    if not _fits(state, len(packet.answering)):
        return state, [Corruption(Reason.CONTENT, size)]
    instant, missing = _placed(state, packet)
    if instant is None:
        if state.strays + 1 >= PATIENCE:
            return _anew(packet)
        strays = msgspec.structs.replace(state, strays=state.strays + 1)
        return strays, [Corruption(Reason.OUT_OF_ORDER, size)]
    if (packet.sequence, packet.clock_us) != (instant.sequence, instant.clock_us):
        packet = replace(packet, sequence=instant.sequence, clock_us=instant.clock_us)
    state = Continuity(packet.epoch, state.epoch, state.sensors, instant, instant.clock_us)
    return state, [Missing(missing), packet] if missing else [packet]


def _follow_description(
    state: Continuity, packet: Description
) -> tuple[Continuity, Sequence[Packet]]:
    low, sensors = packet.epoch & 0xFF, len(packet.sensors)
    if state.epoch_low in (None, low) and state.epoch in (None, packet.epoch):
        state = msgspec.structs.replace(state, epoch_low=low, epoch=packet.epoch, sensors=sensors)
        return state, [packet]
    return Continuity(low, packet.epoch, sensors), [Restart(low), packet]


def _anew(packet: ImuPacket) -> tuple[Continuity, list[Packet]]:
    instant = Instant(packet.sequence, packet.clock_us)
    state = Continuity(packet.epoch, last=instant, clock_us=instant.clock_us)
    return state, [Restart(packet.epoch), packet]


def _placed(state: Continuity, packet: ImuPacket) -> tuple[Instant | None, int]:
    """When a packet is from and how many are missing before it; None: not after the last."""
    clock_us = _nearest(packet.clock_us, state.clock_us)
    if state.last is None:
        return Instant(packet.sequence, clock_us), 0
    ahead = (packet.sequence - state.last.sequence) % _WRAP
    if not 0 < ahead < _WRAP // 2 or clock_us <= state.last.clock_us:
        return None, 0
    return Instant(state.last.sequence + ahead, clock_us), ahead - 1


def _nearest(raw: int, reference: int | None) -> int:
    """The value that wraps to ``raw`` and is nearest to the reference."""
    if reference is None:
        return raw
    return reference + (raw - reference + _WRAP // 2) % _WRAP - _WRAP // 2


def _fits(state: Continuity, sensors: int) -> bool:
    return state.sensors in (None, sensors)
