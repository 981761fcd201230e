"""From the bytes of a device to packets and events: the same steps live and from a take."""

from __future__ import annotations

import msgspec

from handstudio.errors import SetupError
from handstudio.protocol.decoder import Decoder, decoder_named
from handstudio.protocol.packets import ImuPacket, Packet
from handstudio.samples import Event, Ranges, from_packets


class _Packed(msgspec.Struct):
    decoder: bytes
    last_instant_ns: int | None


class EventStream:
    """Decodes one device's bytes and keeps the host time of its newest instant.

    Args:
        decoder: Name of the decoder.
        ranges: What counts stand for; None while the device has not described itself, which
            yields packets but no events.
    """

    def __init__(self, decoder: str, ranges: Ranges | None) -> None:
        self.ranges = ranges
        self._decoder: Decoder = decoder_named(decoder)()
        self._last_instant_ns: int | None = None

    def feed(self, chunk: bytes, arrival_ns: int) -> tuple[list[Packet], list[Event]]:
        """Decode a chunk that arrived at host time ``arrival_ns``."""
        packets = self._decoder.feed(chunk)
        away_ns = arrival_ns - (self._last_instant_ns or arrival_ns)
        if any(isinstance(packet, ImuPacket) for packet in packets):
            self._last_instant_ns = arrival_ns
        if self.ranges is None:
            return packets, []
        return packets, from_packets(packets, self.ranges, away_ns // 1000)

    def save(self) -> bytes:
        """Everything the next chunk's meaning depends on."""
        return msgspec.msgpack.encode(_Packed(self._decoder.save(), self._last_instant_ns))

    @staticmethod
    def resumed(decoder: str, ranges: Ranges | None, saved: bytes) -> EventStream:
        """A stream that goes on where `save` was called.

        Raises:
            HandstudioError: these bytes were not saved by this version.
        """
        stream = EventStream(decoder, ranges)
        try:
            got = msgspec.msgpack.decode(saved, type=_Packed)
            stream._decoder = type(stream._decoder).restore(got.decoder)
        except msgspec.MsgspecError as error:
            raise SetupError(
                f"The decoder state stored with this recording cannot be read: {error}.",
                "Process the take from its start instead: handstudio process --from-start.",
            ) from error
        stream._last_instant_ns = got.last_instant_ns
        return stream
