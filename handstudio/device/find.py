"""Finding devices: which ports there are, and which of them are gloves."""

from __future__ import annotations

import time
from dataclasses import dataclass

from serial.tools import list_ports

from handstudio.device.addresses import open_source
from handstudio.device.host_clock import now_ns
from handstudio.device.line import Line
from handstudio.device.source import SourceLost
from handstudio.errors import HandstudioError
from handstudio.protocol.packets import Command, Description, ForeignVersion

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


VIRTUAL = Found("virtual:", "Virtual glove")
"""Always there: a process that speaks the protocol, worn by a virtual person."""


def ports() -> list[Found]:
    """Serial ports that a glove could be on: USB and Bluetooth ones, quick, nothing is opened."""
    return [
        Found(f"serial:{port.device}", _label(port.device, port.description, port.product))
        for port in sorted(list_ports.comports())
        if port.vid is not None or _is_bluetooth(port.device, port.description)
    ]


def probe(address: str, decoder: str = "handstudio-1") -> Found:
    """Ask an address who is there; takes up to a second, never raises."""
    try:
        source = open_source(address)
    except HandstudioError as error:
        return Found(address, address, problem=str(error))
    try:
        return _ask(Line(source, decoder), address)
    except SourceLost as lost:
        return Found(address, address, problem=f"closed the line ({lost})")
    except HandstudioError as error:
        return Found(address, address, problem=str(error))
    finally:
        source.close()


def _ask(line: Line, address: str) -> Found:
    end = line.opened + PROBE_S
    while time.monotonic() < end:
        line.ask_again(Command.DESCRIBE)
        for packet in line.hold(now_ns(), line.read()):
            match packet:
                case Description():
                    return Found(address, f"{packet.name} ({packet.serial_number})", packet)
                case ForeignVersion(version=version):
                    return Found(address, address, problem=f"speaks protocol version {version}")
                case _:
                    pass
    problem = "does not say that it is a glove"
    if line.babbles:
        problem += f": {line.received} bytes came, none of the protocol; the baud rate may be wrong"
    return Found(address, address, problem=problem)


def _is_bluetooth(device: str, description: str | None) -> bool:
    told = f"{device} {description}".lower()
    return "bluetooth" in told or "rfcomm" in told


def _label(device: str, description: str | None, product: str | None) -> str:
    name = product or description or ""
    if not name or name == "n/a":
        return device
    return name if device in name else f"{name} ({device})"
