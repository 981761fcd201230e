"""No bytes stop a decoder, and what is lost is no more than what was damaged."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import CommandDecoder, V1Decoder
from handstudio.protocol.framing import MAX_FRAME, Frame, Framing, unframe
from handstudio.protocol.packets import Corruption, ImuPacket, Missing, Packet, Reason

Instant = Callable[..., ImuPacket]
Streamed = Callable[[range], bytes]


def instants(packets: list[Packet]) -> list[ImuPacket]:
    return [packet for packet in packets if isinstance(packet, ImuPacket)]


@given(st.lists(st.binary(max_size=2000), max_size=5))
def test_random_bytes_never_raise(chunks: list[bytes]) -> None:
    host, device = V1Decoder(), CommandDecoder()
    for chunk in chunks:
        host.feed(chunk)
        device.feed(chunk)


def test_half_a_million_random_bytes_hold_no_packet() -> None:
    noise = random.Random(1).randbytes(500_000)
    packets = V1Decoder().feed(noise)
    assert len(packets) > 1000
    assert all(isinstance(packet, Corruption) for packet in packets)


def test_half_a_million_bytes_with_flipped_bits_lose_two_packets_a_flip_at_most(
    instant: Instant, streamed: Streamed
) -> None:
    count = 500_000 // len(encode(instant(1)))
    sent = streamed(range(1, count + 1))
    rng, wire = random.Random(2), bytearray(sent)
    flipped = rng.sample(range(len(wire)), 800)
    for at in flipped:
        wire[at] ^= 1 << rng.randrange(8)
    packets = V1Decoder().feed(bytes(wire))
    came = instants(packets)
    assert count - 2 * len(flipped) <= len(came) < count
    assert all(packet == instant(packet.sequence) for packet in came)
    missing = sum(packet.count for packet in packets if isinstance(packet, Missing))
    assert missing == came[-1].sequence - came[0].sequence + 1 - len(came)


@pytest.mark.parametrize("byte", [0x00, 0x01, 0xFF, None])
def test_any_single_damaged_byte_loses_two_packets_at_most(
    instant: Instant, streamed: Streamed, byte: int | None
) -> None:
    """Replaced or, for None, swallowed; at every place of the second and third of five."""
    stream = streamed(range(1, 6))
    size = len(encode(instant(1)))
    for at in range(size, 3 * size):
        damaged = stream[:at] + (b"" if byte is None else bytes((byte,))) + stream[at + 1 :]
        packets = V1Decoder().feed(damaged)
        came = [packet.sequence for packet in instants(packets)]
        assert len(came) >= 3
        assert came[0] == 1
        assert came[-1] == 5
        assert 1 + sum(p.count for p in packets if isinstance(p, Missing)) + len(came) == 6


@given(st.binary(min_size=1, max_size=30), st.data())
def test_inserted_bytes_lose_two_packets_at_most(
    instant: Instant, streamed: Streamed, noise: bytes, data: st.DataObject
) -> None:
    stream = streamed(range(1, 6))
    at = data.draw(st.integers(0, len(stream)))
    assert len(instants(V1Decoder().feed(stream[:at] + noise + stream[at:]))) >= 3


def test_the_tail_of_a_frame_at_the_beginning_is_no_damage(
    instant: Instant, streamed: Streamed
) -> None:
    stream = streamed(range(1, 3))
    size = len(encode(instant(1)))
    for at in range(1, size):
        assert V1Decoder().feed(stream[at:]) == [instant(2)]
    assert V1Decoder().feed(stream) == [instant(1), instant(2)]


def test_only_the_first_fragment_is_excused(instant: Instant) -> None:
    read = V1Decoder().feed(b"tail\0junk\0" + encode(instant(1)))
    assert read == [Corruption(Reason.FRAMING, 5), instant(1)]


def test_zeros_between_frames_mean_nothing(instant: Instant) -> None:
    read = V1Decoder().feed(bytes(9) + encode(instant(1)) + bytes(2000) + encode(instant(2)))
    assert read == [instant(1), instant(2)]


def test_a_stream_without_an_end_is_given_up_piece_by_piece_and_forgotten(
    instant: Instant,
) -> None:
    decoder = V1Decoder()
    piece = Corruption(Reason.OVERLONG, MAX_FRAME - 1)
    assert decoder.feed(b"\x07" * 100 * MAX_FRAME) == [piece] * 100
    assert len(decoder.save()) < 2 * MAX_FRAME
    rest = Corruption(Reason.OVERLONG, 101)
    assert decoder.feed(b"\0" + encode(instant(1))) == [rest, instant(1)]


def test_the_longest_frame_is_not_overlong() -> None:
    longest = b"\x01" * (MAX_FRAME - 1) + b"\0"
    for first in (b"\0" + longest, b"\0\x01" + longest):
        (found,) = V1Decoder().feed(first)[:1]
        assert isinstance(found, Corruption)
        assert (found.reason is Reason.OVERLONG) == (len(first) > MAX_FRAME + 1)


@given(st.lists(st.binary(max_size=40) | st.just(bytes(3)) | st.just(b"\x09" * 1500)))
def test_every_byte_is_accounted_for(chunks: list[bytes]) -> None:
    stream = b"".join(chunks)
    state, found = unframe(Framing(synchronised=True), stream)
    told = sum(one.size for one in found)
    empty = sum(before == after == 0 for before, after in zip(b"\0" + stream, stream, strict=False))
    assert told + empty + len(state.pending) == len(stream)
    assert len(state.pending) < MAX_FRAME
    assert not any(isinstance(one, Frame) for one in found)
