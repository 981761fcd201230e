"""The laws of a decoder, to be run on bytes of a real device. For tests, ours and a maker's."""

from __future__ import annotations

import random
from collections.abc import Iterator

from handstudio.errors import TakeError
from handstudio.protocol.decoder import Decoder
from handstudio.protocol.packets import ImuPacket, Packet, Restart


def check_decoder(kind: type[Decoder], stream: bytes, seed: int = 0) -> list[Packet]:
    """Check every law on a stream of a device and on damaged copies of it.

    Returns:
        The packets of the stream as it is, for tests of what they say.

    Raises:
        AssertionError: which law is broken, and where.
    """
    rng = random.Random(seed)
    packets = kind().feed(stream)
    for sample in (stream, *(_damaged(stream, rng) for _ in range(5)), rng.randbytes(5000)):
        _check_pieces(kind, sample, rng)
        _check_resume(kind, sample, rng)
        _check_order(kind().feed(sample))
    _check_refusal(kind)
    return packets


def pieces(stream: bytes, rng: random.Random) -> Iterator[bytes]:
    """A stream cut at random, empty pieces and single bytes included."""
    while stream:
        size = rng.choice((0, 1, 2, 7, 64, 500))
        yield stream[:size]
        stream = stream[size:]


def _check_pieces(kind: type[Decoder], stream: bytes, rng: random.Random) -> None:
    whole, decoder = kind().feed(stream), kind()
    cut = [packet for piece in pieces(stream, rng) for packet in decoder.feed(piece)]
    _check(cut == whole, "the same bytes in other pieces gave other packets")


def _check_resume(kind: type[Decoder], stream: bytes, rng: random.Random) -> None:
    whole = kind().feed(stream)
    for at in sorted(rng.sample(range(len(stream) + 1), min(len(stream), 50))):
        decoder = kind()
        before = decoder.feed(stream[:at])
        after = kind.restore(decoder.save()).feed(stream[at:])
        _check(before + after == whole, f"save and restore at byte {at} gave other packets")


def _check_order(packets: list[Packet]) -> None:
    last: ImuPacket | None = None
    for packet in packets:
        if isinstance(packet, Restart):
            last = None
        elif isinstance(packet, ImuPacket):
            later = last is None or (
                packet.sequence > last.sequence and packet.clock_us > last.clock_us
            )
            _check(later, f"the packet of sequence {packet.sequence} is not after the one before")
            last = packet


def _check_refusal(kind: type[Decoder]) -> None:
    try:
        kind.restore(b"no state")
    except TakeError:
        return
    raise AssertionError("what no decoder saved was restored instead of a TakeError")


def _damaged(stream: bytes, rng: random.Random) -> bytes:
    damaged = bytearray(stream)
    for _ in range(1 + len(stream) // 500):
        damaged[rng.randrange(len(stream))] = rng.randrange(256)
    return bytes(damaged)


def _check(right: bool, law: str) -> None:
    if not right:
        raise AssertionError(law)
