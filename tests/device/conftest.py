"""Gloves, lines and a hand on the capture, for tests of devices; nothing may outlive its test."""

from __future__ import annotations

import contextlib
import gc
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import msgspec
import numpy as np
import pytest

from handstudio.device.capture import Capture
from handstudio.device.orders import Connect, Newest, Order, Phase, Report, StartTake, StopTake
from handstudio.device.orders import TakeDone as Done
from handstudio.device.virtual_glove import Line, TcpLine, serve
from handstudio.health.findings import Kind
from handstudio.pipeline import Motion, join
from handstudio.process import kept_motion, process
from handstudio.recording.take import Take, open_take
from handstudio.recording.take_health import recomputed_health
from handstudio.simulation.firmware import Firmware
from handstudio.simulation.glove import description, plain_glove

Damage: TypeAlias = Callable[[bytes], bytes]

WITHIN_S = 20.0
"""How long anything may take on a machine that is busy with other tests."""

ROOM = 400_000
"""Transmit buffer of a glove [bytes] that a busy host does not make lose anything."""


def eventually(condition: Callable[[], object], what: str, within_s: float = WITHIN_S) -> None:
    """Wait until a condition holds. What a busy machine takes from us counts little."""
    waited_s, last = 0.0, time.monotonic()
    while not condition():
        assert waited_s < within_s, f"{what}: not within {within_s:g} s"
        time.sleep(0.005)
        waited_s += min(time.monotonic() - last, 0.02)
        last = time.monotonic()


# --- nothing is left behind -----------------------------------------------------------------------


@pytest.fixture(autouse=True)
def leaves_nothing_behind(tmp_path: Path) -> Iterator[None]:
    """No thread, process, socket, terminal or file of the test is open after it."""
    before = _alive(tmp_path)
    yield
    with contextlib.suppress(AssertionError):
        eventually(lambda: _alive(tmp_path) <= before, "the end", 5.0)
    gc.collect()
    left = _alive(tmp_path) - before
    assert not left, f"left behind: {left}"


def _alive(folder: Path) -> set[str]:
    threads = {f"thread {thread.name} {thread.ident}" for thread in threading.enumerate()}
    return threads | _open_files(folder) | {f"process {child}" for child in _children()}


def _open_files(folder: Path) -> set[str]:
    place = Path("/proc/self/fd")
    if not place.is_dir():
        return set()
    kinds = ("socket:", "pipe:", "/dev/pts/", "/dev/ptmx", str(folder))
    found = set()
    for entry in place.iterdir():
        with contextlib.suppress(OSError):
            target = str(entry.readlink())
            if target.startswith(kinds):
                found.add(f"file {entry.name} {target}")
    return found


def _children() -> set[int]:
    tasks = Path("/proc/self/task")
    found: set[int] = set()
    for task in tasks.iterdir() if tasks.is_dir() else ():
        with contextlib.suppress(OSError):  # a thread that ended meanwhile
            found |= {int(child) for child in (task / "children").read_text().split()}
    return found


@pytest.fixture
def new_child() -> Callable[[], int]:
    """``new_child()``: the one process that was started since."""
    if not Path("/proc/self/task").is_dir():
        pytest.skip("no /proc to find a process in")
    before = _children()

    def find() -> int:
        (child,) = _children() - before
        return child

    return find


# --- gloves ---------------------------------------------------------------------------------------


class GloveProcess:
    """A virtual glove in a process of its own, that can be killed, paused and started again."""

    def __init__(self, where: list[str], link: Path | None) -> None:
        self._where, self._link = where, link
        self._process: subprocess.Popen[bytes] | None = None
        self.address = ""

    def start(self, **options: object) -> None:
        """Switch it on, at the place it had before if it had one."""
        command = [sys.executable, "-m", "handstudio.device.virtual_glove", *self._where]
        for name, value in ({"tx_buffer": ROOM} | options).items():
            command += [f"--{name.replace('_', '-')}", str(value)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE)
        assert self._process.stdout is not None
        self.address = json.loads(self._process.stdout.readline())["address"]
        if self._where[0] == "--tcp":
            self._where = ["--tcp", self.address.rpartition(":")[2]]

    def kill(self) -> None:
        """Pull battery and plug at once."""
        if self._process is None:
            return
        self._process.kill()
        self._process.communicate()
        self._process = None
        if self._link is not None:  # the system takes a port away with its device
            self._link.unlink(missing_ok=True)

    def pause(self) -> None:
        """Stop the time of the glove."""
        assert self._process is not None
        self._process.send_signal(signal.SIGSTOP)

    def resume(self) -> None:
        """Let its time go on."""
        assert self._process is not None
        self._process.send_signal(signal.SIGCONT)


@pytest.fixture
def glove_process(tmp_path: Path) -> Iterator[Callable[..., GloveProcess]]:
    """``glove_process("pty" or "tcp", seed=3, rate=100, ...)``: a glove that runs."""
    gloves: list[GloveProcess] = []

    def make(kind: str = "pty", **options: object) -> GloveProcess:
        link = tmp_path / f"glove{len(gloves)}" if kind == "pty" else None
        gloves.append(GloveProcess(["--tcp", "0"] if link is None else ["--link", str(link)], link))
        gloves[-1].start(**options)
        return gloves[-1]

    yield make
    for glove in gloves:
        glove.kill()


class Glove:
    """A virtual glove in a thread of the test: as real a line, and sooner there."""

    def __init__(self, line: Line, firmware: Firmware) -> None:
        self.address, self.firmware = line.address, firmware
        self._line, self._off = line, threading.Event()
        self._thread = threading.Thread(target=self._run, name="glove")
        self._thread.start()

    def _run(self) -> None:
        with contextlib.closing(self._line):
            serve(self._line, self.firmware, self._off)

    def switch_off(self) -> None:
        """End it and take its port away."""
        self._off.set()
        self._thread.join()


@pytest.fixture
def glove(tmp_path: Path) -> Iterator[Callable[..., Glove]]:
    """``glove("pty" or "tcp", seed=3, rate=100, epoch=1, port=0)``: a glove that runs."""
    gloves: list[Glove] = []

    def make(
        kind: str = "pty", seed: int = 0, rate: int = 100, epoch: int = 1, port: int = 0
    ) -> Glove:
        worn = plain_glove("right", seed)
        told = description("right", seed, rate, epoch, "Virtual glove")
        line = TcpLine(port) if kind == "tcp" else _pty(tmp_path / "glove")
        gloves.append(Glove(line, Firmware(told, worn.read, ROOM)))
        return gloves[-1]

    yield make
    for one in gloves:
        one.switch_off()


def _pty(link: Path) -> Line:
    from handstudio.device.virtual_glove import PtyLine  # noqa: PLC0415 - not on Windows

    return PtyLine(link)


class Port:
    """A pseudo-terminal whose far end the test plays."""

    def __init__(self) -> None:
        import tty  # noqa: PLC0415 - not on Windows

        self._ours, self._hosts = os.openpty()
        tty.setraw(self._hosts)
        os.set_blocking(self._ours, False)
        self.place = os.ttyname(self._hosts)
        self.address = f"serial:{self.place}"
        self._off = threading.Event()
        self._thread: threading.Thread | None = None

    def say(self, data: bytes) -> int:
        """Send what fits."""
        if self._off.is_set():
            return 0
        try:
            return os.write(self._ours, data)
        except BlockingIOError:
            return 0

    def hear(self) -> bytes:
        """What the host has sent."""
        try:
            return os.read(self._ours, 4096)
        except BlockingIOError:
            return b""

    def keep_saying(self, more: Callable[[], bytes], every_s: float = 0.01) -> None:
        """Send something again and again from now on."""

        def run() -> None:
            while not self._off.wait(every_s):
                self.say(more())

        self._thread = threading.Thread(target=run, name="far end")
        self._thread.start()

    def unplug(self) -> None:
        """Take the port away."""
        self._off.set()
        if self._thread is not None:
            self._thread.join()
        self.hang_up()

    def hang_up(self) -> None:
        """The same, from within what is said."""
        self._off.set()
        if self._ours >= 0:
            os.close(self._ours)
            os.close(self._hosts)
            self._ours = self._hosts = -1


@pytest.fixture
def port() -> Iterator[Callable[[], Port]]:
    """``port()``: a port whose far end the test plays."""
    ports: list[Port] = []

    def make() -> Port:
        ports.append(Port())
        return ports[-1]

    yield make
    for one in ports:
        one.unplug()


class Proxy:
    """A socket between host and glove that changes what they say."""

    def __init__(self, address: str, damage: Damage, damage_commands: Damage) -> None:
        _, host, port = address.split(":")
        self._far, self._damage, self._damage_commands = (host, int(port)), damage, damage_commands
        self._door = socket.create_server(("127.0.0.1", 0))
        self._door.settimeout(0.05)
        self.address = f"tcp:127.0.0.1:{self._door.getsockname()[1]}"
        self._off = threading.Event()
        self._thread = threading.Thread(target=self._run, name="proxy")
        self._thread.start()

    def _run(self) -> None:
        while not self._off.is_set():
            with contextlib.suppress(TimeoutError):
                near, _ = self._door.accept()
                with near, socket.create_connection(self._far) as far:
                    self._pass_on(near, far)

    def _pass_on(self, near: socket.socket, far: socket.socket) -> None:
        near.settimeout(0.002)
        far.settimeout(0.002)
        while not self._off.is_set():
            for source, sink in ((near, far), (far, near)):
                try:
                    data = source.recv(65536)
                except TimeoutError:
                    continue
                except ConnectionError:
                    return
                if not data:
                    return
                with contextlib.suppress(ConnectionError):
                    change = self._damage if source is far else self._damage_commands
                    sink.sendall(change(data))

    def close(self) -> None:
        """Hang up."""
        self._off.set()
        self._thread.join()
        self._door.close()


@pytest.fixture
def proxy() -> Iterator[Callable[..., Proxy]]:
    """``proxy(address, damage, damage_commands)``: what is said goes through these."""
    proxies: list[Proxy] = []

    def make(address: str, damage: Damage = bytes, damage_commands: Damage = bytes) -> Proxy:
        proxies.append(Proxy(address, damage, damage_commands))
        return proxies[-1]

    yield make
    for one in proxies:
        one.close()


# --- the capture ----------------------------------------------------------------------------------


class Studio:
    """Drives a capture as the studio does, and keeps all it tells."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.capture = Capture()
        self.motions: list[Motion] = []
        self.reports: list[Report] = []
        self._address = ""
        self.capture.start()

    @property
    def newest(self) -> Newest:
        """What the capture knows now."""
        return self.capture.newest

    def send(self, order: Order) -> None:
        """Ask for something."""
        self.capture.send(order)

    def hear(self) -> None:
        """Take in what was told since."""
        motions, newest = self.capture.drain(), self.newest
        self.reports += self.capture.reports()
        if newest.address != self._address:  # another device: what came may be of either
            self._address = newest.address
            self.motions.clear()
        else:
            self.motions += motions

    def until(
        self, condition: Callable[[Newest], object], what: str, within_s: float = WITHIN_S
    ) -> Newest:
        """Wait until the newest is as it should be, and return that."""
        found: list[Newest] = []

        def holds() -> bool:
            self.hear()
            newest = self.newest
            found[:] = [newest]
            return bool(condition(newest))

        try:
            eventually(holds, what, within_s)
        except AssertionError as error:
            now = self.newest
            raise AssertionError(f"{error}; {now.phase}, {now.problem}, {now.health}") from None
        return found[0]

    def connect(self, address: str) -> Newest:
        """Use a device, and wait until it streams."""
        self.send(Connect(address))
        return self.until(
            lambda newest: newest.address == address and newest.phase is Phase.STREAMING,
            f"{address} streams",
        )

    def go_on(self, instants: int) -> None:
        """Wait for so many more instants."""
        self.hear()
        known = self.instants
        self.until(lambda _: self.instants >= known + instants, f"{instants} more instants")

    @property
    def instants(self) -> int:
        """How many came so far."""
        return sum(len(motion) for motion in self.motions)

    def start_take(self, name: str = "take") -> Path:
        """Record; the path the take will have."""
        path = self.folder / f"{name}.mcap"
        self.send(StartTake(path, "S01"))
        self.until(lambda newest: newest.recorder is not None, "a take is on")
        return path

    def stop_take(self) -> Take:
        """End the take; the take."""
        recorder = self.newest.recorder
        assert recorder is not None, "no take is on"
        self.send(StopTake())
        return self.take_done(recorder.path)

    def take_done(self, path: Path) -> Take:
        """The take that is reported as whole."""
        self.until(lambda _: Done(path) in self.reports, "the take is whole")
        return open_take(path)

    def check(self, take: Take, unheard: int = 0) -> Motion:
        """Live, kept and computed motion of a take are equal to the last bit; that motion.

        So is its health, but for how long the poses took. So many instants at the end need not have
        been heard live: where another filter begins, what nobody fetched by then is not shown.
        """
        self.hear()
        assert take.summary is not None
        assert take.summary.health is not None
        live = take.summary.health
        episodes = tuple(one for one in live.episodes if one.kind != Kind.LATE.value)
        unseen = msgspec.structs.replace(live, latency=None, episodes=episodes)
        assert recomputed_health(take) == unseen
        kept = kept_motion(take)
        assert kept is not None, "the live motion was not kept"
        kept = Motion(*(np.array(getattr(kept, name)) for name in _FIELDS))
        shutil.rmtree(take.path.with_suffix(".motion"))
        computed = process(take)
        assert_equal_to_the_last_bit(kept, computed)
        live = join(self.motions)
        assert (np.diff(live.time_us) > 0).all()
        first = int(np.searchsorted(live.time_us, computed.time_us[0]))
        heard = len(computed)
        if unheard:
            heard = int(np.isin(computed.time_us, live.time_us).sum())
            assert heard >= len(computed) - unheard
        assert_equal_to_the_last_bit(live[first : first + heard], computed[:heard])
        return computed


_FIELDS = ("time_us", "q_world_sensor", "q_world_start", "doubt", "sd_rad")


def assert_equal_to_the_last_bit(a: Motion, b: Motion) -> None:
    """Two motions are the same numbers, NaN included."""
    assert len(a) == len(b)
    for name in _FIELDS:
        left, right = np.asarray(getattr(a, name)), np.asarray(getattr(b, name))
        assert left.dtype == right.dtype
        assert left.tobytes() == right.tobytes(), f"{name} differs"


@pytest.fixture
def studio(tmp_path: Path) -> Iterator[Studio]:
    """A capture that runs, and somebody who listens to it."""
    studio = Studio(tmp_path)
    yield studio
    studio.capture.stop()
