"""Bytes in, packets out: the seam for every glove, and the decoders of our own protocol."""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Literal, Protocol, TypeAlias, runtime_checkable

import msgspec

from handstudio.errors import SetupError, TakeError
from handstudio.protocol.codec import parse, parse_request
from handstudio.protocol.continuity import Continuity, follow
from handstudio.protocol.framing import Framing, unframe
from handstudio.protocol.packets import Corruption, Packet, Reason, Request

DecodedCommand: TypeAlias = Request | Corruption

ENTRY_POINTS = "handstudio.decoders"
"""Group of entry points under which other packages offer decoders."""


@runtime_checkable
class Decoder(Protocol):
    """What a glove says, whatever its language. Made with no arguments, then fed.

    The laws (`handstudio.protocol.contract` checks them): bytes in any pieces give the same
    packets; no bytes make it raise; to save and restore between any two bytes changes nothing.
    IMU packets rise strictly in sequence and clock until a `Restart`.
    """

    def feed(self, chunk: bytes) -> list[Packet]:
        """Take the next bytes as they came; return the packets they complete."""
        ...

    def save(self) -> bytes:
        """Everything remembered, for `restore`."""
        ...

    @classmethod
    def restore(cls, saved: bytes) -> Decoder:
        """A decoder that goes on where the saved one stood.

        Raises:
            TakeError: these bytes were not saved by this kind of decoder.
        """
        ...


class V1State(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    tag_field="decoder",
    tag="handstudio-1",
):
    """All that a `V1Decoder` remembers. ``layout`` counts how this is saved, not the protocol."""

    layout: Literal[1]
    framing: Framing
    continuity: Continuity


class V1Decoder:
    """Our protocol, version 1. What it makes of damage, gaps and restarts: README.md."""

    def __init__(self, state: V1State | None = None) -> None:
        self._state = state or V1State(1, Framing(), Continuity())

    def feed(self, chunk: bytes) -> list[Packet]:
        """Take the next bytes as they came; return the packets they complete."""
        framing, found = unframe(self._state.framing, chunk)
        continuity, packets = self._state.continuity, list[Packet]()
        for one in found:
            if isinstance(one, Corruption):
                packets.append(one)
                continue
            parsed = parse(one.payload)
            if isinstance(parsed, Reason):
                packets.append(Corruption(parsed, one.size))
                continue
            continuity, placed = follow(continuity, parsed, one.size)
            packets += placed
        self._state = V1State(1, framing, continuity)
        return packets

    def save(self) -> bytes:
        """The state as JSON."""
        return msgspec.json.encode(self._state)

    @classmethod
    def restore(cls, saved: bytes) -> V1Decoder:
        """A decoder that goes on where the saved one stood.

        Raises:
            TakeError: these bytes were not saved by this kind of decoder.
        """
        try:
            return cls(msgspec.json.decode(saved, type=V1State))
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise TakeError(
                "The saved state of the decoder cannot be read: {reason}.",
                "Process the take again from its beginning.",
                reason=error,
            ) from error


class CommandDecoder:
    """The device's side: bytes from a host in any pieces, commands out. Never raises."""

    def __init__(self) -> None:
        self._framing = Framing()

    def feed(self, chunk: bytes) -> list[DecodedCommand]:
        """Take the next bytes; return the commands they complete, and what was none."""
        self._framing, found = unframe(self._framing, chunk)
        commands: list[DecodedCommand] = []
        for one in found:
            parsed = one if isinstance(one, Corruption) else parse_request(one.payload)
            commands.append(Corruption(parsed, one.size) if isinstance(parsed, Reason) else parsed)
        return commands


DECODERS: dict[str, type[Decoder]] = {"handstudio-1": V1Decoder}
"""Decoders of this package by name; others come through entry points."""


def decoder_named(name: str) -> type[Decoder]:
    """The decoder of that name: ours, or one that an installed package offers.

    Raises:
        SetupError: nobody offers it, or what is offered cannot be loaded.
    """
    if name in DECODERS:
        return DECODERS[name]
    offered = entry_points(group=ENTRY_POINTS)
    if name not in offered.names:
        raise SetupError(
            "No decoder is called {name!r}; known are {known}.",
            "Choose one of these, or install the package that brings it.",
            name=name,
            known=", ".join(sorted({*DECODERS, *offered.names})),
        )
    try:
        found: type[Decoder] = offered[name].load()
    except (ImportError, AttributeError) as error:
        raise SetupError(
            "The decoder {name!r} cannot be loaded: {reason}.",
            "Install the package that brings it anew.",
            name=name,
            reason=error,
        ) from error
    return found
