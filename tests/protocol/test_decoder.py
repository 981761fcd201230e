"""Bytes in any pieces, counters that wrap, restarts, and a memory that can be put away."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import EntryPoint, EntryPoints

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.errors import SetupError, TakeError
from handstudio.protocol import decoder as decoder_module
from handstudio.protocol.codec import encode
from handstudio.protocol.continuity import PATIENCE
from handstudio.protocol.contract import check_decoder, pieces
from handstudio.protocol.decoder import DECODERS, V1Decoder, decoder_named
from handstudio.protocol.framing import frame
from handstudio.protocol.packets import (
    Corruption,
    Description,
    ForeignVersion,
    Health,
    ImuPacket,
    Missing,
    Packet,
    Reason,
    Reply,
    Restart,
    Temperature,
)

Instant = Callable[..., ImuPacket]
WRAP = 2**32


def decoded(*packets: Packet) -> list[Packet]:
    return V1Decoder().feed(b"".join(map(encode, packets)))


@pytest.fixture
def session(about: Description, instant: Instant) -> tuple[Packet, ...]:
    """What a device says within a few instants: one packet of every kind and a wrap of both."""
    return (
        about,
        Reply(0x81, 1, 0, ""),
        *(instant(WRAP + k, clock_us=WRAP + 1000 * k) for k in range(-2, 2)),
        Temperature(WRAP + 1500, np.array([30.0, np.nan, 31.25])),
        Health(WRAP + 1900, 2, 0, 5000, (0, 1, 2)),
        instant(WRAP + 2, clock_us=WRAP + 2000),
    )


def test_one_decoder_for_all_that_a_device_says(session: tuple[Packet, ...]) -> None:
    first = next(packet for packet in session if isinstance(packet, ImuPacket))
    offset = first.sequence - first.sequence % WRAP
    read = decoded(*session)
    assert len(read) == len(session)
    assert read == [
        replace(packet, clock_us=packet.clock_us - offset)
        if isinstance(packet, Temperature | Health)
        else packet
        for packet in session
    ]


def test_the_laws_of_a_decoder_hold(session: tuple[Packet, ...]) -> None:
    stream = b"".join(map(encode, session))
    assert check_decoder(V1Decoder, stream) == decoded(*session)


def test_a_decoder_that_breaks_a_law_is_found(session: tuple[Packet, ...]) -> None:
    stream = b"".join(map(encode, session))
    for broken, law in (
        (type("Forgetful", (V1Decoder,), {"feed": _forgetful}), "other pieces"),
        (type("Unsaved", (V1Decoder,), {"restore": classmethod(_fresh)}), "save and restore"),
        (type("Repeating", (V1Decoder,), {"feed": _repeating}), "not after the one before"),
    ):
        with pytest.raises(AssertionError, match=law):
            check_decoder(broken, stream)


def _forgetful(self: V1Decoder, chunk: bytes) -> list[Packet]:
    return V1Decoder().feed(chunk)


def _fresh(kind: type[V1Decoder], saved: bytes) -> V1Decoder:
    del saved
    return kind()


def _repeating(self: V1Decoder, chunk: bytes) -> list[Packet]:
    packets = V1Decoder.feed(self, chunk)
    return [packet for packet in packets for _ in range(2)]


def test_single_bytes_give_the_same_packets(session: tuple[Packet, ...]) -> None:
    decoder = V1Decoder()
    stream = b"".join(map(encode, session))
    assert [p for byte in stream for p in decoder.feed(bytes((byte,)))] == decoded(*session)


@given(st.binary(max_size=3000), st.integers(0))
def test_noise_in_any_pieces_gives_the_same_packets(noise: bytes, seed: int) -> None:
    decoder = V1Decoder()
    cut = [p for piece in pieces(noise, random.Random(seed)) for p in decoder.feed(piece)]
    assert cut == V1Decoder().feed(noise)


def test_save_and_restore_between_any_two_bytes_change_nothing(
    session: tuple[Packet, ...], instant: Instant
) -> None:
    odd = instant(5), instant(1, epoch=2), instant(1, epoch=2)
    stream = b"".join(map(encode, (*session, *odd))) + bytes(9) + b"\1" * 2500 + b"\0junk\0"
    decoder = V1Decoder()
    seen: list[Packet] = []
    for byte in stream:
        saved = decoder.save()
        decoder = V1Decoder.restore(saved)
        assert decoder.save() == saved
        seen += decoder.feed(bytes((byte,)))
    assert seen == V1Decoder().feed(stream)
    assert {type(packet) for packet in seen} >= {ImuPacket, Restart, Corruption, Health}


@pytest.mark.parametrize(
    "saved",
    [
        b"",
        b"\xff\xfe",
        b"null",
        b"[" * 100_000,
        b"{}",
        b'{"decoder":"lines"}',
        b'{"decoder":' + b"[" * 200_000,
        b'{"decoder":"handstudio-1","layout":2,"framing":{},"continuity":{}}',
        b'{"decoder":"handstudio-1","layout":1,"framing":{"pending":7},"continuity":{}}',
        b'{"decoder":"handstudio-1","layout":1,"framing":{},"continuity":{"last":{"sequence":1}}}',
        b'{"decoder":"handstudio-1","layout":1,"framing":{},"continuity":{},"surprise":1}',
    ],
)
def test_what_was_not_saved_is_not_restored(saved: bytes) -> None:
    with pytest.raises(TakeError, match="decoder"):
        V1Decoder.restore(saved)


@given(st.data())
def test_a_damaged_state_is_refused_or_harmless(data: st.DataObject) -> None:
    saved = bytearray(V1Decoder().save())
    saved[data.draw(st.integers(0, len(saved) - 1))] = data.draw(st.integers(0, 255))
    try:
        decoder = V1Decoder.restore(bytes(saved))
    except TakeError:
        return
    decoder.feed(bytes(range(256)))


def test_sequence_and_clock_unwrap_over_many_wraps(instant: Instant) -> None:
    truth = [
        instant(k * 2**30 + 1, clock_us=k * 2**30 + 7, epoch=1) for k in range(20)
    ]  # five times around
    read = decoded(*truth)
    assert [p for p in read if isinstance(p, ImuPacket)] == truth
    assert {p.count for p in read if isinstance(p, Missing)} == {2**30 - 1}


def test_a_missing_packet_is_counted(instant: Instant) -> None:
    read = decoded(instant(10), instant(11), instant(14))
    assert read == [instant(10), instant(11), Missing(2), instant(14)]


def test_the_first_packet_of_a_connection_misses_nothing(instant: Instant) -> None:
    assert decoded(instant(123456)) == [instant(123456)]


def test_another_epoch_is_a_restart_and_unwraps_anew(instant: Instant) -> None:
    before = instant(WRAP - 1), instant(WRAP)
    after = instant(5, epoch=2), instant(6, epoch=2)
    assert decoded(*before, *after)[2:] == [Restart(2), *after]


def test_a_description_tells_a_restart_that_imu_packets_cannot(
    about: Description, instant: Instant
) -> None:
    again = replace(about, epoch=about.epoch + 256)  # the same low byte
    read = decoded(about, instant(500), again, instant(1))
    assert read == [about, instant(500), Restart(1), again, instant(1)]


def test_a_description_before_the_first_packet_of_its_epoch_restarts_once(
    about: Description, instant: Instant
) -> None:
    again = replace(about, epoch=about.epoch + 1)
    read = decoded(about, instant(500), again, instant(1, epoch=2), again)
    assert read == [about, instant(500), Restart(2), again, instant(1, epoch=2), again]


def test_a_lost_description_restarts_once(about: Description, instant: Instant) -> None:
    again = replace(about, epoch=about.epoch + 1)
    read = decoded(about, instant(500), instant(1, epoch=2), again, instant(2, epoch=2))
    restarted = [Restart(2), instant(1, epoch=2), again, instant(2, epoch=2)]
    assert read == [about, instant(500), *restarted]


def test_a_packet_not_after_the_last_is_out_of_order(instant: Instant) -> None:
    read = decoded(instant(7), instant(7), instant(6), instant(8))
    sizes = [len(encode(instant(sequence))) for sequence in (7, 6)]
    late = [Corruption(Reason.OUT_OF_ORDER, size) for size in sizes]
    assert read == [instant(7), *late, instant(8)]


@pytest.mark.parametrize(("sequence", "clock_us"), [(7, 8000), (6, 8000), (8, 7000), (8, 6999)])
def test_both_sequence_and_clock_must_rise(instant: Instant, sequence: int, clock_us: int) -> None:
    late = instant(sequence, clock_us=clock_us)
    assert decoded(instant(7), late)[1:] == [Corruption(Reason.OUT_OF_ORDER, len(encode(late)))]


def test_only_packets_out_of_order_in_a_row_are_believed(instant: Instant) -> None:
    strays = [instant(k) for k in range(1, PATIENCE)]
    read = decoded(instant(500), *strays, instant(501), *strays, instant(502))
    assert [p for p in read if not isinstance(p, Corruption)] == [
        instant(500),
        instant(501),
        instant(502),
    ]
    read = decoded(instant(500), *strays, instant(PATIENCE), instant(PATIENCE + 1))
    assert read[-3:] == [Restart(1), instant(PATIENCE), instant(PATIENCE + 1)]


def test_a_clock_that_jumps_back_once_costs_that_packet(instant: Instant) -> None:
    read = decoded(instant(7), instant(8, clock_us=3), instant(9))
    assert [type(p) for p in read] == [ImuPacket, Corruption, Missing, ImuPacket]
    assert read[-2:] == [Missing(1), instant(9)]


@pytest.mark.parametrize("jump", [-(2**31) + 5000, -1_000_000, 1 << 30, (1 << 31) - 5000])
def test_a_clock_that_jumps_and_stays_costs_a_hundred_packets_at_most(
    instant: Instant, jump: int
) -> None:
    moved = [instant(k, clock_us=(k * 1000 + jump) % WRAP) for k in range(2001, 2301)]
    read = decoded(*map(instant, range(1990, 2001)), *moved)
    came = [p for p in read if isinstance(p, ImuPacket)]
    assert len(came) >= 11 + 300 - (PATIENCE - 1)
    assert came[-1].sequence == 2300
    assert sum(isinstance(p, Restart) for p in read) == (jump < 0)


def test_one_absurd_clock_or_sequence_is_survived(instant: Instant) -> None:
    for mad in (instant(101, clock_us=2**31), instant(2**31 - 7, clock_us=100_500)):
        read = decoded(instant(100), mad, *map(instant, range(102, 402)))
        came = [p for p in read if isinstance(p, ImuPacket)]
        assert came[-1] == instant(401)
        assert len(came) >= 300 - PATIENCE


def test_a_long_rest_is_bridged_by_the_clock_of_health(instant: Instant) -> None:
    """Two hours between STOP and START: more than the clock's wrap."""
    minutes = [Health(k * 60_000_000, 10, 0, 0, (0, 0, 0)) for k in range(1, 120)]
    last = instant(11, clock_us=7_200_000_000)
    assert decoded(instant(10), *minutes, last) == [instant(10), *minutes, last]


def test_a_health_built_before_an_instant_and_sent_after_it_keeps_its_time(
    instant: Instant,
) -> None:
    packets = instant(1, clock_us=WRAP - 500), instant(2, clock_us=WRAP + 500)
    health = Health(WRAP - 10, 2, 0, 0, (0, 0, 0))
    assert decoded(*packets, health) == [*packets, health]


def test_a_packet_of_more_sensors_than_described_is_refused(
    about: Description, instant: Instant
) -> None:
    wrong = instant(2, sensors=4), Temperature(0, np.zeros(2)), Health(0, 0, 0, 0, (1,))
    read = decoded(about, instant(1), *wrong, instant(2))
    refused = [Corruption(Reason.CONTENT, len(encode(packet))) for packet in wrong]
    assert read == [about, instant(1), *refused, instant(2)]


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"\x06", Reason.UNKNOWN_TYPE),
        (b"\x05\x80\x01\x00", Reason.LENGTH),
        (b"\x05\x80\x01\x00\x01\xff", Reason.CONTENT),
    ],
)
def test_a_good_frame_of_a_bad_packet_is_told_from_the_very_first(
    payload: bytes, reason: Reason
) -> None:
    wire = frame(payload)
    assert V1Decoder().feed(wire + wire) == [Corruption(reason, len(wire))] * 2


def test_another_version_is_named_and_nothing_else_of_its_frame(instant: Instant) -> None:
    foreign = frame(b"\x01\x02" + bytes(range(40)))
    decoder = V1Decoder()
    decoder.feed(encode(instant(1)))
    assert decoder.feed(foreign) == [ForeignVersion(2)]
    assert decoder.feed(encode(instant(2))) == [instant(2)]


def test_decoders_are_found_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    offered = EntryPoints(
        [
            EntryPoint("theirs", "handstudio.protocol.decoder:Theirs", "handstudio.decoders"),
            EntryPoint("broken", "nowhere.to.be.found:Decoder", "handstudio.decoders"),
            EntryPoint("v1", "handstudio.protocol.decoder:V1Decoder", "handstudio.decoders"),
        ]
    )
    monkeypatch.setattr(decoder_module, "entry_points", lambda group: offered.select(group=group))
    assert decoder_named("handstudio-1") is V1Decoder is DECODERS["handstudio-1"]
    assert decoder_named("v1") is V1Decoder
    with pytest.raises(SetupError, match=r"broken.*nowhere"):
        decoder_named("broken")
    with pytest.raises(SetupError, match=r"theirs.*Theirs"):
        decoder_named("theirs")
    with pytest.raises(SetupError, match="known are broken, handstudio-1, theirs, v1"):
        decoder_named("unheard-of")


def test_a_saved_state_says_whose_it_is() -> None:
    assert msgspec.json.decode(V1Decoder().save())["decoder"] in DECODERS
