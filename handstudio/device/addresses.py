"""Addresses of devices, and opening them.

========================  =========================================================
``serial:/dev/ttyACM0``   a serial port (``serial:COM5`` on Windows); ``?baud=115200`` behind it
                          is for adapters, USB devices need none
``tcp:host:port``         a device on a socket
``virtual:``              a virtual glove of one's own, started and ended with us; on a certain
                          person, who does something: ``virtual:?subject=7&motion=open_close``
``replay:FILE.mcap``      the bytes of a take, at their own pace (tests and demos)
========================  =========================================================
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from urllib.parse import parse_qsl, urlencode

from handstudio.device.replay_source import ReplaySource
from handstudio.device.serial_source import SerialSource
from handstudio.device.source import ByteSource
from handstudio.device.tcp_source import TcpSource
from handstudio.device.virtual_source import VirtualSource
from handstudio.errors import DeviceError


@dataclass(frozen=True, slots=True)
class VirtualWearer:
    """Who wears a virtual glove, what that person does, and how the sensors are.

    Attributes:
        subject: Number of a virtual person; 0 is the ideal one.
        motion: In the language of `simulation.motions.language`.
        imperfections: As `simulation.imperfections.strengths.parse` reads them.
    """

    subject: int = 0
    motion: str = "showcase"
    imperfections: str = "plain"

    @property
    def address(self) -> str:
        """The address; what is at its default is left out."""
        given = {k: str(v) for k, v in asdict(self).items() if v != getattr(_NOBODY, k)}
        return f"virtual:?{urlencode(given)}" if given else "virtual:"

    @staticmethod
    def of(address: str) -> VirtualWearer | None:
        """Who wears the glove of this address; None where it is not virtual, or not understood."""
        if not is_virtual(address):
            return None
        given = dict(parse_qsl(address.partition("?")[2]))
        known = {k: v for k, v in given.items() if k in ("motion", "imperfections")}
        number = given.get("subject", "0")
        return VirtualWearer(int(number) if number.isdecimal() else 0, **known)


def is_virtual(address: str) -> bool:
    """Whether a virtual glove is there."""
    return address == "virtual:" or address.startswith("virtual:?")


def open_source(address: str) -> ByteSource:
    """Open an address.

    Raises:
        DeviceError: it is no address, or cannot be opened; says what to do.
    """
    scheme, _, place = address.partition(":")
    match scheme:
        case "serial" if place:
            return SerialSource(place)
        case "tcp" if place:
            return TcpSource(place)
        case "virtual" if is_virtual(address):
            return VirtualSource(dict(parse_qsl(place[1:])))
        case "replay" if place:
            return ReplaySource(Path(place))
        case _:
            raise DeviceError(
                "{address!r} is not the address of a device.",
                "Write serial:PORT, tcp:HOST:PORT, virtual: (or virtual:?rate=1000) or "
                "replay:FILE.",
                address=address,
            )


_NOBODY = VirtualWearer()
