"""The process, through a real pseudo-terminal and a real socket, as a host meets it."""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from handstudio.protocol.codec import encode
from handstudio.protocol.commands import PERFORM, perform
from handstudio.protocol.decoder import V1Decoder
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
)
from handstudio.simulation.glove import plain_glove

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")
lines = pytest.mark.parametrize("line", [pytest.param("--pty", marks=posix), "--tcp"])

# A reader here shares a busy machine; what the test of drops leaves as it is, the others make
# large enough that only a reader who is asleep loses anything.
PATIENT = ("--tx-buffer", "400000")


class Process:
    """A virtual glove, ended at the end of the test."""

    def __init__(self, *options: str) -> None:
        command = [sys.executable, "-m", "handstudio.device.virtual_glove", *options]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        assert self.process.stdout is not None
        self.said = self.process.stdout.readline()

    @property
    def address(self) -> str:
        return json.loads(self.said)["address"]

    def ended(self) -> tuple[int, bytes]:
        """Wait for its end: exit code, and what it complained of."""
        assert self.process.stderr is not None
        return self.process.wait(5.0), self.process.stderr.read()

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()


class Host:
    """The other end of the line."""

    def __init__(self, address: str) -> None:
        self.decoder = V1Decoder()
        scheme, _, place = address.partition(":")
        self._socket: socket.socket | None = None
        if scheme == "tcp":
            host, _, port = place.rpartition(":")
            self._socket = socket.socket()
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
            self._socket.connect((host, int(port)))
            self._file = self._socket.fileno()
        else:
            self._file = os.open(place, os.O_RDWR | os.O_NOCTTY)

    def ask(self, command: int, tag: int = 1) -> None:
        os.write(self._file, b"\0" + encode(Request(command, tag)))

    def listen(self, seconds: float) -> list[Packet]:
        heard, until = [], time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            if select.select([self._file], [], [], left)[0]:
                heard += self.decoder.feed(os.read(self._file, 65536))
        return heard

    def until(self, done: Callable[[list[Packet]], bool]) -> list[Packet]:
        heard, end = list[Packet](), time.monotonic() + 10.0
        while not done(heard):
            assert time.monotonic() < end, f"heard only {heard}"
            heard += self.listen(0.02)
        return heard

    def close(self) -> None:
        if self._socket is not None:
            self._socket.close()
        else:
            os.close(self._file)


@pytest.fixture
def started() -> Iterator[Callable[..., Process]]:
    running: list[Process] = []

    def start(line: str, *options: str) -> Process:
        where = [line, "0"] if line == "--tcp" else [line]
        running.append(Process(*where, *options))
        return running[-1]

    yield start
    for process in running:
        process.close()


@pytest.fixture
def connected() -> Iterator[Callable[[Process], Host]]:
    hosts: list[Host] = []

    def connect(process: Process) -> Host:
        hosts.append(Host(process.address))
        return hosts[-1]

    yield connect
    for host in hosts:
        host.close()


def only(kind: type, packets: list[Packet]) -> list:
    return [packet for packet in packets if isinstance(packet, kind)]


@lines
@pytest.mark.parametrize("rate_hz", [100, 1000])
def test_it_streams_in_real_time_what_its_sensors_read(started, connected, line, rate_hz):
    options = ["--rate", str(rate_hz), "--seed", "11", "--side", "left", "--epoch", "77"]
    host = connected(started(line, *options, *PATIENT))
    host.ask(Command.DESCRIBE, 1)
    answered = Reply(Command.DESCRIBE, 1, Result.OK, "")
    heard = host.until(lambda packets: answered in packets and packets[-1] != answered)
    about = only(Description, heard[heard.index(answered) :])[0]
    assert (about.epoch, about.side, about.rate_hz) == (77, "left", rate_hz)
    assert (about.serial_number, about.name) == ("VG-11", "Virtual glove")

    host.ask(Command.START, 2)
    began = time.monotonic()
    heard = host.listen(1.5)
    took = time.monotonic() - began
    assert Reply(Command.START, 2, Result.OK, "") in heard
    assert only(Missing, heard) == []
    assert only(Corruption, heard) == []
    instants = only(ImuPacket, heard)
    clocks = np.array([packet.clock_us for packet in instants])
    assert np.unique(np.diff(clocks)).tolist() == [1_000_000 // rate_hz]
    # never ahead of time; how far behind is the busy machine's business
    assert 0.3 < (clocks[-1] - clocks[0]) * 1e-6 < took + 0.3
    expected = plain_glove("left", 11).read(clocks - clocks[0], rate_hz)
    for k, packet in enumerate(instants):
        np.testing.assert_array_equal(packet.counts, expected.counts[k])
        np.testing.assert_array_equal(packet.fresh, expected.fresh[k])


def test_its_wearer_does_what_the_host_asks(started, connected):
    host = connected(started("--pty", "--motion", "showcase~slow", "--seed", "3"))
    host.ask(Command.START)
    quiet = moved(host.listen(0.5))
    os.write(host._file, encode(perform(7, "showcase~fast")))
    heard = host.until(lambda packets: bool(only(Reply, packets)))
    (reply,) = only(Reply, heard)
    assert (reply.command, reply.tag, reply.result) == (PERFORM, 7, Result.OK)
    # asked for later, when the fist of the fast one has long begun and the slow one still rests
    heard = host.listen(4.0)
    assert quiet < 0.1
    assert moved(heard) > 1.0
    assert only(Missing, heard) == []


@pytest.mark.parametrize("asked", ["juggling", "showcase+juggling", "showcase:twice", "\ud800"])
def test_what_nobody_can_do_is_refused_with_a_word(started, connected, asked):
    host = connected(started("--pty"))
    request = Request(PERFORM, 3, asked.encode(errors="surrogatepass"))
    os.write(host._file, encode(request))
    (reply,) = only(Reply, host.until(lambda packets: bool(only(Reply, packets))))
    assert (reply.tag, reply.result) == (3, Result.BAD_ARGUMENT)
    assert reply.text


def test_its_clock_may_run_faster(started, connected):
    host = connected(started("--pty", "--speed", "4", "--rate", "50"))
    host.ask(Command.START)
    began = time.monotonic()
    heard = host.listen(1.0)
    took = time.monotonic() - began
    clocks = [packet.clock_us * 1e-6 for packet in only(ImuPacket, heard)]
    assert 2.0 < clocks[-1] - clocks[0] < 4.0 * took + 0.5


@pytest.mark.parametrize(
    ("option", "value", "word"),
    [("--motion", "juggling", "juggling"), ("--imperfections", "rust", "rust")],
)
def test_who_cannot_begin_says_why(option, value, word):
    command = [sys.executable, "-m", "handstudio.device.virtual_glove", "--pty", option, value]
    said = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert said.returncode == 1
    what, remedy = json.loads(said.stdout)["problem"]
    assert word in what
    assert remedy


def moved(packets: list[Packet]) -> float:
    """Fastest turn of the middle fingertip [rad/s], its bias taken off."""
    counts = np.array([packet.counts[13, 3:6] for packet in only(ImuPacket, packets)], dtype=float)
    return float(np.abs(counts - counts[0]).max() * np.deg2rad(2000.0) / 32768)


@lines
def test_a_host_that_sleeps_loses_what_the_glove_says_it_dropped(started, connected, line):
    host = connected(started(line, "--rate", "1000"))
    host.ask(Command.START)
    heard = host.listen(0.3)
    time.sleep(1.0)
    heard += host.until(lambda packets: bool(only(Health, packets)))
    # what was dropped just before that health is only seen by the next instant that came through
    heard += host.until(lambda packets: bool(only(ImuPacket, packets)))
    assert only(Corruption, heard) == []
    instants, health = only(ImuPacket, heard), only(Health, heard)[-1]
    clocks = np.array([packet.clock_us for packet in instants])
    # how many were due until that health, against how many of those were heard
    first_us = clocks[-1] - 1000 * instants[-1].sequence
    due = (health.clock_us - first_us) // 1000 + 1
    lost = due - np.count_nonzero(clocks <= health.clock_us)
    assert lost == health.dropped > 100
    assert sum(packet.count for packet in only(Missing, heard)) >= lost
    flagged = [k for k, packet in enumerate(instants) if packet.status & Status.DROPPED]
    jumps = 1 + np.flatnonzero(np.diff([packet.sequence for packet in instants]) > 1)
    assert flagged == jumps.tolist()


def test_over_tcp_the_next_host_finds_it_silent_and_is_told_who_is_there(started, connected):
    process = started("--tcp", *PATIENT)
    first = connected(process)
    first.ask(Command.START)
    first.until(lambda packets: len(only(ImuPacket, packets)) > 10)
    first.close()
    second = connected(process)
    heard = second.until(lambda packets: bool(only(Description, packets)))
    assert only(ImuPacket, heard + second.listen(0.3)) == []
    second.ask(Command.START)
    second.until(lambda packets: len(only(ImuPacket, packets)) > 10)


@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_goes_by_the_name_it_is_given_and_takes_it_away(started, connected, tmp_path, number):
    link = tmp_path / "glove"
    link.symlink_to(tmp_path / "one of long ago")
    process = started("--pty", "--link", str(link))
    assert process.address == f"serial:{link}"
    connected(process).until(lambda packets: bool(only(Description, packets)))
    process.process.send_signal(number)
    assert process.ended() == (0, b"")
    assert not link.is_symlink()


@posix
def test_it_leaves_a_file_of_that_name_alone(started, tmp_path):
    thesis = tmp_path / "thesis.tex"
    thesis.write_text("four years of work")
    code, complaint = started("--pty", "--link", str(thesis)).ended()
    assert code != 0
    assert b"thesis.tex" in complaint
    assert thesis.read_text() == "four years of work"


@lines
def test_it_ends_with_its_parent(started, line):
    process = started(line, "--quit-with-parent")
    assert process.process.poll() is None
    process.process.stdin.close()
    process.process.stdin = None
    assert process.ended() == (0, b"")


@posix
def test_without_a_choice_it_is_a_pseudo_terminal():
    process = Process("--quit-with-parent")
    place = process.address.removeprefix("serial:")
    assert Path(place).is_char_device()
    process.close()
