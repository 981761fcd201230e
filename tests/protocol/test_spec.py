"""The examples in README.md are what the code writes and reads, byte by byte."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from fastcrc import crc32

import handstudio.protocol
from handstudio.protocol import commands
from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import CommandDecoder, V1Decoder
from handstudio.protocol.framing import frame
from handstudio.protocol.packets import (
    Command,
    Corruption,
    Description,
    ForeignVersion,
    Health,
    ImuPacket,
    Packet,
    Reason,
    Reply,
    Request,
    Result,
    Status,
    Temperature,
)

TEXT = (Path(handstudio.protocol.__file__).parent / "README.md").read_text(encoding="utf-8")

PACKETS: dict[str, Packet] = {
    "description": Description(
        protocol=1,
        epoch=0xA107,
        name="Glove",
        serial_number="G-0042",
        firmware="1.2.0",
        side="right",
        sensors=(16, 17),
        rate_hz=100,
        max_rate_hz=1000,
        magnetometer_rate_hz=100,
        accelerometer_range_g=16.0,
        gyroscope_range_dps=2000.0,
        magnetometer_range_ut=4912.0,
    ),
    "imu": ImuPacket(
        epoch=7,
        status=Status.DROPPED | Status.BUTTON,
        sequence=258,
        clock_us=2_580_000,
        answering=np.array([True, True]),
        fresh=np.array([True, False]),
        counts=np.array(
            [
                [12, -3, 2051, 1, -2, 0, 150, -40, -310],
                [-700, 15, 1925, 32767, -32768, 5, 148, -44, -305],
            ],
            dtype=np.int16,
        ),
    ),
    "temperature": Temperature(2_600_000, np.array([31.5, np.nan])),
    "health": Health(3_000_000, 257, 2, 5010, (0, 3)),
    "reply": Reply(Command.SET_RATE, 3, Result.BAD_ARGUMENT, "rate 1001"),
}
REQUESTS: dict[str, Request] = {
    "describe": Request(Command.DESCRIBE, 1),
    "start": Request(Command.START, 2),
    "stop": Request(Command.STOP, 255),
    "set_rate": commands.set_rate(3, 1001),
    "blink": commands.blink(4, 17, 500),
    "own": Request(0xC0, 5, b"fist"),
}


def examples() -> dict[str, dict[str, bytes]]:
    """Bytes under their heading (payload, crc, wire), of every example by name."""
    return {
        name: _sections(body)
        for name, body in re.findall(r"^```hex name=(\w+)\n(.*?)^```$", TEXT, re.M | re.S)
    }


def _sections(body: str) -> dict[str, bytes]:
    sections: dict[str, bytes] = {}
    heading = ""
    for line in body.splitlines():
        words = line.partition("#")[0].split()
        if not line.startswith(" "):
            heading = words.pop(0)
        sections[heading] = sections.get(heading, b"") + bytes.fromhex("".join(words))
    return sections


def test_every_example_is_checked_here() -> None:
    assert set(examples()) == {*PACKETS, *REQUESTS, "damaged", "foreign"}
    assert set(PACKETS) == {"description", "imu", "temperature", "health", "reply"}
    assert {request.command for request in REQUESTS.values()} >= set(Command)


@pytest.mark.parametrize("name", [*PACKETS, *REQUESTS, "foreign"])
def test_an_example_is_its_payload_with_crc_framed(name: str) -> None:
    example = examples()[name]
    assert example["crc"] == crc32.iso_hdlc(example["payload"]).to_bytes(4, "little")
    assert example["wire"] == frame(example["payload"])


@pytest.mark.parametrize("name", PACKETS)
def test_an_example_of_a_packet_is_written_and_read(name: str) -> None:
    wire = examples()[name]["wire"]
    assert encode(PACKETS[name]) == wire
    assert V1Decoder().feed(wire) == [PACKETS[name]]


@pytest.mark.parametrize("name", REQUESTS)
def test_an_example_of_a_command_is_written_and_read(name: str) -> None:
    wire = examples()[name]["wire"]
    assert encode(REQUESTS[name]) == wire
    assert CommandDecoder().feed(wire) == [REQUESTS[name]]


def test_the_damaged_example_is_found_damaged() -> None:
    damaged, whole = examples()["damaged"]["wire"], examples()["imu"]["wire"]
    assert sum(a != b for a, b in zip(damaged, whole, strict=True)) == 1
    assert V1Decoder().feed(b"\0" + damaged) == [Corruption(Reason.CHECKSUM, len(damaged))]


def test_the_example_of_another_version_is_known_as_such() -> None:
    assert V1Decoder().feed(examples()["foreign"]["wire"]) == [ForeignVersion(2)]


def test_the_checksum_has_the_check_value_the_page_names() -> None:
    assert crc32.iso_hdlc(b"123456789") == 0xCBF43926
    assert "0xCBF43926" in TEXT


def test_the_bandwidth_table_adds_up() -> None:
    rows = re.findall(
        r"^\| (\d+) \| (\d+) Hz \| (\d+) \| (\d+) \| ([\d.]+) kB/s \| (\d+) % \| (\d+) %",
        TEXT,
        re.M,
    )
    assert ("20", "1000") in {row[:2] for row in rows}
    assert ("20", "100") in {row[:2] for row in rows}
    for sensors, rate, payload, longest, per_second, of_usb, of_uart in rows:
        n, hz = int(sensors), int(rate)
        ones = np.ones((n, 9), dtype=np.int16)
        packet = ImuPacket(1, Status(0x0101), -1, -1, ones[:, 0] > 0, ones[:, 0] > 0, ones * -1)
        # Without a zero in it a frame is as long as it gets; only the padding bits may be zero.
        assert len(encode(packet)) == int(longest)
        assert int(payload) == 13 + 2 * -(-n // 8) + 18 * n
        assert float(per_second) == pytest.approx(int(longest) * hz / 1000, abs=0.05)
        assert int(of_usb) == round(int(longest) * hz / 1_216_000 * 100)
        assert int(of_uart) == round(int(longest) * hz / 92_160 * 100)
