"""Ten million bytes that are noise, or a stream that was damaged, through decoder and stream."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np
import pytest

from handstudio.protocol.codec import encode
from handstudio.protocol.packets import Corruption, ImuPacket, Missing, Restart, Status
from handstudio.samples import Gap, Ranges
from handstudio.simulation.glove import SENSORS, description
from handstudio.stream import EventStream

MANY = 10_000_000
PIECE = 4096
BLOCK = 12

LOST_PER_DAMAGE = 2
"""Instants that one damaged place costs at most: a delimiter that is gone joins two frames."""

ROOM = 1 << 18
"""What decoder and stream may hold on to besides what they gave away [bytes]."""

Damage: TypeAlias = Callable[[bytearray, np.random.Generator, int], None]


@pytest.fixture(params=[MANY // 50, pytest.param(MANY, marks=pytest.mark.long)])
def size(request: pytest.FixtureRequest) -> int:
    return int(request.param)


def stream() -> EventStream:
    return EventStream("handstudio-1", Ranges.of(description("right", 0, 100, 1, "Glove")))


class Held:
    """The memory that stays taken between two looks, without what the test itself keeps."""

    def __init__(self) -> None:
        self.bytes: list[int] = []

    def look(self) -> None:
        """Note what is taken now."""
        self.bytes.append(tracemalloc.get_traced_memory()[0])


@pytest.fixture
def held() -> Iterator[Held]:
    tracemalloc.start(1)
    yield Held()
    tracemalloc.stop()


def test_noise_holds_no_instant_and_no_memory(size, held):
    rng, one = np.random.default_rng(11), stream()
    corruptions = told = at = 0
    while at < size:
        chunk = rng.integers(0, 256, PIECE, dtype=np.uint8).tobytes()
        packets, events = one.feed(chunk, at)
        at += len(chunk)
        assert events == []
        assert all(isinstance(packet, Corruption) for packet in packets)
        corruptions += len(packets)
        told += sum(packet.size for packet in packets)
        if at % (PIECE * 16) == 0:
            held.look()
    assert corruptions > size / 1000
    assert told > 0.99 * size - 2 * PIECE, "all but empty frames is accounted for"
    assert max(held.bytes) - held.bytes[0] < ROOM
    assert len(one.save()) < 4096


# --- damage to a stream ---------------------------------------------------------------------------


def flip(wire: bytearray, rng: np.random.Generator, at: int) -> None:
    wire[at] ^= 1 << int(rng.integers(8))


def replace(wire: bytearray, rng: np.random.Generator, at: int) -> None:
    wire[at] = int(rng.integers(256))


def swallow(wire: bytearray, rng: np.random.Generator, at: int) -> None:
    del wire[at]


def insert(wire: bytearray, rng: np.random.Generator, at: int) -> None:
    wire[at:at] = rng.integers(0, 256, int(rng.integers(1, 20)), dtype=np.uint8).tobytes()


def overrun(wire: bytearray, rng: np.random.Generator, at: int) -> None:
    """As a driver's buffer that ran over: up to a frame's length is gone."""
    del wire[at : at + int(rng.integers(1, 350))]


DAMAGES: tuple[Damage, ...] = (flip, replace, swallow, insert, overrun)


def test_damage_costs_two_instants_a_place_and_every_one_is_told(size, held):
    rng, one = np.random.default_rng(12), stream()
    blocks = size // (BLOCK * 390)
    places = np.zeros(blocks, dtype=int)
    came = np.zeros((blocks, BLOCK), dtype=bool)
    missing = gaps = last = 0
    for k in range(blocks):
        wire = block(rng, k)
        if 0 < k < blocks - 1:  # nobody can miss what is before the first and after the last
            places[k] = damaged(wire, rng)
        for piece in pieces(bytes(wire), rng):
            packets, events = one.feed(piece, k)
            for packet in packets:
                assert not isinstance(packet, Restart)
                if isinstance(packet, Missing):
                    missing += packet.count
                if isinstance(packet, ImuPacket):
                    assert packet.sequence > last or last == 0
                    assert packet.counts[0, 0] == packet.sequence % 1000, "no wrong content"
                    last = packet.sequence
                    came[last // BLOCK, last % BLOCK] = True
            gaps += sum(isinstance(event, Gap) for event in events)
        held.look()
    lost = (~came).sum(axis=1)
    assert places.sum() > size / 20_000
    assert missing == lost.sum(), "what is missing is told, to the last instant"
    # the delimiter of a block's last instant is what its neighbour's first begins after
    assert (lost <= LOST_PER_DAMAGE * (places + np.roll(places, 1))).all()
    assert lost.sum() <= LOST_PER_DAMAGE * places.sum()
    assert 0 < gaps <= places.sum()
    settled = held.bytes[len(held.bytes) // 10 :]
    assert max(settled) - settled[0] < ROOM
    assert len(one.save()) < 4096


def block(rng: np.random.Generator, k: int) -> bytearray:
    """The next instants of a glove, each saying its own number."""
    n = len(SENSORS)
    wire = bytearray()
    for sequence in range(k * BLOCK, (k + 1) * BLOCK):
        counts = rng.integers(-3000, 3000, (n, 9), dtype=np.int16)
        counts[0, 0] = sequence % 1000
        all_of_them = np.ones(n, dtype=bool)
        clock_us = sequence * 10_000 % (1 << 32)
        wire += encode(
            ImuPacket(1, Status(0), sequence, clock_us, all_of_them, all_of_them, counts)
        )
    return wire


def damaged(wire: bytearray, rng: np.random.Generator) -> int:
    """Damage none, one or a few places; how many."""
    places = int(rng.choice([0, 1, 1, 2, 5]))
    for _ in range(places):
        kind = DAMAGES[int(rng.integers(len(DAMAGES)))]
        kind(wire, rng, int(rng.integers(len(wire))))
    return places


def pieces(wire: bytes, rng: np.random.Generator) -> Iterator[bytes]:
    """Cut as a line cuts: anywhere."""
    while wire:
        cut = int(rng.choice([1, 64, 500, 4096]))
        yield wire[:cut]
        wire = wire[cut:]
