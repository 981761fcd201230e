"""Why a serial port cannot be opened, and what to do about it, in words for a person."""

from __future__ import annotations

import contextlib
import errno
import getpass
import os
import stat
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from serial.tools import list_ports

from handstudio.errors import DeviceError

SEARCH_S = 0.5
"""How long we look for the program that has a port open."""

_MISSING = {errno.ENOENT, errno.ENXIO, errno.ENODEV, errno.ENOTDIR}
_REFUSED = {errno.EACCES, errno.EPERM}
_BUSY = {errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK}


@dataclass(frozen=True, slots=True)
class Rights:
    """Who may open the file of a port, and who we are.

    Attributes:
        group: Its group.
        group_may: The group may read and write.
        is_roots: The group is the administrator's own: joining it is no advice.
        we_act_for_it: This process acts for the group.
        we_are_listed: The system lists our account in it.
    """

    group: str
    group_may: bool
    is_roots: bool
    we_act_for_it: bool
    we_are_listed: bool


def cannot_open(port: str, error: Exception) -> DeviceError:
    """Put in words why this port did not open; looks at the system, within a second."""
    number, text = _number_of(error), str(error)
    match _kind_of(port):
        case "folder":
            return folder(port)
        case "file":
            return file(port)
        case None if number in _MISSING or _says(text, "No such", "FileNotFound"):
            return missing(port, present_ports())
    if sys.platform == "win32" and _says(text, "PermissionError", "Access is denied"):
        number = errno.EBUSY  # Windows says so of a port that is in use
    return _refused(port, number, text)


def _refused(port: str, number: int | None, text: str) -> DeviceError:
    """It is there and may be a port."""
    if number in _BUSY or _says(text, "busy", "lock", "temporarily unavailable"):
        return busy(port, program_at(port), _runs("ModemManager"))
    if number in _REFUSED or _says(text, "ermission"):
        return forbidden(port, rights_of(port))
    if number == errno.ENOTTY or _says(text, "Inappropriate ioctl"):
        return DeviceError(
            "{port} is a device, but not a serial port.",
            "Look for devices to see the ports there are.",
            port=port,
        )
    return DeviceError(
        "{port}: cannot be opened ({reason}).",
        "Unplug the device and plug it in.",
        port=port,
        reason=text,
    )


def missing(port: str, present: Iterable[str]) -> DeviceError:
    """There is no such port."""
    names = ", ".join(present)
    if not names:
        return DeviceError(
            "{port}: there is no such port, nor any other serial port.",
            "Plug the device in and switch it on; try another cable, as some carry power only.",
            port=port,
        )
    return DeviceError(
        "{port}: there is no such port.",
        "Plug the device in, or choose one that is there: {ports}.",
        port=port,
        ports=names,
    )


def folder(port: str) -> DeviceError:
    """A folder is there."""
    return DeviceError(
        "{port} is a folder, not a serial port.",
        "Look for devices to see the ports there are.",
        port=port,
    )


def file(port: str) -> DeviceError:
    """A file is there."""
    return DeviceError(
        "{port} is a file, not a serial port.",
        "Look for devices to see the ports there are; to play a take as a device, write "
        "replay:FILE.",
        port=port,
    )


def busy(port: str, program: str | None, modem_manager_runs: bool) -> DeviceError:
    """Another program has it open."""
    is_modem_like = "ttyACM" in port or "ttyUSB" in port
    suspected = program is None and modem_manager_runs and is_modem_like
    if suspected or (program or "").startswith("ModemManager"):
        return DeviceError(
            "{port}: another program has this port open, probably ModemManager, which tries new "
            "ports for modems.",
            "Wait half a minute and connect again. If it happens each time, and this computer has "
            "no modem: sudo systemctl disable --now ModemManager",
            port=port,
        )
    if program is not None:
        return DeviceError(
            "{port}: another program has this port open: {program}.",
            "Close that program, then connect.",
            port=port,
            program=program,
        )
    return DeviceError(
        "{port}: another program has this port open.",
        "Close that program, then connect.",
        port=port,
    )


def forbidden(port: str, rights: Rights | None) -> DeviceError:
    """We may not open it."""
    if rights is None or not rights.group_may or rights.is_roots or rights.we_act_for_it:
        return DeviceError(
            "{port}: you may not open this port.",
            "Ask whoever looks after this computer for the right to read and write it.",
            port=port,
        )
    if rights.we_are_listed:
        return DeviceError(
            "{port}: you may not open this port yet. You are in its group, {group}, but logged in "
            "before that.",
            "Log out and in again, or restart the computer; then start handstudio again.",
            port=port,
            group=rights.group,
        )
    return DeviceError(
        "{port}: you may not open this port. It belongs to the group {group}, and you are not in "
        "it.",
        "In a terminal: sudo usermod -aG {group} $USER. Then log out and in again.",
        port=port,
        group=rights.group,
    )


def present_ports() -> list[str]:
    """Serial ports that there are, the likely ones first; nothing is opened."""
    try:
        ports = sorted(list_ports.comports(), key=lambda port: (port.vid is None, port.device))
    except OSError:
        return []
    return [str(port.device) for port in ports[:8]]


def rights_of(port: str) -> Rights | None:
    """Who may open the file of a port; None where groups are not joined as on Linux."""
    if not sys.platform.startswith("linux"):
        return None
    import grp  # noqa: PLC0415 - not on Windows

    try:
        status = os.stat(port)  # noqa: PTH116 - a port is no path to pathlib on Windows
    except OSError:
        return None
    try:
        entry = grp.getgrgid(status.st_gid)
        name, members = entry.gr_name, entry.gr_mem
    except KeyError:
        name, members = str(status.st_gid), []
    both = stat.S_IRGRP | stat.S_IWGRP
    return Rights(
        group=name,
        group_may=status.st_mode & both == both,
        is_roots=status.st_gid == 0,
        we_act_for_it=status.st_gid in {os.getegid(), *os.getgroups()},
        we_are_listed=_account() in members,
    )


def program_at(port: str, within_s: float = SEARCH_S) -> str | None:
    """The program that has a port for itself, or open, where the system shows it to us."""
    if not sys.platform.startswith("linux"):
        return None
    process = _locker_of(port) or _opener_of(port, time.monotonic() + within_s)
    return None if process is None else _name_of(process)


def _locker_of(port: str) -> Path | None:
    """Who holds the lock on the port's file; shown to everybody, unlike who has it open."""
    with contextlib.suppress(OSError, ValueError):
        status = os.stat(port)  # noqa: PTH116
        device = f"{os.major(status.st_dev):02x}:{os.minor(status.st_dev):02x}:{status.st_ino}"
        for line in Path("/proc/locks").read_text().splitlines():
            fields = line.split()
            if len(fields) >= 6 and fields[1] == "FLOCK" and fields[5] == device:
                return Path("/proc") / fields[4]
    return None


def _opener_of(port: str, end: float) -> Path | None:
    target = os.path.realpath(port)
    for process in _processes():
        if time.monotonic() > end:
            return None
        with contextlib.suppress(OSError):  # somebody else's, or just ended
            for entry in (process / "fd").iterdir():
                if os.readlink(entry) == target:  # noqa: PTH115 - ten times as fast
                    return process
    return None


def _processes() -> Iterator[Path]:
    with contextlib.suppress(OSError):
        yield from (entry for entry in Path("/proc").iterdir() if entry.name.isdigit())


def _name_of(process: Path) -> str:
    number = process.name
    if int(number) == os.getpid():
        return "handstudio"
    with contextlib.suppress(OSError):
        return f"{(process / 'comm').read_text().strip()} ({number})"
    return number


def _runs(program: str) -> bool:
    for process in _processes():
        with contextlib.suppress(OSError):
            if (process / "comm").read_text().strip() == program:
                return True
    return False


def _kind_of(port: str) -> str | None:
    """What is at the place of a port: folder, file, other; None: nothing, or no place at all."""
    try:
        mode = os.stat(port).st_mode  # noqa: PTH116
    except (OSError, ValueError):
        return None
    if stat.S_ISDIR(mode):
        return "folder"
    return "file" if stat.S_ISREG(mode) else "other"


def _number_of(error: Exception) -> int | None:
    number = getattr(error, "errno", None)
    if number is None and error.args and isinstance(error.args[0], int):
        number = error.args[0]  # termios has no field for it
    return number


def _says(text: str, *words: str) -> bool:
    return any(word in text for word in words)


def _account() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""
