"""Addresses of devices, and opening them.

========================  =========================================================
``serial:/dev/ttyACM0``   a serial port (``serial:COM5`` on Windows); ``?baud=115200`` behind it
                          is for adapters, USB devices need none
``tcp:host:port``         a device on a socket
``virtual:``              a virtual glove of one's own, started and ended with us
``replay:FILE.mcap``      the bytes of a take, at their own pace (tests and demos)
========================  =========================================================
"""

from __future__ import annotations

from pathlib import Path
from urllib.parse import parse_qsl

from handstudio.device.replay_source import ReplaySource
from handstudio.device.serial_source import SerialSource
from handstudio.device.source import ByteSource
from handstudio.device.tcp_source import TcpSource
from handstudio.device.virtual_source import VirtualSource
from handstudio.errors import DeviceError


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
        case "virtual" if place == "" or place.startswith("?"):
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
