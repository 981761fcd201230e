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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import msgspec
import numpy as np

from handstudio import alignment, pipeline
from handstudio.device.addresses import open_source
from handstudio.device.health import HealthKeeper
from handstudio.device.host_clock import now_ns
from handstudio.device.known import Known
from handstudio.device.line import READ_S, Line, stranger
from handstudio.device.orders import (
    Ask,
    Connect,
    Disconnect,
    HeadingTaken,
    Moved,
    Newest,
    NotePage,
    Order,
    Phase,
    Report,
    ResetHeading,
    SetFilter,
    SetHand,
    SetHeading,
    SetSensors,
    SetSubject,
    SetTracker,
    ShareMoves,
    ShareSamples,
    StartTake,
    StopTake,
    TakeDone,
)
from handstudio.device.recorder import Recorder
from handstudio.device.source import SourceLost
from handstudio.errors import DeviceError, HandstudioError
from handstudio.pipeline import Doubt, Motion
from handstudio.protocol.packets import (
    Command,
    Description,
    ForeignVersion,
    Packet,
    Reply,
    Restart,
    Result,
)
from handstudio.recording.header import Header, with_tracker
from handstudio.recording.take import FirstState, pack_first_state
from handstudio.recording.tracker_message import TrackerFacts
from handstudio.samples import Event, ImuSamples, Ranges
from handstudio.setup import HandModel, Setup, for_device
from handstudio.stream import EventStream

T = TypeVar("T")

SILENCE_S = 0.5  # without motion for so long a streaming device counts as lost
REOPEN_S = 2.0  # a line without a byte is opened anew after this
RETRY_S = 0.25  # between attempts to reach a lost device
INTRODUCTION_S = 4.0  # a device that has not described itself by then is not one of ours
HISTORY = 2000  # motions kept for `drain`, and runs of samples for `drain_samples`
_OUR_OWN = (Command.DESCRIBE, Command.START, Command.STOP)  # asked by us, not by a person


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
        self._samples: deque[ImuSamples] | None = None  # only while somebody wants them
        self._moves: deque[Moved] | None = None  # likewise
        self._reports: deque[Report] = deque(maxlen=100)
        self._closing: list[Recorder] = []
        self._wanted: _Wanted | None = None
        self._known = Known()
        self._waiting: Known | None = None  # what is known since the take began
        self._tracker: TrackerFacts | None = None
        self._line: Line | None = None
        self._stream = EventStream("handstudio-1", None)
        self._state: pipeline.State | None = None
        self._health = HealthKeeper()
        self._thread = threading.Thread(target=self._run, name="capture", daemon=True)

    # --- doors, for any thread ------------------------------------------------------------------

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def send(self, order: Order) -> None:
        """Ask for something; returns at once."""
        self._orders.put(order)

    def recorder(self) -> Recorder | None:
        """The take that is on."""
        return self.newest.recorder

    def drain(self) -> list[Motion]:
        """The motions since the last call, oldest first; for one reader."""
        return _emptied(self._history)

    def drain_samples(self) -> list[ImuSamples]:
        """The samples since the last call, oldest first; for one reader, who asked for them.

        Their time axis is that of the motions: it goes on where a device began anew.
        """
        samples = self._samples
        return [] if samples is None else _emptied(samples)

    def drain_moves(self) -> list[Moved]:
        """What every chunk told since the last call, oldest first; for one reader, who asked."""
        moves = self._moves
        return [] if moves is None else _emptied(moves)

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
            self._give_up(
                HandstudioError(
                    "The capture stopped: {kind}: {reason}.",
                    "Restart the studio and report this; the take was closed.",
                    kind=type(error).__name__,
                    reason=error,
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

    def _follow(self, order: Order) -> None:  # noqa: PLR0912 - a list
        match order:
            case Connect():
                self._let_go()
                self._connect(order)
            case Disconnect():
                self._let_go()
                self.newest = Newest()
            case SetHand(hand=hand):
                self._set_hand(hand)
            case StartTake():
                self._start_take(order)
            case StopTake():
                self._stop_take()
            case NotePage(ms=ms):
                self._health.note_page(ms)
            case Ask():
                self._pass_on(order)
            case ShareSamples(on=on):
                self._samples = deque(maxlen=HISTORY) if on else None
            case ShareMoves(on=on):
                self._moves = deque(maxlen=HISTORY) if on else None
            case SetSubject(calibration=calibration):
                self._learn(replace(self._newly_known, subject=calibration))
            case SetSensors(errors=errors):
                self._learn(replace(self._newly_known, sensors=errors))
            case SetFilter(filter=chosen):
                self._learn(replace(self._newly_known, filter=chosen))
            case SetTracker(facts=facts):
                self._tracker = facts
            case SetHeading(headings=headings):
                self._turn_to(headings)
            case ResetHeading(sensor=sensor):
                self._reset_heading(sensor)

    def _let_go(self) -> None:
        self._stop_take()
        self._close()
        self._wanted = None

    def _connect(self, order: Connect) -> None:
        self.newest = Newest(Phase.CONNECTING, order.address)
        self._state, self._health = None, HealthKeeper()
        self._known = replace(self._known, heading_rad=())
        try:
            self._stream = EventStream(order.decoder, None)
        except HandstudioError as error:
            self._fail(error)
            return
        self._wanted = _Wanted(order)

    def _pass_on(self, order: Ask) -> None:
        if order.command == Command.SET_RATE and self.newest.recorder is not None:
            self._reports.append(
                DeviceError("The rate stays while a take is recorded.", "Stop the take first.")
            )
            return
        try:
            self._ask(order.command, order.argument)
        except ValueError as error:
            self._reports.append(
                DeviceError(
                    "No such command can be sent: {reason}.", "Correct the command.", reason=error
                )
            )

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
        self._line = Line(source, wanted.order.decoder)

    def _listen(self, line: Line) -> None:
        try:
            chunk = line.read()
        except SourceLost:
            self._lose()
            return
        if chunk and line.introduced:
            self._take_in(chunk, now_ns(), line)
        elif chunk:
            self._find_out(chunk, now_ns(), line)
        if line is self._line:
            self._keep_asking(line)

    def _keep_asking(self, line: Line) -> None:
        """Ask who is there until it says so, and for motion until it comes; give up at last."""
        now = time.monotonic()
        streaming = self.newest.phase is Phase.STREAMING
        if streaming and now - line.moved > self._patience_s:
            self._show_lost()
        if line.introduced:
            if now - line.heard > REOPEN_S:
                self._lose()
            elif now - line.moved > self._patience_s:
                self._ask_again(Command.START)
                self._say_that_it_rests(now - line.moved)
        elif now - line.opened <= INTRODUCTION_S:
            self._ask_again(Command.DESCRIBE)
        elif self._wanted and self._wanted.was_there:
            self._lose()
        else:
            self._refuse(line)

    def _say_that_it_rests(self, still_s: float) -> None:
        if still_s > INTRODUCTION_S and self.newest.problem is None:
            problem = DeviceError(
                "{glove} is there but sends no motion; it is asked to twice a second.",
                "Switch the glove off and on.",
                glove=_serial_number(self.newest.setup),
            )
            self.newest = replace(self.newest, problem=problem)

    @property
    def _patience_s(self) -> float:
        """How long a device may be still before it counts as lost: three of its periods."""
        setup = self.newest.setup
        return SILENCE_S if setup is None else max(SILENCE_S, 3.0 / setup.rate_hz)

    def _refuse(self, line: Line) -> None:
        self._give_up(stranger(line, self.newest.address, INTRODUCTION_S))

    def _find_out(self, chunk: bytes, arrival_ns: int, line: Line) -> None:
        """Nothing enters a take or the pipeline before it is known from whom it is."""
        for packet in line.hold(arrival_ns, chunk):
            if isinstance(packet, Description | ForeignVersion):
                self._heed(packet, line)
            if line is not self._line:
                return
        if line.introduced:
            for held_ns, held in line.release():
                self._take_in(held, held_ns, line)

    def _take_in(self, chunk: bytes, arrival_ns: int, line: Line) -> None:
        """Record, decode and fuse: all three or none, so that `process` gives the same motion."""
        if line is not self._line:
            return
        recorder = self.newest.recorder
        if recorder is not None and not recorder.put(arrival_ns, chunk):
            self._stop_take()  # before what is not in it is counted as if it were
        packets, events = self._stream.feed(chunk, arrival_ns)
        if self.newest.setup is not None and self._state is not None:
            motion, self._state = pipeline.run(self.newest.setup, self._state, events)
            if len(motion):
                self._publish(motion, arrival_ns, line)
                self._share(arrival_ns, motion, events)
        self._health.note(packets, events, arrival_ns)  # after the pose: nobody waits for it
        for packet in packets:
            self._heed(packet, line)

    def _publish(self, motion: Motion, arrival_ns: int, line: Line) -> None:
        line.moved = time.monotonic()
        if self.newest.recorder is not None:
            self.newest.recorder.put_motion(motion)
        self._history.append(motion)
        self._health.note_published(arrival_ns, now_ns())
        self.newest = replace(
            self.newest,
            phase=Phase.STREAMING,
            motion=motion[-1:],
            health=self._health.view,
            findings=self._health.findings,
            problem=None,
        )

    def _share(self, arrival_ns: int, motion: Motion, events: Sequence[Event]) -> None:
        """Samples for whoever wants them, on the time axis of the motion."""
        samples, moves, setup = self._samples, self._moves, self.newest.setup
        if (samples is None and moves is None) or setup is None:
            return
        runs = [event for event in events if isinstance(event, ImuSamples)]
        if sum(map(len, runs)) != len(motion):
            return
        at, timed = 0, list[ImuSamples]()
        for run in runs:
            timed.append(replace(run, time_us=motion.time_us[at : at + len(run)]))
            at += len(run)
        if samples is not None:
            samples.extend(timed)
        if moves is not None:
            moves.append(Moved(arrival_ns, setup, motion, tuple(timed)))

    def _heed(self, packet: Packet, line: Line) -> None:
        if line is not self._line:
            return  # something before it made us hang up
        match packet:
            case Restart():
                line.forget()
            case Description():
                self._meet(packet, line)
            case ForeignVersion(version=version):
                self._give_up(
                    DeviceError(
                        "{address} speaks version {version} of the protocol; this studio speaks "
                        "version 1.",
                        "Update handstudio, or the device's firmware.",
                        address=self.newest.address,
                        version=version,
                    )
                )
            case Reply():
                self.newest = replace(self.newest, last_reply=packet)
                self._hear_reply(packet)
            case _:
                pass

    def _hear_reply(self, reply: Reply) -> None:
        """Tell what a person asked for and the device will not do; the rest is asked again."""
        if reply.result == Result.OK or reply.command in _OUR_OWN:
            return
        self._reports.append(
            DeviceError(
                "The device will not do that: {why}.",
                "Ask for something else.",
                why=reply.text.rstrip(".") or Result(reply.result).name,
            )
        )

    def _meet(self, description: Description, line: Line) -> None:
        """A device described itself: the first one, the same again, or another."""
        wanted = self._wanted
        if wanted is None:
            return
        order = wanted.order
        try:
            setup = for_device(description, order.decoder, order.hand, order.side)
            setup, unfit = self._known.on(setup)
        except HandstudioError as error:
            self._give_up(error)
            return
        if self.newest.recorder is not None and setup != self.newest.setup:
            self._put_off(setup)
            return
        first = not line.introduced
        if first and unfit is not None:
            self._reports.append(unfit)
        line.introduced = wanted.was_there = True
        if setup != self.newest.setup:
            self._stream.ranges = Ranges.of(description)
            self._begin_anew(setup)
        self.newest = replace(self.newest, description=description, setup=setup, problem=None)
        if first:
            line.moved = time.monotonic()
            self._ask(Command.START)

    def _begin_anew(self, setup: Setup) -> None:
        self._state = pipeline.begin(setup)
        self._history.clear()
        self._health.meet(setup)

    def _put_off(self, other: Setup) -> None:
        """Another device, or other settings, in the middle of a take: not into the same file."""
        problem = _take_waits(_serial_number(self.newest.setup), _serial_number(other))
        self._lose()
        self.newest = replace(self.newest, problem=problem)

    def _lose(self) -> None:
        self._close()
        if self._wanted is None:
            return
        self._wanted.try_at = time.monotonic() + RETRY_S
        if self._wanted.was_there:
            self._show_lost()
        else:
            self._give_up(
                DeviceError(
                    "{address} closed the line before it said who it is.",
                    "Check that it is a glove and that nothing else uses it.",
                    address=self.newest.address,
                )
            )

    def _show_lost(self) -> None:
        self._health.renew(now_ns())
        health = replace(self._health.view, rate_hz=0.0)
        self.newest = replace(self.newest, phase=Phase.LOST, health=health, findings=())

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
        line, self._line = self._line, None
        with contextlib.suppress(SourceLost):
            line.ask(Command.STOP)
        line.close()

    def _ask(self, command: int, argument: bytes = b"") -> None:
        if self._line is None:
            return
        try:
            self._line.ask(command, argument)
        except SourceLost:
            self._lose()

    def _ask_again(self, command: Command) -> None:
        if self._line is None:
            return
        try:
            self._line.ask_again(command)
        except SourceLost:
            self._lose()

    # --- what is known of wearer and glove ------------------------------------------------------

    @property
    def _newly_known(self) -> Known:
        return self._waiting or self._known

    def _learn(self, known: Known) -> None:
        """Use calibrations and filter from now on; a take keeps those that it began with."""
        setup = self.newest.setup
        if setup is None:
            self._known = known
            return
        other, unfit = known.on(setup)
        if self.newest.recorder is not None:
            self._waiting = known
            if other != setup:
                calibrations = msgspec.structs.replace(other, filter=setup.filter) != setup
                self._reports.append(_calibration_waits() if calibrations else _filter_waits())
            return
        self._known = known
        if unfit is not None:
            self._reports.append(unfit)
        # what a filter remembers is of other readings, or another filter's
        if (other.sensors, other.filter) != (setup.sensors, setup.filter):
            self._begin_anew(other)
        elif other.subject != setup.subject and self._state is not None:
            self._state = pipeline.rejoined(other, self._state)
        if other != setup:
            self.newest = replace(self.newest, setup=other)

    def _turn_to(self, headings: tuple[float, ...]) -> None:
        """The pipeline's state goes on, turned where its filter has all sensors in one world."""
        setup = self.newest.setup
        if self.newest.recorder is not None:
            self._reports.append(_heading_stays())
        elif setup is not None:
            self._known = replace(self._known, heading_rad=tuple(map(float, headings)))
            after, _ = self._known.on(setup)
            motion = self.newest.motion
            if motion is not None:
                motion = pipeline.with_headings(alignment.between(setup, after), motion)
            if self._state is not None:
                self._state = pipeline.reheaded(setup, after, self._state)
            self.newest = replace(self.newest, setup=after, motion=motion)

    def _reset_heading(self, sensor: str | None) -> None:
        setup, motion = self.newest.setup, self.newest.motion
        if self.newest.recorder is not None:
            self._reports.append(_heading_stays())
            return
        if setup is None or motion is None:
            self._reports.append(
                DeviceError("No hand is shown yet.", "Connect a glove, then reset the heading.")
            )
            return
        placed = (motion.doubt[-1] & np.uint8(Doubt.UNPLACED)) == 0
        try:
            turned = alignment.reset(setup, motion.q_world_sensor[-1], sensor, placed)
        except HandstudioError as error:
            self._reports.append(error)
            return
        self._turn_to(turned.heading_rad)
        self._reports.append(HeadingTaken(sensor))

    # --- the take -------------------------------------------------------------------------------

    def _set_hand(self, hand: HandModel) -> None:
        """Of what the pipeline remembers only what it learnt of the joints is this hand's."""
        setup, wanted = self.newest.setup, self._wanted
        if wanted is None or self.newest.recorder is not None:
            return  # the setup of a take is fixed
        wanted.order = replace(wanted.order, hand=hand)
        if setup is not None and hand != setup.hand:
            other = msgspec.structs.replace(setup, hand=hand)
            if self._state is not None:
                self._state = pipeline.rejoined(other, self._state)
            self.newest = replace(self.newest, setup=other)

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
        header = with_tracker(header, self._tracker)
        try:
            recorder = Recorder(order.path, header, pack_first_state(first))
        except HandstudioError as error:
            self._reports.append(error)
            return
        self._health.begin_take()
        self.newest = replace(self.newest, recorder=recorder)

    def _stop_take(self) -> None:
        recorder = self.newest.recorder
        if recorder is None:
            return
        # it closes the file by itself: the line goes on
        recorder.stop(self._health.summary(recorder.seconds, now_ns()))
        self._closing.append(recorder)
        self.newest = replace(self.newest, recorder=None)
        if self._waiting is not None:
            known, self._waiting = self._waiting, None
            self._learn(known)

    def _collect(self) -> None:
        """Report takes that were closed; stop one whose file can no longer be written."""
        recorder = self.newest.recorder
        if recorder is not None and recorder.failure is not None:
            self._stop_take()
        for done in [recorder for recorder in self._closing if recorder.finished]:
            self._closing.remove(done)
            self._reports.append(done.failure or TakeDone(done.path))


def _calibration_waits() -> DeviceError:
    return DeviceError(
        "Another calibration is there: the take keeps the one it began with.",
        "The other one is used once the take is over.",
    )


def _filter_waits() -> DeviceError:
    return DeviceError(
        "Another filter was chosen: the take keeps the one it began with.",
        "The other filter is used once the take is over.",
    )


def _heading_stays() -> DeviceError:
    return DeviceError("The heading stays while a take is recorded.", "Stop the take first.")


def _take_waits(mine: str, other: str) -> DeviceError:
    if mine == other:
        return DeviceError(
            "{mine} came back with other settings: the take waits.",
            "Set it as it was, or stop the take.",
            mine=mine,
        )
    return DeviceError(
        "Another device answers ({other}, not {mine}): the take waits.",
        "Plug {mine} back in, or stop the take.",
        mine=mine,
        other=other,
    )


def _serial_number(setup: Setup | None) -> str:
    return setup.device.serial_number if setup and setup.device else "?"


def _emptied(values: deque[T]) -> list[T]:
    out: list[T] = []
    with contextlib.suppress(IndexError):
        while True:
            out.append(values.popleft())
    return out
