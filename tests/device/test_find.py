"""Which ports there are, and who is behind them."""

from __future__ import annotations

import sys
import time

import pytest
from serial.tools.list_ports_common import ListPortInfo

from handstudio.device import find
from handstudio.device.addresses import open_source
from handstudio.device.orders import Phase

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@pytest.mark.parametrize("kind", ["pty", "tcp"])
def test_a_glove_says_who_it_is(glove, kind):
    one = glove(kind, seed=91)
    found = find.probe(one.address)
    assert found.is_glove
    assert found.address == one.address
    assert found.label == "Virtual glove (VG-91)"
    assert found.description.sensors == tuple(range(1, 21))
    assert found.problem == ""


def test_asking_leaves_a_glove_as_it_was(glove, studio):
    one = glove(seed=92)
    find.probe(one.address)
    find.probe(one.address)
    studio.connect(one.address)
    assert studio.newest.health.damaged == 0


def test_half_a_frame_of_somebody_else_does_not_hide_a_glove(glove):
    one = glove(seed=93)
    one.firmware.receive(b"\x0bfour years")
    assert find.probe(one.address).is_glove


def test_a_glove_in_use_is_not_disturbed(glove, studio):
    one = glove(seed=94)
    studio.connect(one.address)
    found = find.probe(one.address)
    assert not found.is_glove
    assert "another program has this port open" in found.problem
    studio.go_on(30)
    assert studio.newest.phase is Phase.STREAMING
    assert studio.newest.health.missing == 0


def test_a_silent_port_is_no_glove_and_soon_known_as_such(port):
    far_end = port()
    asked = time.monotonic()
    found = find.probe(far_end.address)
    assert time.monotonic() - asked < find.PROBE_S + 3.0
    assert not found.is_glove
    assert found.problem == "does not say that it is a glove"
    open_source(far_end.address).close()  # it was let go


def test_a_port_that_is_not_there_is_said_so(tmp_path):
    found = find.probe(f"serial:{tmp_path}/ttyACM7")
    assert not found.is_glove
    assert "no such port" in found.problem


def test_another_version_of_the_protocol_is_named(port):
    far_end = port()
    far_end.keep_saying(lambda: bytes.fromhex("00 08 01 02 2A 71 18 0E 17 00"))
    assert find.probe(far_end.address).problem == "speaks protocol version 2"


def test_a_port_that_goes_while_it_is_asked_is_said_so(port):
    far_end = port()

    def answer() -> bytes:
        if far_end.hear():
            far_end.hang_up()
        return b""

    far_end.keep_saying(answer)
    assert "closed the line" in find.probe(far_end.address).problem


def test_asking_never_raises(glove):
    assert find.probe("usb:1").problem
    assert find.probe("").problem
    assert "esperanto" in find.probe(glove().address, decoder="esperanto").problem


def test_only_ports_a_glove_could_be_on_are_offered(monkeypatch):
    def one(device, vid=None, description="n/a", product=None):
        port = ListPortInfo(device)
        port.vid, port.description, port.product = vid, description, product
        return port

    there = [
        one("/dev/ttyACM0", 0x2E8A, "Glove - Board CDC", "Glove"),
        one("/dev/ttyS0"),
        one("/dev/rfcomm0"),
        one("COM7", None, "Standard Serial over Bluetooth link (COM7)"),
        one("/dev/ttyUSB3", 0x0403, None, None),
        one("COM5", 0x2E8A, "USB Serial Device (COM5)"),
    ]
    monkeypatch.setattr(find.list_ports, "comports", lambda: iter(there))
    assert [(port.address, port.label) for port in find.ports()] == [
        ("serial:/dev/rfcomm0", "/dev/rfcomm0"),
        ("serial:/dev/ttyACM0", "Glove (/dev/ttyACM0)"),
        ("serial:/dev/ttyUSB3", "/dev/ttyUSB3"),
        ("serial:COM5", "USB Serial Device (COM5)"),
        ("serial:COM7", "Standard Serial over Bluetooth link (COM7)"),
    ]
    assert not any(port.is_glove for port in find.ports())
