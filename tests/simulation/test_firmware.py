"""The firmware as a host sees it: through its bytes, read by the decoder."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from handstudio.protocol.codec import encode
from handstudio.protocol.commands import blink, set_rate
from handstudio.protocol.decoder import V1Decoder
from handstudio.protocol.framing import frame
from handstudio.protocol.packets import (
    Command,
    Corruption,
    Description,
    Health,
    ImuPacket,
    Missing,
    Packet,
    Reply,
    Request,
    Result,
    Status,
    Temperature,
)
from handstudio.simulation.firmware import RATES_HZ, Firmware, Readings
from handstudio.simulation.glove import description

SECOND = 1_000_000
WRAP = 1 << 32


def clockwork(time_us: np.ndarray, _: int) -> Readings:
    """Sensors whose first count tells the milliseconds since START."""
    counts = np.zeros((len(time_us), 20, 9), dtype=np.int16)
    counts[:, 0, 0] = time_us // 1000 % 30_000
    flags = np.ones((len(time_us), 20), dtype=bool)
    return Readings(counts, flags, flags, np.full(20, 33.0))


@dataclass
class Bench:
    """A firmware, and a host that takes all it says unless told otherwise."""

    firmware: Firmware
    decoder: V1Decoder = field(default_factory=V1Decoder)
    now_us: int = 0

    def ask(self, request: Request) -> list[Packet]:
        self.firmware.receive(encode(request))
        return self.hear()

    def hear(self, most: int | None = None) -> list[Packet]:
        heard = self.firmware.outgoing[:most]
        self.firmware.taken(len(heard))
        return self.decoder.feed(heard) + ([] if most is not None else self.after(heard))

    def after(self, heard: bytes) -> list[Packet]:
        return self.hear() if heard and self.firmware.outgoing else []

    def run(self, seconds: float) -> list[Packet]:
        """Let time pass, hearing every packet as it comes."""
        until, heard = self.now_us + round(seconds * SECOND), []
        while self.firmware.next_due_us <= until:
            self.firmware.advance(self.firmware.next_due_us)
            heard += self.hear()
        self.deaf(until)
        return heard

    def deaf(self, until_us: int) -> None:
        """Let time pass without hearing."""
        self.now_us = until_us
        self.firmware.advance(until_us)


def bench(rate_hz: int = 100, tx_buffer: int = 4096) -> Bench:
    about = description("right", 3, rate_hz, 0x1234_5678, "Bench")
    return Bench(Firmware(about, clockwork, tx_buffer))


def started(rate_hz: int = 100, tx_buffer: int = 4096) -> Bench:
    glove = bench(rate_hz, tx_buffer)
    glove.hear()
    glove.ask(Request(Command.START, 1))
    return glove


def only(kind: type, packets: list[Packet]) -> list:
    return [packet for packet in packets if isinstance(packet, kind)]


def test_it_starts_silent_with_a_description():
    glove = bench()
    assert glove.firmware.outgoing[:1] == b"\0"
    (about,) = glove.hear()
    assert isinstance(about, Description)
    assert (about.epoch, about.rate_hz, about.serial_number) == (0x1234_5678, 100, "VG-3")
    assert {type(packet) for packet in glove.run(25.5)} == {Health, Temperature}


def test_health_comes_every_second_and_temperature_every_ten():
    heard = bench().run(25.5)
    assert [packet.clock_us for packet in only(Health, heard)] == [k * SECOND for k in range(1, 26)]
    assert [packet.clock_us // SECOND for packet in only(Temperature, heard)] == [0, 10, 20]


def test_between_start_and_stop_it_streams_at_its_rate():
    glove = started(rate_hz=200)
    first = only(ImuPacket, glove.run(1.0))
    assert [packet.clock_us for packet in first] == [k * 5000 for k in range(201)]
    assert [packet.sequence for packet in first] == list(range(201))
    assert [packet.counts[0, 0] for packet in first] == [k * 5 for k in range(201)]
    assert {packet.epoch for packet in first} == {0x78}
    assert {packet.status for packet in first} == {Status(0)}
    (reply,) = glove.ask(Request(Command.STOP, 9))
    assert reply == Reply(Command.STOP, 9, Result.OK, "")
    assert only(ImuPacket, glove.run(1.0)) == []


def test_start_begins_the_motion_anew_while_the_sequence_runs_on():
    glove = started()
    glove.run(0.5)
    glove.ask(Request(Command.STOP, 2))
    glove.run(2.0)
    glove.ask(Request(Command.START, 3))
    heard = glove.run(0.1)
    assert only(Missing, heard) == []
    again = only(ImuPacket, heard)[0]
    assert (again.sequence, again.clock_us, again.counts[0, 0]) == (51, 2_500_000, 0)


def test_start_twice_and_stop_twice_change_nothing():
    glove = started()
    glove.run(0.5)
    assert glove.ask(Request(Command.START, 2)) == [Reply(Command.START, 2, Result.OK, "")]
    assert only(ImuPacket, glove.run(0.1))[0].counts[0, 0] == 510
    for tag in (3, 4):
        assert glove.ask(Request(Command.STOP, tag)) == [Reply(Command.STOP, tag, Result.OK, "")]


def test_describe_is_answered_by_reply_then_description():
    glove = bench()
    glove.hear()
    reply, about = glove.ask(Request(Command.DESCRIBE, 200))
    assert reply == Reply(Command.DESCRIBE, 200, Result.OK, "")
    assert isinstance(about, Description)


def test_a_new_rate_is_described_and_kept_without_a_gap():
    glove = started(rate_hz=100)
    glove.run(0.105)
    reply, about = glove.ask(set_rate(7, 500))
    assert reply == Reply(Command.SET_RATE, 7, Result.OK, "")
    assert isinstance(about, Description)
    assert about.rate_hz == 500
    heard = glove.run(1.0)
    instants = only(ImuPacket, heard)
    assert only(Missing, heard) == []
    assert np.unique(np.diff([packet.clock_us for packet in instants])).tolist() == [2000]
    assert instants[0].clock_us == 107_000
    assert instants[0].counts[0, 0] == 107  # the motion goes on where it was


@pytest.mark.parametrize("rate_hz", [0, 49, 333, 1001, 65535])
def test_a_rate_it_cannot_keep_is_refused_with_those_it_can(rate_hz):
    glove = bench()
    glove.hear()
    (reply,) = glove.ask(set_rate(1, rate_hz))
    assert reply.result == Result.BAD_ARGUMENT
    assert "50 64 80 100" in reply.text


def test_the_rates_reach_from_50_to_1000():
    assert (RATES_HZ[0], RATES_HZ[-1]) == (50, 1000)
    assert {100, 200, 500} <= set(RATES_HZ)


def test_it_remembers_where_to_blink():
    glove = bench()
    glove.hear()
    assert glove.ask(blink(1, 17, 500)) == [Reply(Command.BLINK, 1, Result.OK, "")]
    assert glove.firmware.blinking == (17, 500)
    (refused,) = glove.ask(blink(2, 21, 500))
    assert refused.result == Result.BAD_ARGUMENT
    assert glove.firmware.blinking == (17, 500)


@pytest.mark.parametrize("command", [0x85, 0xC0, 0xFF])
def test_an_unknown_command_is_answered_so(command):
    glove = bench()
    glove.hear()
    assert glove.ask(Request(command, 5)) == [Reply(command, 5, Result.UNKNOWN_COMMAND, "")]


def test_an_argument_of_the_wrong_length_is_refused():
    glove = bench()
    glove.hear()
    for command in (Command.SET_RATE, Command.BLINK):
        (reply,) = glove.ask(Request(command, 5, b"\1"))
        assert reply.result == Result.BAD_ARGUMENT


def test_damaged_commands_are_not_answered_and_cost_nothing_else():
    glove = bench()
    glove.hear()
    whole = encode(Request(Command.START, 1))
    glove.firmware.receive(b"\0" + whole[:3] + b"\x55" + whole[4:] + frame(b"\x02nonsense"))
    assert glove.hear() == []
    for byte in whole:
        glove.firmware.receive(bytes([byte]))
    assert glove.hear() == [Reply(Command.START, 1, Result.OK, "")]


def test_what_does_not_fit_is_dropped_whole_counted_and_flagged():
    glove = started(rate_hz=1000)
    heard = glove.run(0.1)
    glove.deaf(500_000)
    assert len(glove.firmware.outgoing) <= 4096
    heard += glove.hear()
    heard += glove.run(2.0)
    assert only(Corruption, heard) == []
    missing = sum(packet.count for packet in only(Missing, heard))
    health = only(Health, heard)[-1]
    assert missing == health.dropped > 300
    instants = only(ImuPacket, heard)
    assert health.sent + health.dropped == health.clock_us // 1000 + 1  # the one at 0, too
    flagged = [k for k, packet in enumerate(instants) if packet.status & Status.DROPPED]
    jumps = 1 + np.flatnonzero(np.diff([packet.sequence for packet in instants]) > 1)
    assert flagged == jumps.tolist()
    assert len(flagged) == 1


def test_replies_and_descriptions_wait_for_room_before_everything_that_follows():
    glove = started(rate_hz=1000)
    glove.deaf(100_000)
    full = len(glove.firmware.outgoing)
    glove.firmware.receive(encode(Request(Command.DESCRIBE, 77)))
    glove.deaf(200_000)
    heard = glove.hear(most=full)
    heard += glove.run(0.05)
    kinds = [type(packet) for packet in heard if not isinstance(packet, Missing)]
    at = kinds.index(Reply)
    assert kinds[at : at + 3] == [Reply, Description, ImuPacket]
    later = only(ImuPacket, heard[at:])
    assert later[0].status & Status.DROPPED


def test_a_new_line_finds_it_silent_and_whole():
    glove = started(rate_hz=1000)
    glove.deaf(50_000)
    glove.firmware.receive(encode(Request(Command.STOP, 1))[:3])
    glove.firmware.plugged_in()
    glove.decoder = V1Decoder()
    assert glove.firmware.outgoing[:1] == b"\0"
    (about,) = glove.hear()
    assert isinstance(about, Description)
    assert only(ImuPacket, glove.run(1.0)) == []
    assert glove.ask(Request(Command.START, 2)) == [Reply(Command.START, 2, Result.OK, "")]


def test_its_clock_wraps_and_a_host_sees_it_run_on():
    glove = bench()
    glove.run(WRAP / SECOND - 0.5)
    glove.ask(Request(Command.START, 1))
    heard = glove.run(1.0)
    assert only(Corruption, heard) == []
    clocks = [packet.clock_us for packet in only(ImuPacket, heard)]
    assert np.unique(np.diff(clocks)).tolist() == [10_000]
    assert clocks[0] < WRAP <= clocks[-1]


def test_late_or_in_time_it_says_the_same():
    in_time, late = started(tx_buffer=1 << 20), started(tx_buffer=1 << 20)
    heard = in_time.run(3.0)
    late.deaf(3 * SECOND)
    assert list(map(repr, late.hear())) == list(map(repr, heard))
