"""The capture thread: owns port, decoder and pipeline state; publishes the newest as a value.

Everything else speaks to it through `Capture.send` and reads `Capture.newest` and
`Capture.drain`. What stops it is kept and shown; a device that goes away is looked for until it
is back, and a take goes on over the gap.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from typing import TypeVar

import msgspec

from handstudio import pipeline
from handstudio.device.addresses import open_source
from handstudio.device.health import HealthCount
from handstudio.device.host_clock import now_ns
from handstudio.device.orders import (
    Ask,
    Connect,
    Disconnect,
    Newest,
    Order,
    Phase,
    Report,
    SetHand,
    StartTake,
    StopTake,
    TakeDone,
)
from handstudio.device.recorder import Recorder
from handstudio.device.source import ByteSource, SourceLost
from handstudio.errors import DeviceError, HandstudioError
from handstudio.pipeline import Motion
from handstudio.protocol.codec import encode
from handstudio.protocol.packets import (
    Command,
    Description,
    ForeignVersion,
    Packet,
    Reply,
    Request,
)
from handstudio.recording.header import Header, Summary
from handstudio.recording.take import FirstState, pack_first_state
from handstudio.samples import Ranges
from handstudio.setup import HandModel, for_device
from handstudio.stream import EventStream

T = TypeVar("T")

READ_S = 0.02  # how long a read waits for the first byte, and so how soon a request is heard
SILENCE_S = 0.5  # without a byte for so long a streaming device counts as lost
REOPEN_S = 2.0  # a silent line is opened anew after this
RETRY_S = 0.25  # between attempts to reach a lost device
INTRODUCTION_S = 4.0  # a device that has not described itself by then is not one of ours
ASK_S = 0.5  # between two questions for a description
HISTORY = 2000  # motions kept for `drain`


@dataclass
class _Line:
    """The open line and what happened on it."""

    source: ByteSource
    opened: float
    asked: float = 0.0
    heard: float = 0.0  # last byte
    received: int = 0
    introduced: bool = False


@dataclass
class _Wanted:
    """The device that is to be used."""

    order: Connect
    try_at: float = 0.0
    was_there: bool = False


class Capture:
    """The capture thread and the doors to it."""

    def __init__(self) -> None:
        self.newest = Newest()
        self._orders: queue.SimpleQueue[Order | None] = queue.SimpleQueue()
        self._history: deque[Motion] = deque(maxlen=HISTORY)
        self._reports: deque[Report] = deque(maxlen=100)
        self._closing: list[Recorder] = []
        self._wanted: _Wanted | None = None
        self._line: _Line | None = None
        self._stream = EventStream("handstudio-1", None)
        self._state: pipeline.State | None = None
        self._count = HealthCount()
        self._at_start = HealthCount()  # counts when the take began
        self._tag = 0
        self._thread = threading.Thread(target=self._run, name="capture", daemon=True)

    # --- doors, for any thread ------------------------------------------------------------------

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def send(self, order: Order) -> None:
        """Ask for something; returns at once."""
        self._orders.put(order)

    def drain(self) -> list[Motion]:
        """The motions since the last call, oldest first; for one reader."""
        return _emptied(self._history)

    def reports(self) -> list[Report]:
        """What happened since the last call, oldest first; for one reader."""
        return _emptied(self._reports)

    def stop(self) -> None:
        """End the take, if one is on, and the thread; returns when both are done."""
        self._orders.put(None)
        if self._thread.is_alive():
            self._thread.join()

    # --- the thread -----------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            while self._obey():
                self._work()
        except Exception as error:  # a thread must not die unseen
            self._fail(
                HandstudioError(
                    f"The capture stopped: {type(error).__name__}: {error}.",
                    "Restart the studio and report this; the take was closed.",
                )
            )
            raise
        finally:
            self._stop_take()
            self._close()
            for recorder in self._closing:
                recorder.wait()
            self._collect()

    def _obey(self) -> bool:
        while True:
            try:
                order = self._orders.get_nowait()
            except queue.Empty:
                return True
            if order is None:
                return False
            self._follow(order)

    def _follow(self, order: Order) -> None:
        match order:
            case Connect():
                self._stop_take()
                self._close()
                self._stream = EventStream(order.decoder, None)
                self._state, self._count = None, HealthCount()
                self._wanted = _Wanted(order)
                self.newest = Newest(Phase.CONNECTING, order.address)
            case Disconnect():
                self._stop_take()
                self._close()
                self._wanted = None
                self.newest = Newest()
            case SetHand(hand=hand):
                self._set_hand(hand)
            case StartTake():
                self._start_take(order)
            case StopTake():
                self._stop_take()
            case Ask(command=command, argument=argument):
                self._ask(command, argument)

    def _work(self) -> None:
        if self._line is not None:
            self._listen(self._line)
        elif self._wanted is not None and time.monotonic() >= self._wanted.try_at:
            self._open(self._wanted)
        else:
            time.sleep(READ_S)
        self._collect()

    def _open(self, wanted: _Wanted) -> None:
        try:
            source = open_source(wanted.order.address)
        except HandstudioError as error:
            wanted.try_at = time.monotonic() + RETRY_S
            if not wanted.was_there:
                self._wanted = None
                self._fail(error)
            return
        now = time.monotonic()
        self._line = _Line(source, opened=now, heard=now)

    def _listen(self, line: _Line) -> None:
        try:
            self._introduce(line)
            chunk = line.source.read(READ_S)
        except SourceLost:
            self._lose()
            return
        if chunk:
            line.heard = time.monotonic()
            line.received += len(chunk)
            self._take_in(chunk, now_ns(), line)
        else:
            self._notice_silence(line)

    def _introduce(self, line: _Line) -> None:
        """Ask who is there until it says so; give up on a line that never does."""
        now = time.monotonic()
        if line.introduced or now - line.asked < ASK_S:
            return
        if now - line.opened > INTRODUCTION_S and self._wanted and not self._wanted.was_there:
            self._refuse(line)
            return
        line.asked = now
        self._ask(Command.DESCRIBE)

    def _refuse(self, line: _Line) -> None:
        heard = "nothing came" if line.received == 0 else f"{line.received} bytes came"
        self._give_up(
            DeviceError(
                f"{self.newest.address} did not say that it is a glove: {heard} within "
                f"{INTRODUCTION_S:.0f} s.",
                "Choose another port, switch the glove on, or choose the decoder it needs "
                "(handstudio/protocol/MAKERS.md).",
            )
        )

    def _take_in(self, chunk: bytes, arrival_ns: int, line: _Line) -> None:
        recorder = self.newest.recorder
        if recorder is not None:
            recorder.put(arrival_ns, chunk)
        packets, events = self._stream.feed(chunk, arrival_ns)
        self._count.note(packets, arrival_ns)
        for packet in packets:
            self._heed(packet, line)
        setup = self.newest.setup
        if setup is None or self._state is None or self._line is None:
            return
        motion, self._state = pipeline.run(setup, self._state, events)
        if len(motion) == 0:
            return
        if recorder is not None:
            recorder.put_motion(motion)
        self._history.append(motion)
        published = now_ns()
        self._count.note_latency((published - arrival_ns) * 1e-6)
        self.newest = replace(
            self.newest,
            phase=Phase.STREAMING,
            motion=motion[-1:],
            health=self._count.view(published),
            problem=None,
        )

    def _heed(self, packet: Packet, line: _Line) -> None:
        match packet:
            case Description():
                self._meet(packet, line)
            case ForeignVersion(version=version):
                self._give_up(
                    DeviceError(
                        f"{self.newest.address} speaks version {version} of the protocol; this "
                        "studio speaks version 1.",
                        "Update handstudio, or the device's firmware.",
                    )
                )
            case Reply():
                self.newest = replace(self.newest, last_reply=packet)
            case _:
                pass

    def _meet(self, description: Description, line: _Line) -> None:
        """A device described itself: the first one, the same again, or another."""
        wanted = self._wanted
        if wanted is None:
            return
        order = wanted.order
        setup = for_device(description, order.decoder, order.hand, order.side)
        if self.newest.recorder is not None and setup != self.newest.setup:
            self._put_off(description)
            return
        first = not line.introduced
        line.introduced = wanted.was_there = True
        if setup != self.newest.setup:
            self._stream.ranges = Ranges.of(description)
            self._state = pipeline.begin(setup)
            self._history.clear()
        self.newest = replace(self.newest, description=description, setup=setup, problem=None)
        if first:
            self._ask(Command.START)

    def _put_off(self, description: Description) -> None:
        """Another device, or other settings, in the middle of a take: not into the same file."""
        setup = self.newest.setup
        mine = setup.device.serial_number if setup and setup.device else "the one before"
        problem = DeviceError(
            f"Another device answers ({description.serial_number}, not {mine}), or its settings "
            "changed; the take waits.",
            f"Plug {mine} back in, or stop the take.",
        )
        self._lose()
        self.newest = replace(self.newest, problem=problem)

    def _notice_silence(self, line: _Line) -> None:
        quiet = time.monotonic() - line.heard
        if not line.introduced or quiet < SILENCE_S:
            return
        if quiet > REOPEN_S:
            self._lose()
        elif self.newest.phase is Phase.STREAMING:
            self.newest = replace(self.newest, phase=Phase.LOST)
            self._ask(Command.START)  # it may have restarted without a word

    def _lose(self) -> None:
        self._close()
        if self._wanted is None:
            return
        self._wanted.try_at = time.monotonic() + RETRY_S
        health = replace(self._count.view(now_ns()), rate_hz=0.0)
        if self._wanted.was_there:
            self.newest = replace(self.newest, phase=Phase.LOST, health=health)
        else:
            self._give_up(
                DeviceError(
                    f"{self.newest.address} closed the line before it said who it is.",
                    "Check that it is a glove and that nothing else uses it.",
                )
            )

    def _give_up(self, error: HandstudioError) -> None:
        self._close()
        self._wanted = None
        self._stop_take()
        self._fail(error)

    def _fail(self, error: HandstudioError) -> None:
        self.newest = Newest(Phase.FAILED, self.newest.address, problem=error)

    def _close(self) -> None:
        if self._line is None:
            return
        with contextlib.suppress(SourceLost):
            self._line.source.write(encode(Request(Command.STOP, 0)))
        self._line.source.close()
        self._line = None

    def _ask(self, command: int, argument: bytes = b"") -> None:
        if self._line is None:
            return
        self._tag = (self._tag + 1) % 256
        try:
            self._line.source.write(encode(Request(int(command), self._tag, argument)))
        except SourceLost:
            self._lose()

    # --- the take -------------------------------------------------------------------------------

    def _set_hand(self, hand: HandModel) -> None:
        """The hand decides nothing the pipeline remembers: its state goes on."""
        setup, wanted = self.newest.setup, self._wanted
        if wanted is None or self.newest.recorder is not None:
            return  # the setup of a take is fixed
        wanted.order = replace(wanted.order, hand=hand)
        if setup is not None:
            self.newest = replace(self.newest, setup=msgspec.structs.replace(setup, hand=hand))

    def _start_take(self, order: StartTake) -> None:
        setup = self.newest.setup
        if self.newest.recorder is not None:
            return
        if setup is None or self._state is None:
            self._reports.append(
                DeviceError("No device is connected.", "Connect one, then record.")
            )
            return
        first = FirstState(self._stream.save(), pipeline.pack(setup, self._state))
        header = Header(
            order.path.stem, order.subject, now_ns(), setup, "wire", self.newest.address
        )
        try:
            recorder = Recorder(order.path, header, pack_first_state(first))
        except HandstudioError as error:
            self._reports.append(error)
            return
        self._at_start = replace(self._count)
        self.newest = replace(self.newest, recorder=recorder)

    def _stop_take(self) -> None:
        recorder = self.newest.recorder
        if recorder is None:
            return
        recorder.stop(self._summary(recorder))  # it closes the file by itself: the line goes on
        self._closing.append(recorder)
        self.newest = replace(self.newest, recorder=None)

    def _summary(self, recorder: Recorder) -> Summary:
        health = self._count.view(now_ns())
        return Summary(
            chunks=recorder.chunks,
            bytes=recorder.bytes,
            duration_s=recorder.seconds,
            packets=health.packets - self._at_start.packets,
            missing=health.missing - self._at_start.missing,
            damaged=health.damaged - self._at_start.damaged,
            clock_offset_ns=health.offset_ns,
            clock_drift_ppm=health.drift_ppm,
        )

    def _collect(self) -> None:
        """Report takes that were closed; stop one whose file can no longer be written."""
        recorder = self.newest.recorder
        if recorder is not None and recorder.failure is not None:
            self._stop_take()
        for done in [recorder for recorder in self._closing if recorder.finished]:
            self._closing.remove(done)
            self._reports.append(done.failure or TakeDone(done.path))


def _emptied(values: deque[T]) -> list[T]:
    out: list[T] = []
    with contextlib.suppress(IndexError):
        while True:
            out.append(values.popleft())
    return out
