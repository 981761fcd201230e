"""A glove made of software: a process of its own that speaks the wire protocol.

``python -m handstudio.device.virtual_glove --help``. One line of JSON on standard output says
where it is: ``{"address": "serial:/dev/pts/3"}`` or ``{"address": "tcp:127.0.0.1:40123"}``.
It serves until told to stop: SIGINT, SIGTERM or, with ``--quit-with-parent``, the end of its input.
"""

from __future__ import annotations

import argparse
import json
import os
import secrets
import select
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol, runtime_checkable

from handstudio.device.lsl_outlet import LslOutlet
from handstudio.device.wearer import Wearer
from handstudio.errors import HandstudioError
from handstudio.layout import glove
from handstudio.recording.simulated import described, rehearse
from handstudio.simulation.firmware import RATES_HZ, Firmware
from handstudio.simulation.glove import Wire, WornGlove
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.streamed import STRENGTHS, Terminal

DEFAULT_STREAM = "handstudio virtual tracker"

_LONGEST_PAUSE_S = 0.1  # how long an order to stop may go unseen
_SHORTEST_PAUSE_S = 0.001  # a USB device is asked once a millisecond too
_RETRY_S = 0.002  # with a full line
_FASTEST = 4.0
_CATCH_UP = 100  # instants made in one go before the line is listened to again


@runtime_checkable
class Line(Protocol):
    """Where the bytes go; nothing here waits, except `wait`."""

    address: str

    def read(self) -> bytes | None:
        """What the host sent, maybe nothing; None where a host came or went."""

    def write(self, data: bytes) -> int:
        """Pass on what fits; how much that was [bytes]."""

    def wait(self, seconds: float) -> None:
        """Return after that time, or earlier: with something to read, or with room again."""

    def close(self) -> None:
        """Leave nothing behind."""


def serve(
    line: Line,
    firmware: Firmware,
    stop: threading.Event,
    speed: float = 1.0,
    tracker: Streaming | None = None,
) -> None:
    """Move bytes between a line and a firmware, in real time, until told to stop.

    Whatever is due is made, however late: the firmware's clock keeps pace with ours, or with
    ``speed`` times ours, for tests. A tracker beside it has the same clock.
    """
    began_ns = time.monotonic_ns()

    def now_us() -> int:
        return int((time.monotonic_ns() - began_ns) * speed) // 1000

    while not stop.is_set():
        # each instant is offered to the line before the next is made: the device would have sent
        # it in time, so being late must not fill its buffer
        for _ in range(_CATCH_UP):
            if firmware.next_due_us > now_us():
                break
            firmware.advance(firmware.next_due_us)
            _send(line, firmware)
        firmware.advance(min(now_us(), firmware.next_due_us - 1))
        heard = line.read()
        if heard is None:
            firmware.plugged_in()
        else:
            firmware.receive(heard)
        _send(line, firmware)
        if tracker is not None:
            tracker.tell(firmware.streams_since_us, now_us, speed)
        line.wait(_pause_s(firmware, now_us(), speed))


@dataclass(frozen=True, slots=True)
class Streaming:
    """A virtual tracker's terminal, and the stream that its poses go to."""

    terminal: Terminal
    outlet: LslOutlet

    def tell(self, since_us: int | None, now_us: Callable[[], int], speed: float) -> None:
        """Send what was told until now, while the glove streams since an instant of its clock."""
        if since_us is None:
            return
        for pose in self.terminal.due(now_us() - since_us):
            self.outlet.tell(pose, (now_us() - since_us - pose.told_us) * 1e-6 / speed)


def _tracker(asked: argparse.Namespace, worn: WornGlove) -> Streaming | None:
    if not asked.tracker:
        return None
    sensor = glove(asked.side).drivers[asked.tracker]
    terminal = Terminal(sensor, STRENGTHS[asked.tracker_errors], asked.seed)
    worn.watched_by(terminal.saw)
    name = asked.tracker_name or f"{DEFAULT_STREAM} {os.getpid()}"
    return Streaming(terminal, LslOutlet(name, asked.tracker))


def _send(line: Line, firmware: Firmware) -> None:
    while (waiting := firmware.outgoing) and (size := line.write(waiting)):
        firmware.taken(size)


def _pause_s(firmware: Firmware, now_us: int, speed: float) -> float:
    until_due = (firmware.next_due_us - now_us) * 1e-6 / speed
    longest = _RETRY_S if firmware.outgoing else _LONGEST_PAUSE_S
    return min(max(until_due, _SHORTEST_PAUSE_S), longest)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a virtual glove until told to stop."""
    asked = _parser().parse_args(arguments)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    if asked.quit_with_parent:
        threading.Thread(target=_stop_at_end_of_input, args=(stop,), daemon=True).start()
    epoch = secrets.randbits(32) if asked.epoch is None else asked.epoch
    try:
        rehearsed = rehearse(
            asked.subject,
            asked.motion,
            parse(asked.imperfections),
            asked.seed,
            side=asked.side,
            hand_length_m=asked.hand_length,
        )
        worn = WornGlove(rehearsed.worn, rehearsed.trajectory)
        tracker = _tracker(asked, worn)
    except HandstudioError as error:
        print(json.dumps({"problem": [str(error.what), str(error.remedy)]}), flush=True)
        raise SystemExit(1) from error
    told = described(rehearsed.subject, asked.seed, asked.rate, epoch)
    told = replace(told, name=asked.name) if asked.name else told
    wire = Wire(rehearsed.imperfections, rehearsed.seed)
    wearer = Wearer(rehearsed, worn)
    firmware = Firmware(told, worn.read, asked.tx_buffer, performer=wearer.asked, wire=wire.carry)
    with closing(_open(asked)) as line:
        print(json.dumps({"address": line.address}), flush=True)
        serve(line, firmware, stop, asked.speed, tracker)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="handstudio.device.virtual_glove", description=__doc__)
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--pty", action="store_true", help="a pseudo-terminal (default; not Windows)"
    )
    where.add_argument("--tcp", type=int, metavar="PORT", help="on 127.0.0.1; 0: any free port")
    parser.add_argument("--link", type=Path, metavar="PATH", help="name the pseudo-terminal so")
    parser.add_argument(
        "--rate", type=int, choices=RATES_HZ, default=100, help="to begin with [Hz]"
    )
    parser.add_argument("--seed", type=int, default=0, help="which glove: its noise and biases")
    parser.add_argument("--side", choices=("left", "right"), default="right")
    parser.add_argument("--subject", type=int, default=0, help="number of a person; 0: ideal")
    parser.add_argument("--motion", default="showcase", help="see handstudio motions")
    parser.add_argument("--imperfections", default="plain", help="ideal, plain, typical, harsh ...")
    parser.add_argument("--hand-length", type=float, help="[m], of the ideal person")
    parser.add_argument("--speed", type=_speed, default=1.0, help="of its clock, for tests: to 4")
    parser.add_argument("--tx-buffer", type=int, default=4096, help="[bytes]")
    parser.add_argument("--name", default="", help="instead of who wears it")
    parser.add_argument("--epoch", type=int, help="of this start; random unless given")
    parser.add_argument(
        "--tracker", choices=("hand", "forearm"), help="stream a tracker's terminal there, by LSL"
    )
    parser.add_argument("--tracker-name", default="", help="of that stream")
    parser.add_argument("--tracker-errors", choices=tuple(STRENGTHS), default="plain")
    parser.add_argument("--quit-with-parent", action="store_true", help="stop at end of input")
    return parser


def _speed(text: str) -> float:
    speed = float(text)
    if not 0.1 <= speed <= _FASTEST:
        raise argparse.ArgumentTypeError(f"from 0.1 to {_FASTEST:g}")
    return speed


def _open(asked: argparse.Namespace) -> Line:
    if asked.tcp is not None:
        return TcpLine(asked.tcp)
    if sys.platform == "win32":
        if asked.pty:
            raise SystemExit("Windows has no pseudo-terminals. Use --tcp 0.")
        return TcpLine(0)
    return PtyLine(asked.link)


def _stop_at_end_of_input(stop: threading.Event) -> None:
    # os.read, not sys.stdin: a thread that waits inside sys.stdin aborts the interpreter's exit
    while os.read(0, 4096):
        pass
    stop.set()


def _await(line: socket.socket | int, full: bool, seconds: float) -> None:
    select.select([line], [line] if full else [], [], seconds)


class TcpLine:
    """A port on this machine's own network; one host at a time."""

    _SEND_BUFFER = 16384  # as small as a device's; the default would hide seconds of a slow host

    def __init__(self, port: int) -> None:
        self._door = socket.create_server(("127.0.0.1", port))
        self._door.setblocking(False)
        self._host: socket.socket | None = None
        self._full = False
        self.address = f"tcp:127.0.0.1:{self._door.getsockname()[1]}"

    def read(self) -> bytes | None:
        """What the host sent, maybe nothing; None where a host came or went."""
        try:
            if self._host is None:
                self._host = self._accept()
                return None
            data = self._host.recv(4096)
        except BlockingIOError:
            return b""
        except ConnectionError:
            data = b""
        if not data:
            self._hang_up()
        return data or None

    def write(self, data: bytes) -> int:
        """Pass on what fits; nothing does while nobody is there."""
        if self._host is None:
            return 0
        try:
            size = self._host.send(data)
        except (BlockingIOError, ConnectionError):
            size = 0  # reading tells whether the host is gone
        self._full = size < len(data)
        return size

    def wait(self, seconds: float) -> None:
        """Return after that time, or earlier: with something to read, or with room again."""
        _await(self._host or self._door, self._full and self._host is not None, seconds)

    def close(self) -> None:
        """Hang up and free the port."""
        self._hang_up()
        self._door.close()

    def _accept(self) -> socket.socket:
        host, _ = self._door.accept()
        host.setblocking(False)
        host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        host.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, self._SEND_BUFFER)
        return host

    def _hang_up(self) -> None:
        if self._host is not None:
            self._host.close()
            self._host = None


if sys.platform != "win32":
    import tty

    class PtyLine:
        """A pseudo-terminal, raw, maybe under a name of its own choice."""

        def __init__(self, link: Path | None) -> None:
            # the host's end stays open here too: it then keeps its bytes and its raw mode while
            # no host is there, as a serial port does
            self._ours, self._hosts = os.openpty()
            tty.setraw(self._hosts)
            os.set_blocking(self._ours, False)
            self._path = os.ttyname(self._hosts)
            self._full = False
            self._link = link
            if link is not None:
                self._name(link)
            self.address = f"serial:{link or self._path}"

        def read(self) -> bytes | None:
            """What the host sent, maybe nothing."""
            try:
                return os.read(self._ours, 4096)
            except BlockingIOError:
                return b""

        def write(self, data: bytes) -> int:
            """Pass on what fits."""
            try:
                size = os.write(self._ours, data)
            except BlockingIOError:
                size = 0
            self._full = size < len(data)
            return size

        def wait(self, seconds: float) -> None:
            """Return after that time, or earlier: with something to read, or with room again."""
            _await(self._ours, self._full, seconds)

        def close(self) -> None:
            """Close both ends and take the name away, if it still is ours."""
            link = self._link
            if link is not None and link.is_symlink() and str(link.readlink()) == self._path:
                link.unlink()
            os.close(self._ours)
            os.close(self._hosts)

        def _name(self, link: Path) -> None:
            if link.exists() and not link.is_symlink():
                raise SystemExit(f"{link} is a file of somebody's. Choose another --link.")
            fresh = link.with_name(f"{link.name}.{os.getpid()}")
            fresh.symlink_to(self._path)
            fresh.replace(link)


if __name__ == "__main__":
    main()
