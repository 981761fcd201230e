"""The one owner of what the page shows: intents and reports go in, a state comes out.

Knows no viser; one thread calls `Studio.tick`, any thread may call `Studio.send`. What is to be
done is done by concerns: each is told of what is asked until one says that it was meant.
"""

from __future__ import annotations

import queue
from dataclasses import replace
from typing import Protocol

from app import intents
from app.board import Board
from app.devices.devices import Devices
from app.devices.filtering import Chooser, Prepared
from app.devices.looking import Looked
from app.devices.tracking import StreamsFound
from app.guidance.calibrating import Calibrator
from app.guidance.guide import Guide
from app.guidance.holding import Holder
from app.guidance.joint_finding import JointFinder
from app.pages import Pages
from app.preferences import Preferences
from app.review.files import Files
from app.review.measuring import Measuring
from app.review.opening import Opening
from app.review.playing import Playing
from app.review.reviewer import Reviewer
from app.state import State
from app.takes.keeping import Keeper
from app.takes.library import Library
from app.takes.notes import NoteTaker
from app.takes.people import People
from app.takes.recording import Recording
from app.takes.taker import Taker
from app.work.jobs import Jobs
from app.work.outcomes import Outcome
from app.work.workshop import Workshop
from handstudio.device.capture import Capture
from handstudio.device.orders import HeadingTaken, TakeDone
from handstudio.errors import HandstudioError
from handstudio.settings import SettingsStore


class Concern(Protocol):
    """Something that can be asked for."""

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        ...


class Orderer(Protocol):
    """Somebody who orders long work."""

    def done(self, outcome: Outcome) -> bool:
        """Take in what comes of it; False: it is about something else."""
        ...


class Studio:
    """The studio behind the page.

    Args:
        language: Asked for at the start; until another is chosen on the page.
    """

    def __init__(
        self,
        capture: Capture,
        jobs: Jobs,
        store: SettingsStore,
        state: State,
        language: str | None = None,
    ) -> None:
        self.capture, self.jobs, self.store = capture, jobs, store
        self._inbox: queue.SimpleQueue[intents.Intent | Looked | StreamsFound] = queue.SimpleQueue()
        self._board = board = Board(store, state)
        self._workshop = workshop = Workshop(jobs)
        self._chooser = Chooser(capture)
        self._devices = Devices(board, capture, self._chooser, self._inbox.put)
        self._pages = Pages(board, capture, self._devices, language)
        self._opening = opening = Opening(board, Reviewer(workshop), self._chooser)
        self._playing = Playing(board)
        measuring, files = Measuring(board, opening, workshop), Files(board, workshop)
        taker, keeper = Taker(capture, state.sessions), Keeper(state.sessions)
        self._recording = Recording(board, taker)
        self._library = Library(board, keeper, opening, workshop)
        people = People(board, capture, self._library, self._recording)
        calibrator = Calibrator(capture, taker, state.sessions)
        holder = Holder(capture, state.sessions)
        self._guide = Guide(board, capture, calibrator, holder, people, workshop)
        self._joints = JointFinder(board, workshop)
        self._concerns: tuple[Concern, ...] = (
            self._guide,  # first, as it may forbid
            self._joints,
            self._devices,
            self._recording,  # marks go into the take that is on, else beside the open one
            NoteTaker(board, keeper),
            opening,
            self._playing,
            measuring,
            files,
            self._library,
            people,
            self._pages,
            Preferences(board),
        )
        self._orderers: tuple[Orderer, ...] = (
            opening,
            measuring,
            files,
            self._library,
            self._guide,
            self._joints,
        )

    @property
    def state(self) -> State:
        """Everything the page is drawn from."""
        return self._board.state

    @state.setter
    def state(self, state: State) -> None:
        self._board.state = state

    def send(self, intent: intents.Intent) -> None:
        """Ask for something; returns at once. For any thread."""
        self._inbox.put(intent)

    def prepare(self, preparation: Prepared) -> None:
        """Use the whole-hand filter for hands once this has got it ready."""
        self._chooser.preparation = preparation

    def tick(self, elapsed_s: float) -> State:
        """Take in all that happened; the state afterwards."""
        self._board.begin_tick()
        self._hear_all()
        self._devices.take_in()
        self._take_in_reports()
        self._finish_work()
        self._recording.tick(elapsed_s)
        self._guide.tick(elapsed_s)
        self._joints.tick(elapsed_s)
        self._devices.tick(elapsed_s)
        self._playing.tick(elapsed_s)
        self._pages.tick()
        self._board.end_tick(elapsed_s)
        return self.state

    def end(self) -> None:
        """Let go of what threads of its own hold."""
        self._devices.end()

    def refresh_takes(self) -> None:
        """Read the library again."""
        self._library.refresh()

    def _hear_all(self) -> None:
        while True:
            try:
                item = self._inbox.get_nowait()
            except queue.Empty:
                return
            try:
                self._hear(item)
            except HandstudioError as error:
                self._board.say(error)
            self._library.show()

    def _hear(self, item: intents.Intent | Looked | StreamsFound) -> None:
        if isinstance(item, Looked | StreamsFound):
            self._devices.found(item)
            return
        for each in self._concerns:
            if each.hear(item):
                return

    def _take_in_reports(self) -> None:
        for report in self.capture.reports():
            match report:
                case TakeDone(path=path):
                    self._library.refresh()
                    if not self._guide.take_done(path):
                        self._library.recorded(path)
                case HeadingTaken(sensor=sensor):
                    self._devices.heading_taken(sensor)
                case HandstudioError():
                    self._guide.take_failed(report)
                    self._board.alarm(report)
                    self._library.refresh()

    def _finish_work(self) -> None:
        for outcome in self._workshop.done():
            if isinstance(outcome, HandstudioError):
                self._board.tell_why(outcome)
            else:
                any(each.done(outcome) for each in self._orderers)
            self._opening.complete()
        self.state = replace(self.state, work=self._workshop.work)
