"""Lines that lie, stammer, break or lead to somebody else."""

from __future__ import annotations

import socket
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from handstudio.device import capture as capture_module
from handstudio.device.capture import INTRODUCTION_S
from handstudio.device.orders import Connect, Phase, StopTake
from handstudio.errors import DeviceError, LayoutError
from handstudio.pipeline import Doubt
from handstudio.process import process
from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import CommandDecoder, V1Decoder
from handstudio.protocol.packets import (
    Command,
    Description,
    ImuPacket,
    Reply,
    Request,
    Result,
    Status,
)
from handstudio.simulation.glove import description

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

SLACK_S = 4.0  # of a busy machine


def failure(studio, address: str, within_s: float) -> DeviceError:
    studio.send(Connect(address))
    newest = studio.until(lambda newest: newest.phase is Phase.FAILED, "it failed", within_s)
    assert newest.problem is not None
    assert newest.recorder is None
    return newest.problem


# --- not one of ours ------------------------------------------------------------------------------


def test_a_port_that_says_anything_but_what_we_understand_is_refused(studio, port):
    rng = np.random.default_rng(1)
    far_end = port()
    far_end.keep_saying(lambda: rng.integers(0, 256, 500, dtype=np.uint8).tobytes())
    problem = failure(studio, far_end.address, INTRODUCTION_S + SLACK_S)
    assert isinstance(problem, DeviceError)
    assert f"{far_end.address} did not say that it is a glove" in problem.what
    assert "bytes came" in problem.what
    assert "another port" in problem.remedy


@pytest.fixture
def hurry(monkeypatch) -> None:
    monkeypatch.setattr(capture_module, "INTRODUCTION_S", 1.0)


def test_a_port_that_says_nothing_is_refused(studio, port, hurry):
    far_end = port()
    problem = failure(studio, far_end.address, INTRODUCTION_S + SLACK_S)
    assert isinstance(problem, DeviceError)
    assert "nothing came" in problem.what


def test_a_port_that_repeats_what_we_say_is_refused(studio, port, hurry):
    far_end = port()
    far_end.keep_saying(far_end.hear)
    problem = failure(studio, far_end.address, INTRODUCTION_S + SLACK_S)
    assert "did not say that it is a glove" in problem.what


def test_another_version_of_the_protocol_is_named(studio, port):
    foreign = bytes.fromhex("00 08 01 02 2A 71 18 0E 17 00")  # protocol/README.md
    far_end = port()
    far_end.keep_saying(lambda: foreign if far_end.hear() else b"")
    problem = failure(studio, far_end.address, INTRODUCTION_S)
    assert isinstance(problem, DeviceError)
    assert "version 2" in problem.what
    assert "Update" in problem.remedy


def test_a_socket_that_hangs_up_at_once_is_refused(studio):
    with socket.create_server(("127.0.0.1", 0)) as door:
        studio.send(Connect(f"tcp:127.0.0.1:{door.getsockname()[1]}"))
        door.accept()[0].close()
        newest = studio.until(lambda newest: newest.phase is Phase.FAILED, "it failed")
    assert "closed the line" in newest.problem.what


# --- a glove played by the test -------------------------------------------------------------------


class Played:
    """A small glove that says what the test wants it to."""

    def __init__(self, port, sensors: tuple[int, ...] = (15, 16, 17)) -> None:
        self.port = port
        self.told = replace(description("right", 0, 100, 1, "Played"), sensors=sensors)
        self.streams = self.describes = True
        self.address = port.address
        self._commands = CommandDecoder()
        self._sequence = 0
        self._rng = np.random.default_rng(2)
        port.keep_saying(self._say)

    def begin_anew(self, **changes: object) -> None:
        """Restart, maybe as something else."""
        self.told = replace(self.told, epoch=self.told.epoch + 1, **changes)
        self._sequence = 0

    def _say(self) -> bytes:
        said = b"\0"
        for request in self._commands.feed(self.port.hear()):
            assert isinstance(request, Request)
            said += encode(Reply(request.command, request.tag, Result.OK, ""))
            if request.command == Command.DESCRIBE and self.describes:
                said += encode(self.told)
        return said + (encode(self._instant()) if self.streams else b"")

    def _instant(self) -> ImuPacket:
        n = len(self.told.sensors)
        self._sequence += 1
        counts = self._rng.integers(-30, 30, (n, 9), dtype=np.int16)
        counts[:, 2] += 2048
        return ImuPacket(
            epoch=self.told.epoch & 0xFF,
            status=Status(0),
            sequence=self._sequence,
            clock_us=self._sequence * 10_000,
            answering=np.ones(n, dtype=bool),
            fresh=np.ones(n, dtype=bool),
            counts=counts,
        )


@pytest.fixture
def played(port) -> Iterator[Played]:
    one = Played(port())
    yield one
    one.port.unplug()


def test_a_sensor_that_no_hand_has_is_refused(studio, played):
    played.told = replace(played.told, sensors=(15, 16, 99))
    problem = failure(studio, played.address, INTRODUCTION_S)
    assert isinstance(problem, LayoutError)
    assert "SN99" in problem.what


def test_a_glove_that_streams_but_is_not_asked_who_it_is_is_asked(studio, played):
    newest = studio.connect(played.address)
    assert newest.description.sensors == (15, 16, 17)
    studio.start_take()
    studio.go_on(30)
    studio.check(studio.stop_take())


def test_a_glove_that_is_there_but_never_moves_is_said_to_be_so(studio, played, hurry):
    played.streams = False
    studio.send(Connect(played.address))
    newest = studio.until(lambda newest: newest.problem is not None, "the problem is shown")
    assert newest.phase is Phase.CONNECTING
    assert "VG-0 is there but sends no motion" in newest.problem.what
    assert newest.problem.remedy
    played.streams = True
    newest = studio.until(lambda newest: newest.phase is Phase.STREAMING, "it streams")
    assert newest.problem is None


def test_a_restart_without_a_word_is_followed_by_the_question_who_it_is(studio, played):
    studio.connect(played.address)
    studio.start_take()
    studio.go_on(30)
    played.begin_anew()
    studio.until(
        lambda newest: newest.description.epoch == played.told.epoch, "it described itself"
    )
    studio.go_on(30)
    motion = studio.check(studio.stop_take())
    assert studio.newest.health.restarts == 1
    assert len(motion) >= 60


def test_packets_of_other_sensors_than_described_stop_nothing(studio, played):
    """It restarts with a sensor less while a take is on, and its description is damaged."""
    studio.connect(played.address)
    studio.start_take()
    studio.go_on(30)
    played.describes = False
    played.begin_anew(sensors=(15, 16))
    studio.until(lambda newest: newest.phase is Phase.LOST, "nothing more of it is taken in")
    played.describes = True
    newest = studio.until(lambda newest: newest.problem is not None, "why the take waits")
    assert "other settings" in newest.problem.what
    played.begin_anew(sensors=(15, 16, 17))
    studio.until(lambda newest: newest.phase is Phase.STREAMING, "it goes on")
    studio.go_on(30)
    motion = studio.check(studio.stop_take())
    assert motion.q_world_sensor.shape[1] == 3


# --- damage ---------------------------------------------------------------------------------------


def damaging(seed: int, probability: float) -> tuple[Callable[[bytes], bytes], list[int]]:
    """Flips bits and drops bytes; counts both."""
    rng, done = np.random.default_rng(seed), [0]

    def damage(data: bytes) -> bytes:
        values = np.frombuffer(data, dtype=np.uint8).copy()
        flipped = rng.random(len(values)) < probability
        values[flipped] ^= np.uint8(1) << rng.integers(0, 8, int(flipped.sum()), dtype=np.uint8)
        dropped = rng.random(len(values)) < probability
        done[0] += int((flipped | dropped).sum())
        return values[~dropped].tobytes()

    return damage, done


@pytest.mark.parametrize("seed", [51, pytest.param(52, marks=pytest.mark.long)])
def test_flipped_and_dropped_bytes_cost_two_packets_each_and_no_digit(studio, glove, proxy, seed):
    damage, done = damaging(seed, 3e-5)
    studio.connect(proxy(glove("tcp", seed=seed, rate=1000).address, damage).address)
    studio.start_take()
    before = done[0]
    studio.go_on(2000)
    take = studio.stop_take()
    damaged = done[0] - before
    motion = studio.check(take)
    summary = take.summary
    assert summary is not None
    assert damaged > 10
    assert 0 < summary.missing <= 2 * damaged + studio.newest.health.dropped_by_device
    assert 0 < summary.damaged <= 2 * damaged
    assert summary.packets == len(motion) > 1500
    assert (motion.doubt & Doubt.AFTER_GAP).any()


def test_a_line_that_keeps_breaking_loses_time_but_no_digit(studio, glove):
    breaks(studio, glove, 3)


@pytest.mark.long
def test_a_line_that_breaks_all_the_time_loses_time_but_no_digit(studio, glove):
    breaks(studio, glove, 25)


def breaks(studio, glove, count: int) -> None:
    rng = np.random.default_rng(53)
    one = glove("pty", seed=53, epoch=1)
    studio.connect(one.address)
    studio.start_take()
    for k in range(count):
        studio.go_on(int(rng.integers(5, 60)))
        one.switch_off()
        time.sleep(float(rng.uniform(0.0, 0.4)))
        one = glove("pty", seed=53, epoch=2 + k)
        studio.until(lambda newest: newest.phase is not Phase.STREAMING, "it was seen to be away")
        studio.until(lambda newest: newest.phase is Phase.STREAMING, "it is back")
    studio.go_on(30)
    motion = studio.check(studio.stop_take())
    assert studio.newest.health.restarts == count
    assert (np.diff(motion.time_us) > 10_000).sum() == count


# --- another device in the middle of a take -------------------------------------------------------


@pytest.mark.parametrize("kind", ["pty", "tcp"])
def test_another_glove_stays_out_of_the_take_which_waits_for_its_own(studio, glove, kind):
    mine = glove(kind, seed=61, epoch=1)
    number = int(mine.address.rpartition(":")[2]) if kind == "tcp" else 0
    studio.connect(mine.address)
    studio.start_take()
    studio.go_on(60)
    mine.switch_off()
    other = glove(kind, seed=62, epoch=2, port=number)
    other.firmware.receive(encode(Request(Command.START, 1)))  # it streams already
    newest = studio.until(lambda newest: newest.problem is not None, "the problem is shown")
    assert newest.problem.what == "Another device answers (VG-62, not VG-61): the take waits."
    assert "Plug VG-61 back in" in newest.problem.remedy
    assert newest.recorder is not None
    time.sleep(1.0)  # it is asked again a few times
    assert studio.newest.phase is Phase.LOST
    assert studio.newest.problem is not None
    other.switch_off()
    glove(kind, seed=61, epoch=3, port=number)
    newest = studio.until(lambda newest: newest.phase is Phase.STREAMING, "its own is back")
    assert newest.problem is None
    studio.go_on(60)
    take = studio.stop_take()
    studio.check(take)
    assert described(take) == {"VG-61"}


def described(take) -> set[str]:
    decoder = V1Decoder()
    packets = [packet for _, chunk in take.chunks() for packet in decoder.feed(chunk)]
    return {packet.serial_number for packet in packets if isinstance(packet, Description)}


def test_a_take_that_waits_can_be_ended_and_the_other_glove_be_used(studio, glove):
    mine = glove(seed=63)
    studio.connect(mine.address)
    path = studio.start_take()
    studio.go_on(40)
    mine.switch_off()
    glove(seed=64)
    studio.until(lambda newest: newest.problem is not None, "the problem is shown")
    studio.send(StopTake())
    take = studio.take_done(path)
    assert len(process(take)) >= 40
    newest = studio.until(lambda newest: newest.phase is Phase.STREAMING, "the other streams")
    assert newest.description.serial_number == "VG-64"
    assert newest.problem is None


def test_the_same_glove_at_another_rate_stays_out_of_the_take(studio, glove):
    one = glove(seed=65, rate=100)
    studio.connect(one.address)
    path = studio.start_take()
    studio.go_on(40)
    # somebody else's program, or a switch on the glove
    asked = Request(Command.SET_RATE, 1, (200).to_bytes(2, "little"))
    one.firmware.receive(encode(asked))
    newest = studio.until(lambda newest: newest.problem is not None, "the problem is shown")
    assert "VG-65 came back with other settings" in newest.problem.what
    studio.send(StopTake())
    studio.check(studio.take_done(path))
    newest = studio.until(lambda newest: newest.phase is Phase.STREAMING, "it streams")
    assert newest.setup.rate_hz == 200.0
