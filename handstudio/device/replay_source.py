"""A take as a device: its bytes again, at the pace they came (for tests and demos)."""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from handstudio.device.source import SourceLost
from handstudio.errors import DeviceError, TakeError
from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import V1Decoder
from handstudio.protocol.packets import TIP_SENSOR, Description, ImuPacket
from handstudio.recording.take import Take, open_take
from handstudio.samples import STANDARD_GRAVITY

LONGEST_GAP_NS = 1_000_000_000
"""A longer gap in the take is played as so long: whoever listens gives a silent line up."""


class ReplaySource:
    """Yields a device's description, then the recorded chunks."""

    def __init__(self, path: Path) -> None:
        take = open_take(path)
        if take.header.kind != "wire" or take.header.setup.decoder != "handstudio-1":
            raise DeviceError(
                "{path}: holds no bytes of a device that can be played back.",
                "Open it in Review instead.",
                path=path,
            )
        self._chunks: Iterator[tuple[int, bytes]] = take.chunks()
        self._next: tuple[int, bytes] | None = (0, encode(_description(take)))
        self._shift_ns: int | None = None

    def read(self, timeout_s: float) -> bytes:
        """The next chunk when it is due."""
        if self._next is None:
            raise SourceLost("the take has ended")
        due_ns, chunk = self._next
        wait_s = 0.0 if self._shift_ns is None else (due_ns + self._shift_ns - _now()) * 1e-9
        if wait_s > timeout_s:
            time.sleep(timeout_s)
            return b""
        time.sleep(max(0.0, wait_s))
        self._next = self._following()
        if self._next is None:
            return chunk
        if self._shift_ns is None:
            self._shift_ns = _now() - self._next[0]
        else:
            self._shift_ns -= max(0, self._next[0] - due_ns - LONGEST_GAP_NS)
        return chunk

    def write(self, data: bytes) -> None:
        """A recording cannot be asked for anything."""

    def close(self) -> None:
        """Let go."""
        self._chunks, self._next = iter(()), None

    def _following(self) -> tuple[int, bytes] | None:
        try:
            return next(self._chunks, None)
        except TakeError as error:  # only reading on shows that a take is damaged
            raise SourceLost(error.what) from error


def _now() -> int:
    return time.monotonic_ns()


def _description(take: Take) -> Description:
    setup = take.header.setup
    device, ranges = setup.device, setup.ranges
    if device is None or ranges is None:
        raise DeviceError(
            "{path}: does not say which device it is from.", "Choose another.", path=take.path
        )
    numbers = [TIP_SENSOR if n == "Tip" else int(n.removeprefix("SN")) for n in setup.layout.names]
    side = setup.layout.side
    return Description(
        protocol=device.protocol,
        epoch=secrets.randbits(24) << 8 | _epoch_low(take),
        name=device.name,
        serial_number=device.serial_number,
        firmware=device.firmware,
        side=side if side in ("left", "right") else "unknown",  # type: ignore[arg-type]
        sensors=tuple(numbers),
        rate_hz=round(setup.rate_hz),
        max_rate_hz=round(setup.rate_hz),
        magnetometer_rate_hz=round(setup.magnetometer_rate_hz or 0),
        accelerometer_range_g=ranges.acc / STANDARD_GRAVITY,
        gyroscope_range_dps=float(np.rad2deg(ranges.gyr)),
        magnetometer_range_ut=ranges.mag,
    )


def _epoch_low(take: Take) -> int:
    """What the packets of the take repeat: the rest of an epoch is one of each replay's own."""
    decoder = V1Decoder()
    for _, chunk in take.chunks():
        for packet in decoder.feed(chunk):
            if isinstance(packet, ImuPacket):
                return packet.epoch
    return 0
