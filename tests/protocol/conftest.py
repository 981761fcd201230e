"""Packets of a small glove, for every test of the protocol."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from handstudio.protocol.codec import encode
from handstudio.protocol.packets import Description, ImuPacket, Status

SENSORS = 3


@pytest.fixture(scope="session")
def instant() -> Callable[..., ImuPacket]:
    """``instant(sequence, clock_us=..., epoch=1, sensors=3)``: noise of its own for each."""

    def make(
        sequence: int, clock_us: int | None = None, epoch: int = 1, sensors: int = SENSORS
    ) -> ImuPacket:
        rng = np.random.default_rng(sequence % 2**32)
        return ImuPacket(
            epoch=epoch,
            status=Status(0),
            sequence=sequence,
            clock_us=sequence * 1000 if clock_us is None else clock_us,
            answering=np.ones(sensors, dtype=bool),
            fresh=rng.random(sensors) < 0.3,
            counts=rng.integers(-32768, 32768, (sensors, 9), dtype=np.int16),
        )

    return make


@pytest.fixture(scope="session")
def about() -> Description:
    """The glove that speaks in most tests; the low byte of its epoch is 1."""
    return Description(
        protocol=1,
        epoch=0x0301,
        name="手袋",
        serial_number="42",
        firmware="1.0",
        side="left",
        sensors=(1, 11, 17),
        rate_hz=1000,
        max_rate_hz=1000,
        magnetometer_rate_hz=100,
        accelerometer_range_g=16.0,
        gyroscope_range_dps=2000.0,
        magnetometer_range_ut=4912.0,
    )


@pytest.fixture(scope="session")
def streamed(instant: Callable[..., ImuPacket]) -> Callable[[range], bytes]:
    """``streamed(range(...))``: the wire bytes of these instants."""
    return lambda sequences: b"".join(encode(instant(sequence)) for sequence in sequences)
