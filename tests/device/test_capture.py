"""The capture thread with real lines: what streams, what is recorded, and that both agree."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

import numpy as np
import pytest

from handstudio.device import capture as capture_module
from handstudio.device.capture import Capture
from handstudio.device.line import PACE_S
from handstudio.device.orders import (
    Ask,
    Connect,
    Disconnect,
    Phase,
    SetHand,
    StartTake,
    StopTake,
    TakeDone,
)
from handstudio.errors import DeviceError, HandstudioError, SetupError, TakeError
from handstudio.maths import so3
from handstudio.pipeline import Doubt
from handstudio.process import process
from handstudio.protocol.codec import encode
from handstudio.protocol.commands import PERFORM
from handstudio.protocol.decoder import V1Decoder
from handstudio.protocol.packets import Command, ImuPacket, Request, Result
from handstudio.recording.take import open_take
from handstudio.setup import HandModel

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

LOST_WITHIN_S = 1.0  # of silence, what a person must see


# --- live and processed motion --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rate_hz", "instants"), [(100, 200), pytest.param(1000, 1200, marks=pytest.mark.long)]
)
def test_the_take_of_a_virtual_glove_gives_the_motion_that_was_shown(studio, rate_hz, instants):
    newest = studio.connect(f"virtual:?rate={rate_hz}&seed=21")
    assert newest.setup.rate_hz == rate_hz
    assert newest.description.serial_number == "VG-21"
    studio.start_take()  # before any sensor is placed: the state is an open window of samples
    studio.go_on(instants)
    take = studio.stop_take()
    motion = studio.check(take)
    assert len(motion) >= instants
    summary = take.summary
    assert summary is not None
    assert summary.packets == len(motion)
    assert summary.bytes == sum(len(data) for _, data in take.chunks())
    assert take.header.setup == newest.setup


@pytest.mark.parametrize(("rate_hz", "instants"), [(100, 100), (1000, 500)])
def test_a_take_may_begin_in_the_middle_of_a_packet_and_of_a_motion(
    studio, glove, proxy, rate_hz, instants
):
    held = bytearray()

    def cut(data: bytes) -> bytes:  # a packet's last bytes always come with the next packet
        held.extend(data)
        ready = bytes(held[:-40])
        del held[: len(ready)]
        return ready

    studio.connect(proxy(glove("tcp", seed=22, rate=rate_hz).address, cut).address)
    studio.until(lambda newest: not newest.motion.doubt.any(), "every sensor is placed")
    studio.go_on(rate_hz // 2)
    studio.start_take()
    studio.go_on(instants)
    take = studio.stop_take()
    motion = studio.check(take)
    assert np.isfinite(motion.q_world_start[0]).all()
    blind = process(take, from_start=True)  # without the stored state, the first packet is half
    assert len(blind) == len(motion) - 1
    assert (blind.doubt[0] & Doubt.UNPLACED).all()


def test_a_fast_stream_is_read_in_pieces_that_are_worth_it(studio, glove):
    studio.connect(glove(seed=28, rate=1000).address)
    studio.start_take()
    studio.go_on(500)
    take = studio.stop_take()
    arrivals = np.array([arrival_ns for arrival_ns, _ in take.chunks()])
    assert len(arrivals) <= (arrivals[-1] - arrivals[0]) * 1e-9 / PACE_S + 2


def test_take_follows_take_without_a_hole(studio, glove):
    studio.connect(glove(seed=23).address)
    first = studio.start_take("first")
    studio.go_on(40)
    studio.send(StopTake())
    studio.send(StartTake(studio.folder / "second.mcap", "S01"))
    before = studio.check(studio.take_done(first))
    studio.go_on(40)
    after = studio.check(studio.stop_take())
    assert after.time_us[0] - before.time_us[-1] == 10_000


# --- a line that breaks ---------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["pty", "tcp"])
def test_a_take_goes_on_when_the_glove_dies_and_comes_back(studio, glove_process, kind):
    glove = glove_process(kind, seed=24, epoch=1)
    studio.connect(glove.address)
    studio.start_take()
    studio.go_on(100)
    glove.kill()
    studio.until(lambda newest: newest.phase is Phase.LOST, "it is seen to be lost", LOST_WITHIN_S)
    assert studio.newest.recorder is not None
    assert studio.newest.health.rate_hz == 0.0
    glove.start(seed=24, epoch=2)
    studio.until(lambda newest: newest.phase is Phase.STREAMING, "it is back")
    studio.go_on(100)
    take = studio.stop_take()

    motion = studio.check(take)
    assert [path.name for path in studio.folder.glob("*.mcap*")] == ["take.mcap"]
    assert studio.newest.health.restarts == 1
    step_us = np.diff(motion.time_us)
    gap = int(np.argmax(step_us))
    assert np.delete(step_us, gap).max() == 10_000
    decoder = V1Decoder()  # it says who it is before it is asked for instants: those are awaited
    arrivals = [
        arrival_ns
        for arrival_ns, chunk in take.chunks()
        if any(isinstance(packet, ImuPacket) for packet in decoder.feed(chunk))
    ]
    away_us = np.diff(arrivals).max() / 1000
    assert step_us[gap] == pytest.approx(away_us, abs=0.2e6)
    assert not (motion.doubt[gap] & Doubt.UNPLACED).any()
    assert (motion.doubt[gap + 1] & Doubt.UNPLACED).all()
    assert not (motion.doubt[-1] & Doubt.UNPLACED).any()


def test_our_own_glove_is_started_anew_when_it_dies(studio, new_child):
    studio.connect("virtual:?seed=25")
    studio.start_take()
    studio.go_on(100)
    os.kill(new_child(), signal.SIGKILL)
    studio.until(lambda newest: newest.phase is Phase.LOST, "it is seen to be lost")
    studio.until(lambda newest: newest.phase is Phase.STREAMING, "there is a new one")
    studio.go_on(100)
    studio.check(studio.stop_take())


def test_a_glove_that_pauses_is_shown_as_lost_and_goes_on(studio, glove_process):
    glove = glove_process(seed=26)
    studio.connect(glove.address)
    studio.start_take()
    studio.go_on(50)
    glove.pause()
    paused = time.monotonic()
    studio.until(lambda newest: newest.phase is Phase.LOST, "it is seen to be lost", LOST_WITHIN_S)
    time.sleep(max(0.0, paused + 1.2 - time.monotonic()))
    glove.resume()
    studio.until(lambda newest: newest.phase is Phase.STREAMING, "it goes on")
    studio.go_on(50)
    motion = studio.check(studio.stop_take())
    assert studio.newest.health.restarts == 0
    assert np.diff(motion.time_us).max() == 10_000  # it caught up: its buffer is large


def test_a_glove_that_pauses_for_long_is_reached_over_a_new_line(studio, glove_process):
    glove = glove_process(seed=27)
    studio.connect(glove.address)
    studio.start_take()
    studio.go_on(50)
    glove.pause()
    line = studio.capture._line
    studio.until(lambda _: studio.capture._line not in (None, line), "a new line")
    glove.resume()
    studio.until(lambda newest: newest.phase is Phase.STREAMING, "it goes on")
    studio.go_on(50)
    studio.check(studio.stop_take())


def test_a_start_that_is_lost_on_the_way_is_repeated(studio, glove, proxy):
    lost: list[bytes] = []

    def lose_the_first_start(data: bytes) -> bytes:
        if lost or bytes([Command.START]) not in data:
            return data
        lost.append(data)
        return b""

    studio.connect(proxy(glove("tcp").address, bytes, lose_the_first_start).address)
    assert lost


def test_a_glove_that_stops_streaming_is_started_again(studio, glove):
    studio.connect(glove().address)
    studio.go_on(20)
    studio.send(Ask(Command.STOP))
    studio.until(lambda newest: newest.phase is Phase.LOST, "it is silent")
    studio.until(lambda newest: newest.phase is Phase.STREAMING, "it streams again")


def test_a_start_is_repeated_until_a_restarted_glove_hears_it(studio, glove, proxy):
    """The line stays, as with an adapter: the glove behind it restarts and misses a START."""
    losing = threading.Event()

    def lose_starts(data: bytes) -> bytes:
        return b"" if losing.is_set() and bytes([Command.START]) in data else data

    one = glove("tcp")
    studio.connect(proxy(one.address, bytes, lose_starts).address)
    studio.go_on(20)
    losing.set()
    studio.send(Ask(Command.STOP))
    studio.until(lambda newest: newest.phase is Phase.LOST, "it is silent")
    time.sleep(1.5)  # longer than it says nothing at all: HEALTH comes each second
    losing.clear()
    studio.until(lambda newest: newest.phase is Phase.STREAMING, "it streams again")


def test_the_line_is_cleared_of_half_a_frame_when_it_is_opened(studio, port):
    far_end = port()
    studio.send(Connect(far_end.address))
    heard = bytearray()
    studio.until(lambda _: heard.extend(far_end.hear()) or len(heard) > 8, "a question")
    assert heard[0] == 0


# --- orders ---------------------------------------------------------------------------------------


def test_another_device_may_be_chosen_while_one_is_recorded(studio, glove):
    studio.connect(glove("pty", seed=31).address)
    path = studio.start_take()
    studio.go_on(30)
    first = list(studio.motions)
    second = glove("tcp", seed=32)
    newest = studio.connect(second.address)
    assert newest.description.serial_number == "VG-32"
    assert newest.recorder is None
    take = studio.take_done(path)
    assert take.header.setup.device.serial_number == "VG-31"
    assert len(process(take)) >= 30
    assert len(first) > 0
    studio.start_take("of the second")
    studio.go_on(30)
    studio.check(studio.stop_take())


def test_disconnecting_ends_the_take_whole(studio, glove):
    studio.connect(glove().address)
    path = studio.start_take()
    studio.go_on(30)
    studio.send(Disconnect())
    studio.until(lambda newest: newest.phase is Phase.IDLE, "it is let go")
    take = studio.take_done(path)
    assert take.summary is not None
    assert len(process(take)) >= 30


def test_stopping_the_capture_ends_the_take_whole(studio, glove):
    studio.connect(glove().address)
    path = studio.start_take()
    studio.go_on(30)
    studio.capture.stop()
    studio.hear()
    assert TakeDone(path) in studio.reports
    assert len(studio.check(open_take(path))) >= 30
    studio.capture.stop()  # again: nothing happens


def test_a_capture_that_never_began_can_be_stopped():
    Capture().stop()


def test_recording_needs_a_device(studio):
    studio.send(StopTake())
    studio.send(StartTake(studio.folder / "take.mcap", "S01"))
    studio.until(lambda _: studio.reports, "a report")
    (report,) = studio.reports
    assert isinstance(report, DeviceError)
    assert "No device" in report.what
    assert not list(studio.folder.glob("*.mcap*"))


def test_a_stop_without_a_take_changes_nothing(studio, glove):
    studio.connect(glove().address)
    studio.send(StopTake())
    studio.go_on(20)
    assert studio.reports == []


def test_a_take_is_never_overwritten(studio, glove):
    studio.connect(glove().address)
    path = studio.folder / "take.mcap"
    path.write_text("four years of work")
    studio.send(StartTake(path, "S01"))
    studio.until(lambda _: studio.reports, "a report")
    assert isinstance(studio.reports[0], TakeError)
    assert path.read_text() == "four years of work"
    studio.go_on(20)


def test_a_second_start_leaves_the_take_alone(studio, glove):
    studio.connect(glove().address)
    path = studio.start_take()
    studio.send(StartTake(studio.folder / "other.mcap", "S01"))
    studio.go_on(20)
    take = studio.stop_take()
    assert take.path == path
    assert not (studio.folder / "other.mcap").exists()


def test_the_hand_may_change_live_but_not_within_a_take(studio, glove):
    studio.connect(glove().address)
    small, large = HandModel(hand_length_m=0.15), HandModel(hand_length_m=0.21)
    studio.send(SetHand(small))
    studio.until(lambda newest: newest.setup.hand == small, "the smaller hand")
    studio.start_take()
    studio.send(SetHand(large))
    studio.go_on(20)
    assert studio.newest.setup.hand == small
    take = studio.stop_take()
    assert take.header.setup.hand == small
    studio.check(take)
    studio.send(SetHand(large))
    studio.until(lambda newest: newest.setup.hand == large, "the larger hand")
    studio.go_on(20)  # and the device describing itself again does not change it back
    studio.send(Ask(Command.DESCRIBE))
    studio.go_on(20)
    assert studio.newest.setup.hand == large


def test_a_sensor_blinks_and_the_glove_says_so(studio, glove):
    one = glove()
    studio.connect(one.address)
    studio.send(Ask(Command.BLINK, bytes([17]) + (500).to_bytes(2, "little")))

    def answered(newest) -> bool:
        return newest.last_reply is not None and newest.last_reply.command == Command.BLINK

    assert studio.until(answered, "the answer").last_reply.result == Result.OK
    assert one.firmware.blinking == (17, 500)


@pytest.mark.parametrize(("command", "argument"), [(0x20, b""), (0x84, bytes(300))])
def test_what_is_no_command_is_reported_and_nothing_stops(studio, glove, command, argument):
    studio.connect(glove().address)
    studio.send(Ask(command, argument))
    studio.until(lambda _: studio.reports, "a report")
    assert isinstance(studio.reports[0], HandstudioError)
    studio.go_on(20)


def test_the_wearer_of_a_virtual_glove_does_what_is_asked_or_it_is_said_why_not(studio):
    studio.connect("virtual:?seed=8&motion=rest:600")
    first = studio.until(lambda newest: not newest.motion.doubt.any(), "every sensor is placed")
    studio.send(Ask(PERFORM, b"showcase~fast"))

    def moves(newest) -> bool:
        turned = so3.angle_between(newest.motion.q_world_sensor, first.motion.q_world_sensor)
        return bool(turned.max() > 0.5)

    studio.until(moves, "the wearer moves")
    assert studio.reports == []
    studio.send(Ask(PERFORM, b"juggling"))
    studio.until(lambda _: studio.reports, "a report")
    (told,) = studio.reports
    assert "juggling" in told.what
    assert told.remedy
    studio.go_on(5)


def test_another_rate_is_another_setup_and_the_stream_goes_on(studio, glove):
    studio.connect(glove(seed=33).address)
    studio.go_on(20)
    studio.send(Ask(Command.SET_RATE, (200).to_bytes(2, "little")))
    studio.until(lambda newest: newest.setup.rate_hz == 200.0, "the new rate")
    studio.motions.clear()
    studio.start_take()
    studio.go_on(200)
    take = studio.stop_take()
    motion = studio.check(take)
    assert take.header.setup.rate_hz == 200.0
    assert np.unique(np.diff(motion.time_us)).tolist() == [5000]
    assert studio.newest.phase is Phase.STREAMING


def test_the_rate_cannot_change_within_a_take(studio, glove):
    studio.connect(glove(seed=34).address)
    studio.start_take()
    studio.send(Ask(Command.SET_RATE, (200).to_bytes(2, "little")))
    studio.until(lambda _: studio.reports, "a report")
    assert "while a take is recorded" in studio.reports[0].what
    studio.go_on(30)
    motion = studio.check(studio.stop_take())
    assert np.unique(np.diff(motion.time_us)).tolist() == [10_000]


# --- what cannot be -------------------------------------------------------------------------------


@pytest.mark.parametrize("address", ["serial:/nowhere/ttyACM0", "tcp:127.0.0.1:1", "usb:1", ""])
def test_a_device_that_cannot_be_opened_is_a_failure_with_a_remedy(studio, address):
    studio.send(Connect(address))
    newest = studio.until(lambda newest: newest.phase is Phase.FAILED, "it failed")
    assert isinstance(newest.problem, DeviceError)
    assert newest.address == address
    assert newest.problem.remedy


def test_after_a_failure_another_device_may_be_chosen(studio, glove):
    studio.send(Connect("serial:/nowhere/ttyACM0"))
    studio.until(lambda newest: newest.phase is Phase.FAILED, "it failed")
    assert studio.connect(glove().address).problem is None


def test_a_decoder_nobody_has_is_a_failure_with_a_remedy(studio, glove):
    one = glove()
    studio.send(Connect(one.address, decoder="esperanto"))
    newest = studio.until(lambda newest: newest.phase is Phase.FAILED, "it failed")
    assert isinstance(newest.problem, SetupError)
    assert "esperanto" in newest.problem.what
    studio.connect(one.address)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_mistake_of_ours_is_shown_and_the_take_is_whole(studio, glove, monkeypatch):
    studio.connect(glove().address)
    path = studio.start_take()
    studio.go_on(30)

    def fail(*_: object) -> None:
        raise ZeroDivisionError("a mistake")

    monkeypatch.setattr(capture_module.pipeline, "run", fail)
    newest = studio.until(lambda newest: newest.phase is Phase.FAILED, "it failed")
    assert "ZeroDivisionError: a mistake" in newest.problem.what
    monkeypatch.undo()
    take = studio.take_done(path)
    assert take.summary is not None
    assert len(process(take)) >= 30


def test_what_the_line_says_before_the_device_says_who_it_is_is_not_lost(studio, glove):
    """A glove that was left streaming: its first packets count once it is known."""
    one = glove("pty", seed=35)
    one.firmware.receive(encode(Request(Command.START, 1)))
    studio.connect(one.address)
    studio.start_take()
    studio.go_on(30)
    studio.check(studio.stop_take())
