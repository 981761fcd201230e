"""The one owner of what the page shows: intents and reports go in, a state comes out.

Knows no viser; one thread calls `Studio.tick`, any thread may call `Studio.send`.
"""

from __future__ import annotations

import queue
import threading
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from app import intents
from app import live as live_history
from app import review as reviewing
from app.jobs import Jobs
from app.live import LiveHistory
from app.review import Review
from app.words import _
from handstudio.device import find
from handstudio.device.capture import Capture
from handstudio.device.find import Found
from handstudio.device.orders import (
    Ask,
    Connect,
    Disconnect,
    Newest,
    Phase,
    SetHand,
    StartTake,
    StopTake,
    TakeDone,
)
from handstudio.errors import HandstudioError
from handstudio.export.csv import Window
from handstudio.hand.skeleton import ADULT_HAND_LENGTH_M
from handstudio.kinematics import segment_attitudes
from handstudio.maths import so3
from handstudio.process import kept_motion
from handstudio.protocol.packets import TIP_SENSOR, Command
from handstudio.recording import library
from handstudio.recording.library import Entry
from handstudio.recording.recovery import recover
from handstudio.recording.take import Take, open_take
from handstudio.setup import HandModel

HAND_LENGTH_MM = (120.0, 240.0)
"""Plausible hand lengths, children to the largest adults [mm]."""

_BLINK_MS = 3000
_FORWARD = np.pi / 2  # the forearm points along y of the picture, away from the viewer


@dataclass(frozen=True, slots=True)
class Message:
    """Something to tell the person once."""

    text: str
    remedy: str = ""
    alarm: bool = False


@dataclass(frozen=True, slots=True)
class Download:
    """A file for one page."""

    page: int
    path: Path


@dataclass(frozen=True, slots=True)
class Work:
    """A job that runs, in words, and how far it is."""

    words: str
    share: float


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Everything the page is drawn from, besides the newest of the capture."""

    sessions: Path
    newest: Newest = Newest()
    subject: str = "S01"
    take_name: str = "take"
    hand_length_mm: float = ADULT_HAND_LENGTH_M * 1e3
    devices: tuple[Found, ...] = (find.VIRTUAL,)
    searching: bool = False
    takes: tuple[Entry, ...] = ()
    live: LiveHistory | None = None
    review: Review | None = None
    work: Work | None = None
    yaw: float | None = None  # turn of the picture about the vertical; None: find it anew
    messages: tuple[Message, ...] = ()
    downloads: tuple[Download, ...] = ()


@dataclass(frozen=True, slots=True)
class _ShowTake:
    take: Take


@dataclass(frozen=True, slots=True)
class _SendFile:
    page: int


@dataclass
class _Pending:
    """Work whose end is waited for."""

    future: Future[Any]
    then: _ShowTake | _SendFile
    words: str


@dataclass
class Studio:
    """The studio behind the page."""

    capture: Capture
    jobs: Jobs
    state: State
    _inbox: queue.SimpleQueue[intents.Intent | tuple[Found, ...]] = field(
        default_factory=queue.SimpleQueue
    )
    _pending: list[_Pending] = field(default_factory=list)

    def send(self, intent: intents.Intent) -> None:
        """Ask for something; returns at once. For any thread."""
        self._inbox.put(intent)

    def tick(self, elapsed_s: float) -> State:
        """Take in all that happened; the state afterwards."""
        self.state = replace(self.state, messages=(), downloads=())
        while True:
            try:
                item = self._inbox.get_nowait()
            except queue.Empty:
                break
            try:
                self._obey(item)
            except HandstudioError as error:
                self._say(error)
        self._hear_capture()
        self._finish_work()
        review = self.state.review
        if review is not None and review.playing:
            self.state = replace(self.state, review=reviewing.advanced(review, elapsed_s))
        self._face_once()
        return self.state

    def refresh_takes(self) -> None:
        """Read the library again."""
        self.state = replace(self.state, takes=tuple(library.entries(self.state.sessions)))

    # --- intents --------------------------------------------------------------------------------

    def _obey(self, intent: intents.Intent | tuple[Found, ...]) -> None:  # noqa: PLR0912 - a list
        match intent:
            case tuple():
                self.state = replace(self.state, devices=intent, searching=False)
            case intents.FindDevices():
                self._find()
            case intents.ConnectDevice(address=address):
                self.state = replace(self.state, live=None, yaw=None, review=None)
                self.capture.send(Connect(address, self._hand()))
            case intents.DisconnectDevice():
                self.capture.send(Disconnect())
                self.state = replace(self.state, live=None)
            case intents.BlinkSensor(name=name):
                self._blink(name)
            case intents.SetSubject(code=code):
                self.state = replace(self.state, subject=code)
            case intents.SetTakeName(name=name):
                self.state = replace(self.state, take_name=name)
            case intents.SetHandLength(mm=mm):
                self._set_hand_length(mm)
            case intents.ToggleRecording():
                self._toggle_recording()
            case intents.OpenTake(path=path):
                self._open(path)
            case intents.RecoverTake(path=path):
                self._recover(path)
            case intents.ShowLive():
                self.state = replace(self.state, review=None, yaw=None)
            case intents.Export(content=content, page=page):
                self._export(intents.Export(content, page))
            case intents.FaceForward():
                self.state = replace(self.state, yaw=None)
            case _:
                self._move(intent)

    def _move(self, move: intents.Move) -> None:
        review = self.state.review
        if review is None:
            return
        match move:
            case intents.TogglePlay():
                review = reviewing.toggled(review)
            case intents.Seek(at_s=at_s):
                review = reviewing.sought(review, at_s)
            case intents.Step(instants=instants):
                review = reviewing.stepped(review, instants)
            case intents.SetSpeed(factor=factor):
                review = replace(review, speed=factor)
            case intents.MarkIn():
                review = reviewing.marked_in(review)
            case intents.MarkOut():
                review = reviewing.marked_out(review)
            case intents.WholeTake():
                review = reviewing.whole(review)
            case intents.SetLoop(on=on):
                review = replace(review, loop=on)
        self.state = replace(self.state, review=review)

    def _find(self) -> None:
        if self.state.searching:
            return
        self.state = replace(self.state, searching=True)
        in_use = self.state.newest.address if self.state.newest.phase is not Phase.IDLE else ""

        def look() -> None:
            found = tuple(
                port if port.address == in_use else find.probe(port.address)
                for port in find.ports()
            )
            self._inbox.put((*found, find.VIRTUAL))

        threading.Thread(target=look, name="find devices", daemon=True).start()

    def _blink(self, name: str) -> None:
        number = TIP_SENSOR if name == "Tip" else int(name.removeprefix("SN"))
        argument = bytes([number]) + _BLINK_MS.to_bytes(2, "little")
        self.capture.send(Ask(Command.BLINK, argument))

    def _set_hand_length(self, mm: float) -> None:
        shortest, longest = HAND_LENGTH_MM
        self.state = replace(self.state, hand_length_mm=min(max(mm, shortest), longest))
        self.capture.send(SetHand(self._hand()))

    def _hand(self) -> HandModel:
        return HandModel(hand_length_m=self.state.hand_length_mm * 1e-3)

    def _toggle_recording(self) -> None:
        if self.state.newest.recorder is not None:
            self.capture.send(StopTake())
            return
        path = library.new_take_path(
            self.state.sessions,
            self.state.subject,
            self.state.take_name,
            datetime.now().astimezone(),
        )
        if self.state.review is not None:
            self.state = replace(self.state, review=None, yaw=None)
        self.capture.send(StartTake(path, self.state.subject))

    def _recover(self, path: Path) -> None:
        recovered = recover(path)
        text = _("Recovered {seconds:.1f} s as {name}.")
        self._tell(text.format(seconds=recovered.duration_s, name=recovered.path.stem))
        self.refresh_takes()
        self._open(recovered.path)

    def _open(self, path: Path) -> None:
        take = open_take(path)
        motion = kept_motion(take)
        if motion is not None:
            self._show(reviewing.opened(take, motion))
            return
        words = _("Computing the motion of {name}").format(name=path.stem)
        self._pending.append(_Pending(self.jobs.process(path), _ShowTake(take), words))

    def _show(self, review: Review) -> None:
        self.state = replace(self.state, review=review, yaw=None)

    def _export(self, order: intents.Export) -> None:
        review = self.state.review
        if review is None:
            return
        path = review.take.path
        target = path.with_suffix(f".{order.content}.csv")
        words = _("Exporting {name}").format(name=target.name)
        window = Window(review.in_s, review.out_s)
        future = self.jobs.export(path, target, order.content, window)
        self._pending.append(_Pending(future, _SendFile(order.page), words))

    # --- reports --------------------------------------------------------------------------------

    def _hear_capture(self) -> None:
        newest = self.capture.newest
        motions = self.capture.drain()
        live = self.state.live
        if newest.setup is not None:
            live = live_history.extended(live, newest.setup, motions)
        self.state = replace(self.state, newest=newest, live=live)
        for report in self.capture.reports():
            if isinstance(report, TakeDone):
                self._take_done(report.path)
            else:
                self._say(report)
                self.refresh_takes()

    def _take_done(self, path: Path) -> None:
        self.refresh_takes()
        self._tell(_("Recorded {name}.").format(name=path.stem))
        if self.state.newest.recorder is None:
            try:
                self._open(path)
            except HandstudioError as error:
                self._say(error)

    def _finish_work(self) -> None:
        for done in [pending for pending in self._pending if pending.future.done()]:
            self._pending.remove(done)
            try:
                self._use(done, done.future.result())
            except HandstudioError as error:
                self._say(error)
            except Exception as error:  # the job's process may have been killed
                self._say(
                    HandstudioError(
                        "{work}: {reason}",
                        "Try again; if it fails again, restart the studio.",
                        work=done.words,
                        reason=repr(error),
                    )
                )
        work = Work(self._pending[0].words, self.jobs.share_done) if self._pending else None
        self.state = replace(self.state, work=work)

    def _use(self, done: _Pending, result: object) -> None:
        match done.then:
            case _ShowTake(take=take):
                motion = kept_motion(take)
                if motion is not None:
                    self._show(reviewing.opened(take, motion))
            case _SendFile(page=page) if isinstance(result, Path):
                self._tell(_("Exported {path}.").format(path=result))
                downloads = (*self.state.downloads, Download(page, result))
                self.state = replace(self.state, downloads=downloads)
            case _:
                pass

    def _face_once(self) -> None:
        """Choose the turn of the picture when there is a first pose to choose it by."""
        if self.state.yaw is not None:
            return
        review, newest = self.state.review, self.state.newest
        if review is not None:
            setup, motion = review.setup, review.instant
        elif newest.setup is not None and newest.motion is not None:
            setup, motion = newest.setup, newest.motion
        else:
            return
        if not setup.layout.is_hand:
            self.state = replace(self.state, yaw=0.0)
            return
        q_world_forearm = segment_attitudes(setup, motion.q_world_sensor)[0, 0]
        along = so3.rotate(q_world_forearm, np.array([0.0, 1.0, 0.0]))
        self.state = replace(self.state, yaw=_FORWARD - float(np.arctan2(along[1], along[0])))

    def _tell(self, text: str) -> None:
        self.state = replace(self.state, messages=(*self.state.messages, Message(text)))

    def _say(self, error: HandstudioError) -> None:
        message = Message(error.what, error.remedy, alarm=True)
        self.state = replace(self.state, messages=(*self.state.messages, message))
