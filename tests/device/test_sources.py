"""One contract for all byte sources, each with a real other end."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from handstudio.device.addresses import open_source
from handstudio.device.source import ByteSource, SourceLost
from handstudio.errors import DeviceError, HandstudioError, TakeError
from handstudio.protocol.codec import encode
from handstudio.protocol.decoder import V1Decoder
from handstudio.protocol.packets import (
    Command,
    Corruption,
    Description,
    ImuPacket,
    Missing,
    Packet,
    Request,
)
from handstudio.recording.header import Header
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.recording.writer import TakeWriter
from handstudio.setup import Setup, for_device

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")

WITHIN_S = 20.0


@dataclass
class Open:
    """An open source, and how to make its other end go away."""

    source: ByteSource
    end: Callable[[], None]

    def read_until(self, done: Callable[[bytes], bool]) -> bytes:
        heard, end = b"", time.monotonic() + WITHIN_S
        while not done(heard):
            assert time.monotonic() < end, f"only {len(heard)} bytes came"
            heard += self.source.read(0.05)
        return heard

    def until_lost(self) -> None:
        end = time.monotonic() + WITHIN_S
        while time.monotonic() < end:
            self.source.read(0.05)
        raise AssertionError("nobody noticed that the other end is gone")


@pytest.fixture(scope="module")
def take(tmp_path_factory) -> Path:
    return simulate(tmp_path_factory.mktemp("sessions"), rehearse(seed=5), seconds=2.0)


@pytest.fixture(params=["serial", "tcp", "virtual:", "virtual:?transport=tcp", "replay"])
def kind(request) -> str:
    return request.param


@pytest.fixture
def opened(kind, glove, take, new_child) -> Iterator[Open]:
    if kind in ("serial", "tcp"):
        far_end = glove("pty" if kind == "serial" else "tcp")
        one = Open(open_source(far_end.address), far_end.switch_off)
    elif kind == "replay":
        one = Open(open_source(f"replay:{take}"), lambda: None)
    else:
        one = Open(open_source(kind), lambda: os.kill(new_child(), signal.SIGKILL))
    yield one
    one.source.close()


def decoded(data: bytes) -> list[Packet]:
    return V1Decoder().feed(data)


def instants(data: bytes) -> list[ImuPacket]:
    return [packet for packet in decoded(data) if isinstance(packet, ImuPacket)]


def to_its_end(source: ByteSource) -> tuple[bytes, SourceLost]:
    heard, end = b"", time.monotonic() + WITHIN_S
    while time.monotonic() < end:
        try:
            heard += source.read(0.05)
        except SourceLost as lost:
            return heard, lost
    raise AssertionError("it has no end")


# --- the contract ---------------------------------------------------------------------------------


def test_what_comes_is_whole_and_in_order_whatever_its_pieces(opened):
    assert isinstance(opened.source, ByteSource)
    opened.source.write(b"\0" + encode(Request(Command.DESCRIBE, 1)))
    opened.source.write(encode(Request(Command.START, 2)))
    heard = decoded(opened.read_until(lambda data: len(instants(data)) >= 20))
    assert any(isinstance(packet, Description) for packet in heard)
    assert not [packet for packet in heard if isinstance(packet, Corruption | Missing)]


def test_nothing_within_the_timeout_is_no_bytes_and_no_hurry(opened, kind):
    timeout_s = 0.02 if kind == "replay" else 0.3  # a quiet glove says that it is well each second
    end = time.monotonic() + WITHIN_S
    while True:
        assert time.monotonic() < end, "never quiet"
        asked = time.monotonic()
        if opened.source.read(timeout_s) == b"":
            assert time.monotonic() - asked >= 0.9 * timeout_s  # or the capture would spin
            return


def test_when_the_other_end_goes_away_reading_says_so(opened):
    opened.source.write(encode(Request(Command.START, 1)))
    opened.read_until(lambda data: len(instants(data)) > 0)
    opened.end()
    with pytest.raises(SourceLost):
        opened.until_lost()
    with pytest.raises(SourceLost):  # and goes on saying so
        opened.until_lost()
    for _ in range(3):
        with contextlib.suppress(SourceLost):
            opened.source.write(encode(Request(Command.START, 2)))


def test_closing_never_raises_and_ends_it(opened):
    opened.end()
    opened.source.close()
    opened.source.close()
    with pytest.raises(SourceLost):
        opened.source.read(0.01)


def test_closing_a_line_that_is_alive_never_raises(opened):
    opened.source.close()
    opened.source.close()
    with pytest.raises(SourceLost):
        opened.source.read(0.01)


# --- of some of them ------------------------------------------------------------------------------


def test_a_port_hands_over_exactly_what_was_sent(port):
    far_end = port()
    source = open_source(far_end.address)
    rng = np.random.default_rng(7)
    sent = rng.integers(0, 256, 30_000, dtype=np.uint8).tobytes()
    heard, at = b"", 0
    while len(heard) < len(sent):
        at += far_end.say(sent[at : at + int(rng.integers(1, 700))])
        heard += source.read(0.02)
    assert heard == sent
    source.close()


def test_a_socket_hands_over_exactly_what_was_sent():
    rng = np.random.default_rng(8)
    sent = rng.integers(0, 256, 300_000, dtype=np.uint8).tobytes()
    with socket.create_server(("127.0.0.1", 0)) as door:
        source = open_source(f"tcp:127.0.0.1:{door.getsockname()[1]}")
        far_end, _ = door.accept()
        heard, at = b"", 0
        with far_end:
            while at < len(sent):
                at += far_end.send(sent[at : at + int(rng.integers(1, 9000))])
                heard += source.read(0.02)
        assert heard + to_its_end(source)[0] == sent
    source.close()


def test_a_replay_is_the_description_and_then_the_take(take):
    source = open_source(f"replay:{take}")
    heard, _ = to_its_end(source)
    recorded = b"".join(data for _, data in open_take(take).chunks())
    assert heard.endswith(recorded)
    (described,) = decoded(heard.removesuffix(recorded))
    assert isinstance(described, Description)
    setup = open_take(take).header.setup
    assert for_device(described, "handstudio-1", setup.hand) == setup
    source.close()


def test_a_replay_of_a_take_that_is_damaged_further_on_ends_there(take, tmp_path):
    damaged, whole = tmp_path / "damaged.mcap", open_take(take)
    writer = TakeWriter(damaged, whole.header)
    for arrival_ns, chunk in whole.chunks():
        writer.write(arrival_ns, chunk)
        writer.flush()  # as while recording: a chunk of the file each 0.25 s
    writer.close()
    data = bytearray(damaged.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 64] = bytes(64)
    damaged.write_bytes(data)
    source = open_source(f"replay:{damaged}")
    heard, end = to_its_end(source)
    assert len(instants(heard)) > 10
    assert "damaged.mcap" in str(end)
    source.close()


# --- what cannot be opened ------------------------------------------------------------------------


def refusal(address: str) -> HandstudioError:
    with pytest.raises(HandstudioError) as caught:
        open_source(address)
    return caught.value


def test_no_such_port(tmp_path):
    error = refusal(f"serial:{tmp_path}/ttyACM7")
    assert isinstance(error, DeviceError)
    assert f"{tmp_path}/ttyACM7: there is no such port" in error.what
    assert "Plug the device in" in error.remedy


def test_a_port_one_may_not_open(monkeypatch, port):
    place = port().place
    honest = os.open

    def refuse(path, *rest, **more):
        if path == place:
            raise PermissionError(13, "Permission denied", path)
        return honest(path, *rest, **more)

    monkeypatch.setattr(os, "open", refuse)
    error = refusal(f"serial:{place}")
    assert isinstance(error, DeviceError)
    assert f"{place}: you may not open" in error.what
    assert error.remedy.endswith(".")  # what it says: test_port_trouble.py


def test_a_port_that_is_in_use(port):
    place = port().place
    first = open_source(f"serial:{place}")
    error = refusal(f"serial:{place}")
    assert isinstance(error, DeviceError)
    assert f"{place}: another program has this port open" in error.what
    assert "Close that program" in error.remedy
    first.close()
    open_source(f"serial:{place}").close()


@pytest.mark.parametrize("thing", ["file", "folder"])
def test_what_is_no_port_is_not_said_to_be_missing(tmp_path, thing):
    place = tmp_path / thing
    if thing == "file":
        place.write_text("four years of work")
    else:
        place.mkdir()
    error = refusal(f"serial:{place}")
    assert isinstance(error, DeviceError)
    assert str(place) in error.what
    assert "no such port" not in error.what
    assert error.remedy


def test_a_port_nobody_listens_on():
    with socket.create_server(("127.0.0.1", 0)) as door:
        number = door.getsockname()[1]
    error = refusal(f"tcp:127.0.0.1:{number}")
    assert isinstance(error, DeviceError)
    assert f"tcp:127.0.0.1:{number}" in error.what
    assert "refused" in error.what
    assert "switched on" in error.remedy


@pytest.mark.parametrize(
    "address",
    [
        "tcp:localhost",
        "tcp:127.0.0.1:",
        "tcp:127.0.0.1:glove",
        "tcp:127.0.0.1:99999",
        "tcp:127.0.0.1:-1",
        "tcp:",
        "serial:",
        "replay:",
        "usb:1",
        "/dev/ttyACM0",
        "",
        "virtual:rate=1000",
        "virtual://[",
        "virtual:?pace=3",
        "virtual:?rate=77",
        "virtual:?side=both",
    ],
)
def test_an_address_that_is_none_says_what_one_looks_like(address, capfd):
    error = refusal(address)
    assert isinstance(error, DeviceError)
    assert address.partition("?")[0] in error.what or "virtual glove" in error.what
    assert error.remedy.endswith(".")


def test_a_take_that_is_not_there_or_none_cannot_be_replayed(tmp_path):
    assert isinstance(refusal(f"replay:{tmp_path}/lost.mcap"), TakeError)
    thesis = tmp_path / "thesis.mcap"
    thesis.write_text("four years of work")
    assert isinstance(refusal(f"replay:{thesis}"), TakeError)


def test_a_replay_does_not_wait_out_a_long_gap(take, tmp_path):
    """Or whoever listens would take it for lost, begin anew, and never get past the gap."""
    gapped, whole = tmp_path / "gapped.mcap", open_take(take)
    writer = TakeWriter(gapped, whole.header)
    chunks = list(whole.chunks())
    for k, (arrival_ns, chunk) in enumerate(chunks):
        writer.write(arrival_ns + (k >= len(chunks) // 2) * 3_600_000_000_000, chunk)
    writer.close()
    source = open_source(f"replay:{gapped}")
    heard, _ = to_its_end(source)
    assert heard.endswith(b"".join(chunk for _, chunk in chunks))
    source.close()


def test_an_import_cannot_be_replayed(tmp_path, take):
    recorded = open_take(take).header.setup
    setup = Setup(recorded.layout, 100.0)
    path = tmp_path / "import.mcap"
    TakeWriter(path, Header("import", "S01", 0, setup, "samples", "folder")).close()
    error = refusal(f"replay:{path}")
    assert isinstance(error, DeviceError)
    assert str(path) in error.what


def test_a_virtual_glove_that_cannot_start_leaves_no_process(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    error = refusal("virtual:")
    assert isinstance(error, DeviceError)
    assert "virtual glove" in error.what


def test_a_port_that_breaks_while_much_is_read_hands_over_what_came(monkeypatch, port):
    """The system gives 4095 bytes at a time; whoever is behind takes several together."""
    source = open_source(port().address)
    pieces = [bytes([k]) * 4095 for k in range(3)]

    class Waiting:
        in_waiting = 4095

        def fileno(self) -> int:
            return honest.fileno()

        def read(self, size: int) -> bytes:
            if not pieces:
                raise OSError("unplugged")
            return pieces.pop(0)

    expected = b"".join(pieces)
    honest = source._port
    monkeypatch.setattr(source, "_port", Waiting())
    assert source.read(0.0) == expected
    with pytest.raises(SourceLost, match="unplugged"):
        source.read(0.0)
    monkeypatch.setattr(source, "_port", honest)
    source.close()
