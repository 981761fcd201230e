"""Ports that do not open say why, and what to do; with real files, terminals and rights."""

from __future__ import annotations

import errno
import os
import socket
import subprocess
import sys
import termios
from pathlib import Path

import pytest
import serial
from serial.tools.list_ports_common import ListPortInfo

from handstudio.device import find, port_trouble, tcp_source
from handstudio.device.addresses import open_source
from handstudio.device.line import Line, stranger
from handstudio.device.port_trouble import Rights
from handstudio.errors import DeviceError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="POSIX files, groups, terminals")

ROOT = Path(__file__).parents[2]
PORT = "/dev/ttyACM0"


def refusal(address: str) -> DeviceError:
    with pytest.raises(DeviceError) as caught:
        open_source(address)
    return caught.value


# --- rights ---------------------------------------------------------------------------------------


def rights(**more: object) -> Rights:
    usual = {
        "group": "dialout",
        "group_may": True,
        "is_roots": False,
        "we_act_for_it": False,
        "we_are_listed": False,
    }
    return Rights(**(usual | more))


def test_who_is_not_in_the_group_gets_the_command_to_join_it():
    error = port_trouble.forbidden(PORT, rights(group="uucp"))
    assert "group uucp" in error.what
    assert "sudo usermod -aG uucp $USER" in error.remedy
    assert "Log out" in error.remedy or "log out" in error.remedy


def test_who_joined_but_has_not_logged_in_again_is_told_so():
    error = port_trouble.forbidden(PORT, rights(we_are_listed=True))
    assert "dialout" in error.what
    assert "Log out and in again" in error.remedy
    assert "usermod" not in error.remedy


@pytest.mark.parametrize(
    "told",
    [None, rights(group_may=False), rights(is_roots=True), rights(we_act_for_it=True)],
    ids=["unknown", "group may not", "group of root", "in the group already"],
)
def test_where_no_group_helps_none_is_recommended(told):
    error = port_trouble.forbidden(PORT, told)
    assert "you may not open" in error.what
    assert "usermod" not in error.remedy
    assert error.remedy


_AS_NOBODY = """
import getpass, grp, os, pwd, sys  # now, as the system's own folders may be closed later
from handstudio.device.addresses import open_source
from handstudio.errors import DeviceError
os.setgroups([])
os.setgid(65534)
os.setuid(65534)
try:
    open_source("serial:" + sys.argv[1])
except DeviceError as error:
    print(error)
"""


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root drops rights"
)
@pytest.mark.parametrize(("mode", "joins"), [(0o660, True), (0o600, False)])
def test_the_group_of_a_real_port_is_named_to_somebody_without_rights(mode, joins):
    grp = pytest.importorskip("grp")
    try:
        group = grp.getgrnam("dialout")
    except KeyError:
        pytest.skip("this system has no group dialout")
    ours, theirs = os.openpty()
    place = os.ttyname(theirs)
    try:
        os.chown(place, 0, group.gr_gid)
        Path(place).chmod(mode)
        said = subprocess.run(
            [sys.executable, "-c", _AS_NOBODY, place],
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
    finally:
        os.close(ours)
        os.close(theirs)
    assert f"{place}: you may not open this port" in said
    assert ("sudo usermod -aG dialout $USER" in said) is joins


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="groups as on Linux")
def test_rights_are_read_from_the_file(tmp_path, monkeypatch):
    grp = pytest.importorskip("grp")
    place = tmp_path / "port"
    place.touch()
    place.chmod(0o660)
    own = port_trouble.rights_of(str(place))
    assert own is not None
    assert own.group_may
    assert own.group == grp.getgrgid(place.stat().st_gid).gr_name
    assert own.we_act_for_it
    place.chmod(0o644)
    reading = port_trouble.rights_of(str(place))
    assert reading is not None
    assert not reading.group_may
    entry = grp.struct_group(("glovers", "x", place.stat().st_gid, ["maria"]))
    monkeypatch.setattr(grp, "getgrgid", lambda _: entry)
    monkeypatch.setattr(os, "getgroups", list)
    monkeypatch.setattr(os, "getegid", lambda: 54321)
    for account, listed in (("maria", True), ("nikos", False)):
        monkeypatch.setenv("LOGNAME", account)
        told = port_trouble.rights_of(str(place))
        assert told is not None
        assert (told.group, told.we_act_for_it, told.we_are_listed) == ("glovers", False, listed)
    assert port_trouble.rights_of(str(tmp_path / "lost")) is None


# --- in use ---------------------------------------------------------------------------------------

_HOLD = """
import sys, serial
port = serial.Serial(sys.argv[1], exclusive=True)
print("held", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def holder(port):
    """A port that another process has for itself."""
    place = port().place
    with subprocess.Popen(
        [sys.executable, "-c", _HOLD, place],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield place, process.pid
        assert process.stdin is not None
        process.stdin.close()


def test_the_program_that_has_a_port_is_named(holder):
    place, number = holder
    if not Path("/proc/self/fd").exists():
        pytest.skip("no /proc to find a program in")
    error = refusal(f"serial:{place}")
    assert f"{place}: another program has this port open" in error.what
    assert f"({number})" in error.what
    assert "Close that program" in error.remedy


def test_looking_for_a_program_ends_in_time(holder, monkeypatch):
    place, _ = holder
    monkeypatch.setattr(port_trouble, "_locker_of", lambda _: None)
    assert port_trouble.program_at(place, within_s=-1.0) is None
    assert port_trouble.program_at("/dev/no-such-port") is None


def test_a_port_that_another_program_took_exclusively_is_in_use():
    taken = serial.SerialException(errno.EBUSY, "could not open port: Device or resource busy")
    assert "another program has this port open" in port_trouble.cannot_open("/dev/null", taken).what


def test_the_modem_manager_is_suspected_of_new_ports_only():
    for program in ("ModemManager (123)", None):
        error = port_trouble.busy(PORT, program, modem_manager_runs=True)
        assert "ModemManager" in error.what
        assert "systemctl" in error.remedy
    assert "ModemManager" not in port_trouble.busy(PORT, None, modem_manager_runs=False).what
    assert "ModemManager" not in port_trouble.busy("/dev/rfcomm0", None, True).what
    assert "minicom" in port_trouble.busy(PORT, "minicom (7)", True).what


# --- nothing, or something else -------------------------------------------------------------------


def test_where_a_port_is_missing_those_that_are_there_are_named(monkeypatch, tmp_path):
    there = [ListPortInfo("/dev/ttyS0"), ListPortInfo("/dev/ttyACM3")]
    there[1].vid = 0x2E8A
    monkeypatch.setattr(port_trouble.list_ports, "comports", lambda: there)
    error = refusal(f"serial:{tmp_path}/ttyACM0")
    assert "there is no such port" in error.what
    assert "/dev/ttyACM3, /dev/ttyS0" in error.remedy
    monkeypatch.setattr(port_trouble.list_ports, "comports", list)
    error = refusal(f"serial:{tmp_path}/ttyACM0")
    assert "nor any other serial port" in error.what
    assert "cable" in error.remedy


def test_a_folder_a_file_and_another_device_are_called_what_they_are(tmp_path):
    take = tmp_path / "thesis.mcap"
    take.write_text("four years of work")
    assert "is a file" in refusal(f"serial:{take}").what
    assert "replay:" in refusal(f"serial:{take}").remedy
    assert take.read_text() == "four years of work"
    assert "is a folder" in refusal(f"serial:{tmp_path}").what
    assert "not a serial port" in refusal("serial:/dev/null").what


@pytest.mark.parametrize(
    "error",
    [
        termios.error(errno.EIO, "Input/output error"),
        serial.SerialException("something new"),
        ValueError("embedded null byte"),
        OSError(),
    ],
)
@pytest.mark.parametrize("port", ["/dev/null", "a\0b", "", "COM5"])
def test_whatever_else_happens_there_are_words_for_it(port, error):
    told = port_trouble.cannot_open(port, error)
    assert told.what
    assert told.remedy


# --- speed ----------------------------------------------------------------------------------------


def test_an_address_may_set_the_speed_of_an_adapter(port):
    far_end = port()
    for speed, code in (("115200", termios.B115200), ("921600", termios.B921600)):
        source = open_source(f"{far_end.address}?baud={speed}")
        assert termios.tcgetattr(source._port.fileno())[4:6] == [code, code]
        source.close()


@pytest.mark.parametrize(
    "speed", ["", "fast", "0", "-9600", "9600.0", "99999999", "１２００", "9" * 99]
)
def test_what_is_no_speed_is_said_so(port, speed):
    error = refusal(f"{port().address}?baud={speed}")
    assert "not the speed of a line" in error.what
    assert "?baud=115200" in error.remedy


@pytest.fixture
def babbler(port):
    """A line on which bytes come that are no frames, as at a wrong speed."""
    far_end = port()
    far_end.keep_saying(lambda: bytes([0xFF, 0x80, 0xFE, 0x00] * 20))
    return far_end


def test_bytes_that_are_never_a_packet_may_come_at_a_wrong_speed(babbler):
    found = find.probe(babbler.address)
    assert not found.is_glove
    assert "baud rate may be wrong" in found.problem
    line = Line(open_source(babbler.address), "handstudio-1")
    while not line.babbles:
        line.hold(0, line.read())
    error = stranger(line, f"{babbler.address}?baud=9600", 4.0)
    line.close()
    assert f"{line.received} bytes came" in error.what
    assert "baud rate may be wrong" in error.remedy
    assert f"{babbler.address}?baud=115200" in error.remedy
    assert "baud" not in stranger(line, "tcp:glove:5555", 4.0).remedy


# --- sockets --------------------------------------------------------------------------------------


def test_a_name_that_nobody_knows():
    error = refusal("tcp:no-such-glove.invalid:5555")
    assert "no machine called no-such-glove.invalid" in error.what
    assert "spelling" in error.remedy


def test_a_device_that_never_answers(monkeypatch):
    monkeypatch.setattr(tcp_source, "CONNECT_S", 0.2)
    with socket.socket() as deaf:  # listens, and has no place left in its queue
        deaf.bind(("127.0.0.1", 0))
        deaf.listen(0)
        place = deaf.getsockname()
        callers = [socket.socket() for _ in range(4)]
        for caller in callers:
            caller.setblocking(False)
            caller.connect_ex(place)
        error = refusal(f"tcp:127.0.0.1:{place[1]}")
        for caller in callers:
            caller.close()
    assert "does not answer within 0.2 s" in error.what
    assert "firewall" in error.remedy


def test_an_address_of_the_new_kind_stands_in_brackets():
    try:
        door = socket.create_server(("::1", 0), family=socket.AF_INET6)
    except OSError:
        pytest.skip("this machine has no IPv6")
    with door:
        open_source(f"tcp:[::1]:{door.getsockname()[1]}").close()
