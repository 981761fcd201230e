"""Bytes of a device to events: in any pieces, put away and resumed, over restarts."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.errors import HandstudioError
from handstudio.protocol.codec import encode
from handstudio.protocol.contract import pieces
from handstudio.protocol.decoder import V1Decoder
from handstudio.protocol.packets import Description, ImuPacket, Status
from handstudio.samples import Event, Gap, ImuSamples, Ranges, Why, from_packets
from handstudio.stream import EventStream

MS = 1_000_000  # [ns]
ABOUT = Description(
    protocol=1,
    epoch=1,
    name="a glove",
    serial_number="1",
    firmware="1",
    side="right",
    sensors=(1, 11),
    rate_hz=100,
    max_rate_hz=1000,
    magnetometer_rate_hz=100,
    accelerometer_range_g=16.0,
    gyroscope_range_dps=2000.0,
    magnetometer_range_ut=4912.0,
)
RANGES = Ranges.of(ABOUT)


def instant(sequence: int, epoch: int = 1) -> bytes:
    counts = np.random.default_rng(sequence).integers(-999, 999, (2, 9)).astype(np.int16)
    flags = np.ones(2, dtype=bool)
    return encode(ImuPacket(epoch, Status(0), sequence, 10_000 * sequence, flags, flags, counts))


def instants(sequences: range, epoch: int = 1) -> bytes:
    return b"".join(instant(sequence, epoch) for sequence in sequences)


# three instants are lost, one frame is damaged, and the device begins anew
EVENTFUL = b"".join(
    (
        encode(ABOUT),
        instants(range(20)),
        instants(range(23, 40)),
        instant(40)[:-5] + b"\0",
        instants(range(41, 50)),
        instants(range(2, 12), epoch=2),
    )
)


def fresh() -> EventStream:
    return EventStream("handstudio-1", RANGES)


def joined(events: list[Event]) -> list[Event]:
    """Runs that nothing interrupts as one: how a stream was cut shows nowhere else."""
    out: list[Event] = []
    for event in events:
        if isinstance(event, ImuSamples) and out and isinstance(out[-1], ImuSamples):
            names = ImuSamples.__slots__
            both = [[getattr(part, name) for part in (out[-1], event)] for name in names]
            out[-1] = ImuSamples(*map(np.concatenate, both))
        else:
            out.append(event)
    return out


def test_events_are_those_of_the_decoders_packets():
    packets, events = fresh().feed(EVENTFUL, 0)
    assert packets == V1Decoder().feed(EVENTFUL)
    assert events == from_packets(packets, RANGES)
    kinds = [event.why if isinstance(event, Gap) else len(event) for event in events]
    assert kinds == [20, Why.LOST, 17, Why.LOST, 9, Why.RESTART, 10]


@given(st.integers(0))
def test_cutting_the_bytes_changes_no_event(seed):
    stream = fresh()
    cut = [e for piece in pieces(EVENTFUL, random.Random(seed)) for e in stream.feed(piece, 7)[1]]
    assert joined(cut) == joined(fresh().feed(EVENTFUL, 7)[1])


@given(st.integers(0), st.integers(1, 9))
def test_chunks_taken_together_tell_what_they_tell_one_by_one(seed, together):
    away = encode(replace(ABOUT, epoch=3)) + encode(ABOUT)[:3] + b"\0"
    said = EVENTFUL + away + instants(range(5), epoch=3)
    chunks = [(k * k * MS, piece) for k, piece in enumerate(pieces(said, random.Random(seed)))]
    one, all_ = fresh(), fresh()
    single = [event for at, chunk in chunks for event in one.feed(chunk, at)[1]]
    groups = [chunks[k : k + together] for k in range(0, len(chunks), together)]
    assert joined([e for group in groups for e in all_.feed_all(group)]) == joined(single)
    assert all_.save() == one.save()


def test_saving_and_resuming_between_any_two_bytes_changes_no_event():
    stream = fresh()
    seen: list[Event] = []
    for k, byte in enumerate(EVENTFUL):
        saved = stream.save()
        stream = EventStream.resumed("handstudio-1", RANGES, saved)
        assert stream.save() == saved
        seen += stream.feed(bytes((byte,)), k * MS)[1]
    whole = fresh()
    expected = [e for k, b in enumerate(EVENTFUL) for e in whole.feed(bytes((b,)), k * MS)[1]]
    assert seen == expected
    assert Why.RESTART in [event.why for event in seen if isinstance(event, Gap)]


def test_a_restart_tells_the_host_time_between_the_instants_around_it():
    stream = fresh()
    stream.feed(instants(range(5)), 1000 * MS)
    events = stream.feed(instants(range(3), epoch=2), 4250 * MS)[1]
    assert events[0] == Gap(Why.RESTART, 0, 3_250_000)


def test_a_device_that_says_it_began_anew_and_then_is_silent_was_away_until_its_next_instant():
    stream = fresh()
    stream.feed(encode(ABOUT) + instants(range(5)), 1000 * MS)
    packets, events = stream.feed(encode(replace(ABOUT, epoch=2)), 1500 * MS)
    assert len(packets) == 2
    assert events == []  # nobody knows yet for how long it stays away
    events = stream.feed(instants(range(3), epoch=2), 4000 * MS)[1]
    assert events[0] == Gap(Why.RESTART, 0, 3_000_000)
    assert [len(event) for event in events[1:]] == [3]


def test_a_restart_within_one_piece_took_no_time_the_host_could_see():
    stream = fresh()
    stream.feed(instants(range(5)), 1000 * MS)
    whole = instants(range(5, 8)) + instants(range(3), epoch=2)
    events = stream.feed(whole, 1400 * MS)[1]
    assert events[1] == Gap(Why.RESTART, 0, 0)


def test_two_restarts_with_nothing_between_are_one():
    stream = fresh()
    stream.feed(encode(ABOUT) + instants(range(5)), 1000 * MS)
    stream.feed(encode(replace(ABOUT, epoch=2)), 1500 * MS)
    stream.feed(encode(replace(ABOUT, epoch=3)), 1700 * MS)
    events = stream.feed(instants(range(3), epoch=3), 2000 * MS)[1]
    assert [event for event in events if isinstance(event, Gap)] == [Gap(Why.RESTART, 0, 1_000_000)]


def test_before_a_device_described_itself_there_are_packets_but_no_events():
    stream = EventStream("handstudio-1", None)
    packets, events = stream.feed(instants(range(3)), 0)
    assert len(packets) == 3
    assert events == []
    stream.ranges = RANGES
    assert len(stream.feed(instants(range(3, 6)), MS)[1][0]) == 3


@pytest.mark.parametrize("saved", [b"", b"\xc1", b"\x80", fresh().save()[:-1], b"\x82\xa7decoder"])
def test_a_state_that_cannot_be_read_says_how_to_go_on(saved):
    with pytest.raises(HandstudioError, match="from"):
        EventStream.resumed("handstudio-1", RANGES, saved)
