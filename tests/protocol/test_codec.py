"""Every packet survives the wire; every other payload is refused with its reason."""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from handstudio.protocol.codec import Sent, encode, parse, parse_request
from handstudio.protocol.framing import MAX_FRAME, Frame, Framing, frame, unframe
from handstudio.protocol.packets import (
    Corruption,
    Description,
    ForeignVersion,
    Health,
    ImuPacket,
    Reason,
    Reply,
    Request,
    Status,
    Temperature,
)

# The shape checker looks at an item of a tuple picked at random, also while examples are made.
pytestmark = pytest.mark.filterwarnings("ignore:Do not use the `random` module")

U8, U16, U32 = (st.integers(0, 2**bits - 1) for bits in (8, 16, 32))
COUNTS = st.integers(1, 32)
TEXTS = st.text(st.characters(codec="utf-8"), max_size=63)
RANGES = st.floats(0, width=32, exclude_min=True, allow_infinity=False, allow_nan=False)


@st.composite
def descriptions(draw: st.DrawFn) -> Description:
    rate, max_rate = sorted(draw(st.tuples(st.integers(1, 65535), st.integers(1, 65535))))
    return Description(
        protocol=1,
        epoch=draw(U32),
        name=draw(TEXTS),
        serial_number=draw(TEXTS),
        firmware=draw(TEXTS),
        side=draw(st.sampled_from(["left", "right", "unknown"])),
        sensors=tuple(draw(st.lists(st.integers(1, 255), min_size=1, max_size=32, unique=True))),
        rate_hz=rate,
        max_rate_hz=max_rate,
        magnetometer_rate_hz=draw(U16),
        accelerometer_range_g=draw(RANGES),
        gyroscope_range_dps=draw(RANGES),
        magnetometer_range_ut=draw(st.just(0.0) | RANGES),
    )


@st.composite
def instants(draw: st.DrawFn) -> ImuPacket:
    n = draw(COUNTS)
    return ImuPacket(
        epoch=draw(U8),
        status=Status(draw(U16)),
        sequence=draw(U32),
        clock_us=draw(U32),
        answering=draw(arrays(np.bool_, n)),
        fresh=draw(arrays(np.bool_, n)),
        counts=draw(arrays(np.int16, (n, 9))),
    )


@st.composite
def temperatures(draw: st.DrawFn) -> Temperature:
    centi = draw(arrays(np.float64, draw(COUNTS), elements=st.integers(-32767, 32767)))
    unknown = draw(arrays(np.bool_, centi.shape))
    return Temperature(draw(U32), np.where(unknown, np.nan, centi / 100))


HEALTHS = st.builds(Health, U32, U32, U32, U16, st.lists(U16, min_size=1, max_size=32).map(tuple))
REPLIES = st.builds(Reply, U8, U8, U8, TEXTS)
SENT = descriptions() | instants() | temperatures() | HEALTHS | REPLIES


def payload_of(wire: bytes) -> bytes:
    _, (found,) = unframe(Framing(), wire)
    assert isinstance(found, Frame)
    assert found.size == len(wire)
    return found.payload


@given(SENT)
def test_what_is_sent_is_what_is_read(packet: Sent) -> None:
    wire = encode(packet)
    assert parse(payload_of(wire)) == packet
    assert wire.index(b"\0") == len(wire) - 1
    assert len(wire) <= MAX_FRAME


@given(st.integers(0x80, 0xFF), U8, st.binary(max_size=255))
def test_a_command_sent_is_the_command_read(command: int, tag: int, argument: bytes) -> None:
    request = Request(command, tag, argument)
    assert parse_request(payload_of(encode(request))) == request


@given(SENT, st.integers(-(2**40), 2**40), st.integers(-(2**40), 2**40))
def test_counters_of_any_size_wrap_to_32_bits(packet: Sent, sequence: int, clock: int) -> None:
    if isinstance(packet, ImuPacket):
        read = parse(payload_of(encode(replace(packet, sequence=sequence, clock_us=clock))))
        assert read == replace(packet, sequence=sequence % 2**32, clock_us=clock % 2**32)


def test_the_totals_of_health_wrap_to_32_bits() -> None:
    health = Health(1, 2**32 + 2, 2**33 + 3, 5000, (0,))
    assert parse(payload_of(encode(health))) == Health(1, 2, 3, 5000, (0,))


@given(SENT, st.data())
def test_a_shorter_or_longer_payload_is_refused_for_its_length(
    packet: Sent, data: st.DataObject
) -> None:
    payload = payload_of(encode(packet))
    short = payload[: data.draw(st.integers(1, len(payload) - 1))]
    assert parse(short) is Reason.LENGTH
    assert parse(payload + data.draw(st.binary(min_size=1, max_size=9))) is Reason.LENGTH


@given(
    st.binary(max_size=300)
    | st.builds(
        bytes.__add__,
        st.sampled_from([bytes((kind,)) for kind in range(6)] + [b"\x01\x01"]),
        st.binary(max_size=60),
    )
)
def test_any_payload_is_refused_or_canonical(payload: bytes) -> None:
    read = parse(payload)
    if not isinstance(read, Reason | ForeignVersion):
        assert payload_of(encode(read)) == payload
    request = parse_request(payload)
    if isinstance(request, Request):
        assert payload_of(encode(request)) == payload


@pytest.mark.parametrize("sensors", [0, 33, 255])
def test_no_packet_has_no_sensors_or_more_than_32(sensors: int) -> None:
    n = sensors
    bits = bytes(2 * ((n + 7) // 8))
    for payload in (
        struct.pack("<BBHIIB", 2, 0, 0, 0, 0, n) + bits + bytes(18 * n),
        struct.pack("<BIB", 3, 0, n) + bytes(2 * n),
        struct.pack("<BIIIHB", 4, 0, 0, 0, 0, n) + bytes(2 * n),
        struct.pack("<BBIBB", 1, 1, 0, 0, n) + bytes(range(1, n + 1)) + bytes(21),
    ):
        assert parse(payload) is Reason.CONTENT


@pytest.mark.parametrize(
    ("changes", "at", "byte"),
    [
        ("side", 6, 3),
        ("no such sensor", 8, 0),
        ("a sensor twice", 8, 11),
        ("a rate above the highest", 12, 0xFF),
        ("a range of NaN", 20, 0xFF),
        ("a text that is not UTF-8", 30, 0xFF),
    ],
)
def test_a_description_that_cannot_be_is_refused(
    about: Description, changes: str, at: int, byte: int
) -> None:
    payload = bytearray(payload_of(encode(about)))
    payload[at] = byte
    if at == 20:
        payload[19] = 0xFF
    assert parse(bytes(payload)) is Reason.CONTENT, changes


def test_bits_beyond_the_sensors_are_refused(instant: Any) -> None:
    payload = bytearray(payload_of(encode(instant(1, sensors=20))))
    payload[13 + 2] |= 0x10
    assert parse(bytes(payload)) is Reason.CONTENT


def test_unknown_kinds_are_told_from_damage() -> None:
    assert parse(b"\x06abc") is Reason.UNKNOWN_TYPE
    assert parse(b"\x80\x01") is Reason.UNKNOWN_TYPE
    assert parse_request(b"\x02\x01") is Reason.UNKNOWN_TYPE
    assert parse_request(b"\x80") is Reason.LENGTH
    assert parse_request(bytes((0x80, 0)) + bytes(256)) is Reason.LENGTH
    assert parse(b"") is Reason.LENGTH
    assert parse_request(b"") is Reason.LENGTH


@pytest.mark.parametrize("body", [b"", b"\x00", b"anything at all"])
def test_of_another_version_only_the_first_two_bytes_are_read(body: bytes) -> None:
    assert parse(b"\x01\x02" + body) == ForeignVersion(2)


def test_what_does_not_fit_the_wire_is_not_sent(about: Description) -> None:
    for changes in (
        {"protocol": 2},
        {"epoch": -1},
        {"name": "x" * 256},
        {"sensors": ()},
        {"sensors": (1, 1)},
        {"sensors": tuple(range(1, 34))},
        {"rate_hz": 0},
        {"gyroscope_range_dps": 0.0},
        {"magnetometer_range_ut": float("nan")},
        {"accelerometer_range_g": 1e300},
        {"accelerometer_range_g": float("inf")},
        {"magnetometer_range_ut": -1.0},
    ):
        with pytest.raises(ValueError, match=r"\w"):
            encode(replace(about, **changes))
    for packet in (
        Health(0, 0, 0, 70_000, (0,)),
        Health(0, 0, 0, 0, (65_536,)),
        Temperature(0, np.array([327.68])),
        Temperature(0, np.array([-327.68])),
        Temperature(0, np.array([np.inf])),
        Reply(0x80, 256, 0, ""),
        Request(0x7F, 0),
        Request(0x80, 0, bytes(256)),
    ):
        with pytest.raises(ValueError, match=r"\w"):
            encode(packet)


def test_no_payload_is_framed_that_no_reader_would_take() -> None:
    assert len(frame(bytes(range(1, 254)) * 4)) <= MAX_FRAME
    with pytest.raises(ValueError, match="does not fit a frame of 1024"):
        frame(bytes(1020))


@pytest.mark.parametrize("length", [*range(5), 249, 250, 251, 253, 254, 255, 504, 505])
@pytest.mark.parametrize("fill", [0, 1, 255])
def test_payloads_at_the_edges_of_cobs_blocks(length: int, fill: int) -> None:
    request = Request(0x80, fill, bytes((fill,)) * min(length, 255))
    assert parse_request(payload_of(encode(request))) == request


def test_a_frame_says_why_it_is_none() -> None:
    wire = encode(Request(0x80, 7))
    flipped = bytes((wire[0], wire[1] ^ 1)) + wire[2:]
    reasons = {
        flipped: Reason.CHECKSUM,
        b"\x05\x01\x00": Reason.FRAMING,
        b"\x03\x01\x02\x00": Reason.LENGTH,
    }
    for bytes_, reason in reasons.items():
        _, found = unframe(Framing(synchronised=True), bytes_)
        assert found == [Corruption(reason, len(bytes_))]
