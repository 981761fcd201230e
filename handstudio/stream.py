"""From the bytes of a device to packets and events: the same steps live and from a take."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from handstudio.errors import SetupError
from handstudio.protocol.decoder import Decoder, decoder_named
from handstudio.protocol.packets import ImuPacket, Packet, Restart
from handstudio.samples import Event, Gap, ImuSamples, Ranges, Why, from_packets


class _Packed(msgspec.Struct):
    decoder: bytes
    last_instant_ns: int | None
    restarted: bool = False


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
        self._restarted = False  # and no instant has come since

    def feed(self, chunk: bytes, arrival_ns: int) -> tuple[list[Packet], list[Event]]:
        """Decode a chunk that arrived at host time ``arrival_ns``."""
        packets = self._decoder.feed(chunk)
        return packets, self._events(packets, arrival_ns)

    def feed_all(self, chunks: Iterable[tuple[int, bytes]]) -> list[Event]:
        """The events of chunks one after the other: the same instants in longer runs."""
        events: list[Event] = []
        waiting, newest_ns = list[Packet](), 0
        for arrival_ns, chunk in chunks:
            packets = self._decoder.feed(chunk)
            if self._restarted or any(isinstance(packet, Restart) for packet in packets):
                # how long it was away is told by when its next instant came
                events += self._events(waiting, newest_ns)
                events += self._events(packets, arrival_ns)
                waiting = []
                continue
            waiting += packets
            if any(isinstance(packet, ImuPacket) for packet in packets):
                newest_ns = arrival_ns
        return events + self._events(waiting, newest_ns)

    def _events(self, packets: list[Packet], arrival_ns: int) -> list[Event]:
        if self.ranges is None:
            return []
        events: list[Event] = []
        for event in from_packets(packets, self.ranges):
            match event:
                case Gap(why=Why.RESTART):
                    self._restarted = True  # told with the next instant: how long is known then
                case Gap():
                    events.append(event)
                case ImuSamples():
                    events += [*self._restart_before(arrival_ns), event]
        return events

    def save(self) -> bytes:
        """Everything the next chunk's meaning depends on."""
        return msgspec.msgpack.encode(
            _Packed(self._decoder.save(), self._last_instant_ns, self._restarted)
        )

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
                "The decoder state stored with this recording cannot be read: {reason}.",
                "Process the take from its start instead: handstudio process --from-start.",
                reason=error,
            ) from error
        stream._last_instant_ns = got.last_instant_ns
        stream._restarted = got.restarted
        return stream

    def _restart_before(self, arrival_ns: int) -> list[Event]:
        """What has to be said before an instant that arrives now."""
        away_ns = arrival_ns - (self._last_instant_ns or arrival_ns)
        restart: list[Event] = [Gap(Why.RESTART, 0, away_ns // 1000)] if self._restarted else []
        self._restarted, self._last_instant_ns = False, arrival_ns
        return restart
