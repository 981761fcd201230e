"""An open line to a device: questions go out on it, and it is known who is there, or not yet."""

from __future__ import annotations

import time

from handstudio.device.source import ByteSource
from handstudio.errors import DeviceError
from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import Decoder, decoder_named
from handstudio.protocol.framing import DELIMITER
from handstudio.protocol.packets import Command, Corruption, Packet, Request

READ_S = 0.02
"""How long a read waits for the first byte, and so how soon an order is heard."""

PACE_S = 0.004
"""Between two reads, at least: at 1000 Hz one instant at a time costs three times as much."""

BEHIND = 3000
"""After so many bytes at once we are behind, and read on without a pause."""

ASK_S = 0.5
"""Between two times of asking the same."""


BABBLE = 16
"""So many bytes hold a packet, or are none of the protocol's."""


class Line:
    """A line and what happened on it. What it says is held until it is known who says it.

    Args:
        source: The open source, ours from now on.
        decoder: Name of the device's decoder.

    Attributes:
        introduced: It is known who is there.
        opened: When it was opened, or who is there became unknown [monotonic s].
        heard: When the last byte came.
        moved: When the last motion came, or the device was met.
        received: Bytes so far.
        understood: Among them were packets of the protocol, be they nothing to us.
    """

    def __init__(self, source: ByteSource, decoder: str) -> None:
        self.introduced = False
        self.received = 0
        self.understood = False
        self.opened = self.heard = self.moved = time.monotonic()
        self._source = source
        self._decoder = decoder
        self._scout: Decoder = decoder_named(decoder)()
        self._held: list[tuple[int, bytes]] = []
        self._asked: dict[int, float] = {}
        self._tag = 0
        self._greeted = False
        self._read_next = 0.0

    def read(self) -> bytes:
        """What came, maybe nothing, waiting a little for it.

        Raises:
            SourceLost: the other end went away.
        """
        time.sleep(max(0.0, self._read_next - time.monotonic()))
        chunk = self._source.read(READ_S)
        now = time.monotonic()
        self._read_next = now if len(chunk) >= BEHIND else now + PACE_S
        if chunk:
            self.heard = now
            self.received += len(chunk)
        return chunk

    def ask(self, command: int, argument: bytes = b"") -> None:
        """Send a command.

        Raises:
            SourceLost: the other end went away.
            ValueError: it is no command.
        """
        self._tag = (self._tag + 1) % 256
        question = encode(Request(int(command), self._tag, argument))
        # whatever half a frame the device still holds of somebody else ends here
        self._source.write(question if self._greeted else DELIMITER + question)
        self._greeted = True
        self._asked[command] = time.monotonic()

    def ask_again(self, command: Command) -> None:
        """Send a command unless it was sent just now.

        Raises:
            SourceLost: the other end went away.
        """
        if time.monotonic() - self._asked.get(command, -ASK_S) >= ASK_S:
            self.ask(command)

    def hold(self, arrival_ns: int, chunk: bytes) -> list[Packet]:
        """Keep what came before it is known from whom; what it says, for finding out."""
        self._held.append((arrival_ns, chunk))
        packets = self._scout.feed(chunk)
        self.understood |= any(not isinstance(packet, Corruption) for packet in packets)
        return packets

    @property
    def babbles(self) -> bool:
        """Bytes come, and none of them ever was part of a packet."""
        return self.received >= BABBLE and not self.understood

    def release(self) -> list[tuple[int, bytes]]:
        """What was held, with its times of arrival; it is held no more."""
        held, self._held = self._held, []
        return held

    def forget(self) -> None:
        """The device began anew: it must say again who it is."""
        self.introduced = False
        self.opened = time.monotonic()
        self._asked.clear()
        self._scout = decoder_named(self._decoder)()

    def close(self) -> None:
        """Let go; never raises."""
        self._source.close()


def stranger(line: Line, address: str, waited_s: float) -> DeviceError:
    """Who is there did not say that it is a glove."""
    if line.received == 0:
        return DeviceError(
            "{address} did not say that it is a glove: nothing came within {seconds:.0f} s.",
            "Switch the glove on, or choose another port.",
            address=address,
            seconds=waited_s,
        )
    if line.babbles and address.startswith("serial:"):
        return DeviceError(
            "{address} did not say that it is a glove: {bytes} bytes came within {seconds:.0f} s, "
            "none of them of the protocol.",
            "Choose another port. Where the glove is behind a UART adapter, the baud rate may be "
            "wrong: add it to the address, {port}?baud=115200. A glove of another make needs its "
            "decoder (handstudio/protocol/MAKERS.md).",
            address=address,
            bytes=line.received,
            seconds=waited_s,
            port=address.partition("?")[0],
        )
    return DeviceError(
        "{address} did not say that it is a glove: {bytes} bytes came within {seconds:.0f} s.",
        "Choose another port, switch the glove off and on, or choose the decoder it needs "
        "(handstudio/protocol/MAKERS.md).",
        address=address,
        bytes=line.received,
        seconds=waited_s,
    )
