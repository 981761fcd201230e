"""Guided courses from the person's side: begun, gone on with, left, and their results used."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from app import intents
from app.board import Board
from app.guidance.calibrating import Calibrator
from app.guidance.holding import Holder
from app.takes.people import People
from app.words import _
from app.work.outcomes import Outcome, Solved
from app.work.solving import Answer
from app.work.workshop import Workshop
from handstudio.calibrate import Calibrated
from handstudio.calibrate_sensors import SensorsFound
from handstudio.calibration.heading import HeadingAlignment
from handstudio.device.capture import Capture
from handstudio.device.orders import SetHeading
from handstudio.errors import HandstudioError
from handstudio.setup import Setup
from handstudio.wizards.course import Next, Redo

_ONCE_S = 0.4  # the space bar is a key of the page, and also presses the button clicked last


@dataclass
class Guide:
    """Owner of what the state tells of courses, and of the calibrations in use.

    It must hear before others do: while a course is on, some of what is asked means it.
    """

    board: Board
    capture: Capture
    calibrator: Calibrator
    holder: Holder
    people: People
    workshop: Workshop
    _told_s: float = -1.0
    _solving: bool = False  # a calibration was ordered
    _stands_for: tuple[str, Setup | None, bool] | None = None

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        heard = self._hear_of_the_one_on(intent) or self._hear_of_any(intent)
        if heard:
            self._show()
        return heard

    def done(self, outcome: Outcome) -> bool:
        """Use what was computed; False: it is about something else."""
        match outcome:
            case Solved(answer=answer):
                self._solving = False
                self.calibrator.solved(answer)
                self._use(answer)
            case _:
                return False
        return True

    def take_done(self, path: Path) -> bool:
        """A take is whole; whether it was one of a course."""
        return self.calibrator.take_done(path)

    def take_failed(self, error: HandstudioError) -> None:
        """A take could not be written."""
        self.calibrator.take_failed(error)

    def tick(self, elapsed_s: float) -> None:
        """So much later; what a course was for is ordered once its takes are whole."""
        board, calibrator = self.board, self.calibrator
        try:
            board.sound_all(calibrator.tick(elapsed_s, board.state))
        except HandstudioError as error:
            board.alarm(error)
        takes, result = calibrator.to_solve(), calibrator.result
        if takes and result is not None and not self._solving:
            self._solving = True
            course, sessions = result.course.name, board.state.sessions
            self.workshop.solve(course, takes, sessions, calibrator.hand_type)
        self._show()
        for problem in self.holder.follow(board.state):
            board.say(problem)
        board.state = replace(board.state, in_use=self.holder.in_use)

    def _hear_of_the_one_on(self, intent: intents.Intent) -> bool:
        calibrator, settings = self.calibrator, self.board.settings
        on, over = calibrator.guided is not None, calibrator.result is not None
        match intent:
            case intents.Guide(event=event):
                if not self._twice():
                    self.board.sound_all(calibrator.hear(event, settings))
            case intents.GoOn() if on:
                if not self._twice():
                    self.board.sound_all(calibrator.hear(Next(), settings))
            case intents.GoOn() if over and not self._twice():
                self._close_result()
            case intents.RedoStep(index=index) if on:
                self.board.sound_all(calibrator.hear(Redo(index), settings))
            case intents.ToggleRecording() | intents.LeaveCourse() if on:
                calibrator.leave()
                self.board.tell(_("The course waits under Calibrate; what was done is kept."))
            case intents.OpenTake() | intents.ChooseSubject() | intents.DeleteSubject() if on:
                raise HandstudioError(
                    "A course of calibration is on.", "Leave it first; it can be gone on with."
                )
            case _:
                return False
        return True

    def _hear_of_any(self, intent: intents.Intent) -> bool:
        match intent:
            case intents.BeginCourse():
                self._begin(intent)
            case intents.SaveSubject(then_begin=course) if course:
                self.people.hear(intent)
                self._begin(intents.BeginCourse(course))
            case intents.RedoStep(index=index):
                self.calibrator.redo(index, self.board.state, self.board.settings)
            case intents.CloseResult():
                self._close_result()
            case intents.UseCalibration(which=which):
                self.holder.use(which)
            case _:
                return False
        return True

    def _twice(self) -> bool:
        """Whether this is the space bar again, as the click of the button that has the focus."""
        now_s = self.board.now_s
        twice = now_s - self._told_s < _ONCE_S
        self._told_s = self._told_s if twice else now_s
        return twice

    def _begin(self, order: intents.BeginCourse) -> None:
        board = self.board
        if board.state.can_record and board.state.subject is None:
            board.state = replace(board.state, asking=order.page, asking_for=order.name)
            return
        if self.calibrator.guided is not None:
            return
        self.calibrator.begin(order.name, board.state, board.settings, anew=order.anew)
        board.close_review()
        board.state = replace(board.state, aimed=board.state.aimed + 1)

    def _close_result(self) -> None:
        result = self.calibrator.result
        if result is not None and not result.solving:
            self.calibrator.result = None

    def _use(self, answer: Answer | HandstudioError) -> None:
        """What a course was for, from now on."""
        match answer:
            case Calibrated() | SensorsFound():
                self.holder.solved()
            case HeadingAlignment() if answer.verdict.ok:
                self.capture.send(SetHeading(answer.psi_cor))
            case _:
                pass

    def _show(self) -> None:
        calibrator, state = self.calibrator, self.board.state
        guided, result = calibrator.guided, calibrator.result
        if (guided is None) != (state.guided is None):
            state = replace(state, aimed=state.aimed + 1)
        code = state.subject.code if state.subject is not None else ""
        now = code, state.newest.setup, guided is not None or result is not None
        if now != self._stands_for:
            self._stands_for = now
            state = replace(state, stands=calibrator.stands(state))
        self.board.state = replace(state, guided=guided, result=result)
