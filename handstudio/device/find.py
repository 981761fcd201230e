"""Finding devices: which ports there are, and which of them are gloves."""

from __future__ import annotations

import time
from dataclasses import dataclass

from serial.tools import list_ports

from handstudio.device.addresses import open_source
from handstudio.device.source import ByteSource, SourceLost
from handstudio.errors import HandstudioError
from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import decoder_named
from handstudio.protocol.packets import Command, Description, ForeignVersion, Request

PROBE_S = 1.0


@dataclass(frozen=True, slots=True)
class Found:
    """A port, and what answered there."""

    address: str
    label: str
    description: Description | None = None
    problem: str = ""

    @property
    def is_glove(self) -> bool:
        """Whether it said that it is one."""
        return self.description is not None


VIRTUAL = Found("virtual:", "Virtual glove (showcase)")
"""Always there: a process that speaks the protocol and plays a showcase."""


def ports() -> list[Found]:
    """Serial ports that a glove could be on: USB and Bluetooth ones, quick, nothing is opened."""
    return [
        Found(f"serial:{port.device}", _label(port.device, port.description, port.product))
        for port in sorted(list_ports.comports())
        if port.vid is not None or "bluetooth" in (port.description or "").lower()
    ]


def probe(address: str, decoder: str = "handstudio-1") -> Found:
    """Ask an address who is there; takes up to a second, never raises."""
    try:
        source = open_source(address)
    except HandstudioError as error:
        return Found(address, address, problem=str(error))
    try:
        return _ask(source, address, decoder)
    except SourceLost as lost:
        return Found(address, address, problem=f"closed the line ({lost})")
    finally:
        source.close()


def _ask(source: ByteSource, address: str, decoder: str) -> Found:
    listening = decoder_named(decoder)()
    source.write(encode(Request(Command.DESCRIBE, 0)))
    end = time.monotonic() + PROBE_S
    while time.monotonic() < end:
        for packet in listening.feed(source.read(0.1)):
            match packet:
                case Description():
                    return Found(address, f"{packet.name} ({packet.serial_number})", packet)
                case ForeignVersion(version=version):
                    return Found(address, address, problem=f"speaks protocol version {version}")
                case _:
                    pass
    return Found(address, address, problem="does not say that it is a glove")


def _label(device: str, description: str | None, product: str | None) -> str:
    name = product or description or ""
    return f"{name} ({device})" if name and name != "n/a" else device
