"""Guided courses: their take, their labels, what the virtual glove is asked, what comes of them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

from app.guidance.courses import Courses, Left
from app.shown.guided import Guided, Result, Stand
from app.sounds import Sound
from app.state import State
from app.takes.taker import Taker
from app.work.solving import SOLVED, Answer
from handstudio.calibration import watching
from handstudio.device.addresses import VirtualWearer
from handstudio.device.capture import Capture
from handstudio.device.orders import Ask, Newest, Phase, ShareSamples
from handstudio.device.recorder import Recorder
from handstudio.errors import CalibrationError, HandstudioError
from handstudio.hand.skeleton import HandType
from handstudio.layout import Layout, divisible, with_hand_type
from handstudio.protocol.commands import PERFORM
from handstudio.recording.notes import load_notes, save_notes, with_label
from handstudio.settings import Settings
from handstudio.wizards import course as wizard
from handstudio.wizards.course import Cue, Event, Labelled, Leave, Lost, Perform, Samples

_OF_HANDS = ("hand", "check")

_TAKE_NAMES = {"hand": "calibration"}
_PATIENCE_S = 15.0  # until a take that was asked for is on
_SOUNDS = {
    Cue.TICK: Sound.TICK,
    Cue.START: Sound.START,
    Cue.STOP: Sound.STOP,
    Cue.REFUSED: Sound.ALARM,
}


class _Watching:
    """The judge of takes and of people alike."""

    observe = staticmethod(watching.observe)
    enough = staticmethod(watching.enough)


@dataclass
class Calibrator:
    """Owner of the course that is on, and of what came of the last.

    Attributes:
        guided: The course that is on.
        result: What came of the last one, until somebody has seen it.
    """

    capture: Capture
    taker: Taker
    sessions: Path
    guided: Guided | None = None
    result: Result | None = None
    judge: wizard.Judge = field(default_factory=_Watching)
    _courses: Courses | None = None
    _recorder: Recorder | None = None
    _takes: tuple[str, ...] = ()
    _labels: list[Labelled] = field(default_factory=list)  # not yet written
    _manner: str = ""
    _waited_s: float = 0.0
    _closing: Path | None = None  # a take of a course that is over, until it is whole

    def courses(self, state: State) -> Courses | None:
        """The courses of the subject and the device there are; None: one of them is not."""
        setup = state.newest.setup
        if setup is None or state.subject is None:
            return None
        code, performing = state.subject.code, performs(state.newest)
        layout = _divided(setup.layout, state.settings.hand_type)
        return Courses(self.sessions, code, layout, setup.rate_hz, performing)

    @property
    def hand_type(self) -> HandType | None:
        """How the palm is divided by what is computed of the course; None: as its takes have it."""
        layout = None if self._courses is None else self._courses.layout
        return layout.hand_type if layout is not None and divisible(layout) else None

    def stands(self, state: State) -> tuple[Stand, ...]:
        """Where the courses stand."""
        courses = self.courses(state)
        return () if courses is None else courses.stands()

    def begin(self, name: str, state: State, settings: Settings, *, anew: bool) -> None:
        """Begin a course, or go on with it, in a take of its own.

        Raises:
            HandstudioError: it cannot be begun, and why.
        """
        courses = self.courses(state)
        if courses is None or not state.can_record:
            raise HandstudioError(
                "There is no device to calibrate with.", "Connect one under Device, then begin."
            )
        if state.newest.recorder is not None:
            raise HandstudioError(
                "A take is being recorded.", "Stop it; a calibration records a take of its own."
            )
        no_hand = courses.layout.no_hand
        if name in _OF_HANDS and no_hand is not None:
            raise no_hand
        if name == "check" and (state.newest.setup is None or state.newest.setup.subject is None):
            raise HandstudioError(
                "There is no calibration that could be checked.",
                "Calibrate this hand first, with the course Hand.",
            )
        left = Left(courses.fresh(name)) if anew else courses.left(name)
        if left.course.phase is wizard.Phase.OVER:
            left = Left(courses.fresh(name))
        self._courses, self._takes = courses, left.takes
        self.result = None
        self._manner = manner_of(state.newest)
        self._record(settings, left.course.name)
        self.guided = Guided(left.course)

    def hear(self, event: Event, settings: Settings) -> list[Sound]:
        """Somebody says something to the course; what is to be heard.

        Raises:
            HandstudioError: it cannot go on, and why.
        """
        guided = self.guided
        if guided is None:
            return []
        if guided.problem is not None and self._courses is not None:
            # its take had ended: whatever is said, it needs one, and what every take begins with
            self._record(settings, guided.course.name)
            guided = Guided(self._courses.left(guided.course.name).course)
            self.guided = guided
        return self._become(wizard.advance(guided.course, event, self.judge))

    def leave(self) -> None:
        """No more for now: what was done is kept, the take ends."""
        if self.guided is None:
            return
        course = wizard.advance(self.guided.course, Leave(), self.judge)
        try:
            self._keep(course)
        finally:
            self._let_go()

    def redo(self, index: int, state: State, settings: Settings) -> None:
        """One step of the course that is over once more, in another take.

        Raises:
            HandstudioError: it cannot be begun, and why.
        """
        result = self.result
        if result is None or result.solving:
            return
        courses = self.courses(state)
        if courses is None:
            return
        again = wizard.advance(result.course, wizard.Redo(index), self.judge)
        courses.keep(Left(again, self._takes))
        self.begin(again.name, state, settings, anew=False)

    def tick(self, elapsed_s: float, state: State) -> list[Sound]:
        """So much later; what is to be heard.

        Raises:
            HandstudioError: what was done cannot be kept, and why.
        """
        guided = self.guided
        if guided is None or guided.problem is not None:
            return []
        samples = self.capture.drain_samples()
        if not self._is_recorded(elapsed_s, state.newest):
            return []
        sounds: list[Sound] = []
        recorder = self._recorder
        if state.newest.phase is Phase.LOST:
            sounds += self._become(wizard.advance(guided.course, Lost(), self.judge))
        for run in samples:
            if recorder is not None and recorder.first_us is not None and self.guided is not None:
                begun = int((run.time_us < recorder.first_us).sum())
                event = Samples(run[begun:])
                sounds += self._become(wizard.advance(self.guided.course, event, self.judge))
        return sounds

    def take_done(self, path: Path) -> bool:
        """A take is whole; whether it was one of a course."""
        if self._closing is None or path != self._closing:
            return False
        self._closing = None
        return True

    def take_failed(self, error: HandstudioError) -> None:
        """A take could not be written; where it was this one's there is nothing to compute from."""
        if self._closing is not None and self.guided is None:
            self._closing = None
            if self.result is not None and self.result.solving:
                self.solved(error)

    def to_solve(self) -> list[Path]:
        """The takes to compute the result from, once the last of them is whole."""
        if self.result is None or not self.result.solving or self._closing is not None:
            return []
        takes = [self.sessions / name for name in self._takes]
        found = [take for take in takes if take.exists()]
        if not found:
            self.solved(
                CalibrationError(
                    "The takes of this course are gone.", "Do the course again; it takes minutes."
                )
            )
        return found

    def solved(self, outcome: Answer | HandstudioError) -> None:
        """What came of it."""
        if self.result is None:
            return
        if isinstance(outcome, HandstudioError):
            self.result = replace(self.result, solving=False, error=outcome)
        else:
            self.result = replace(self.result, solving=False, answer=outcome)

    # --- the take -------------------------------------------------------------------------------

    def _record(self, settings: Settings, name: str) -> None:
        self.taker.begin_at_once(settings, _TAKE_NAMES.get(name, name))
        self._recorder, self._waited_s = None, 0.0
        self._labels.clear()
        self.capture.send(ShareSamples(on=True))

    def _is_recorded(self, elapsed_s: float, newest: Newest) -> bool:
        """Whether the take is on; where it ended the course waits."""
        recorder, guided = newest.recorder, self.guided
        if guided is None:
            return False
        if self._recorder is None and recorder is not None:
            self._recorder, self._closing = recorder, recorder.path
            name = str(recorder.path.relative_to(self.sessions))
            self._takes = (*self._takes, name)
            self.guided = replace(guided, recording=True)
            return True
        if recorder is not None:
            return True
        self._waited_s += elapsed_s
        if self._recorder is not None or self._waited_s > _PATIENCE_S:
            course = wizard.advance(guided.course, Leave(), self.judge)
            self.guided = Guided(course, recording=False, problem=_ended(newest))
            self.capture.send(ShareSamples(on=False))
            self._keep(course)
        return False

    def _become(self, course: wizard.Course) -> list[Sound]:
        guided = self.guided
        if guided is None:
            return []
        before = guided.course
        self.guided = replace(guided, course=course)
        sounds = []
        for told in course.told:
            match told:
                case Cue():
                    sounds.append(_SOUNDS[told])
                case Perform(motions=motions):
                    self.capture.send(Ask(PERFORM, (motions + self._manner).encode()))
                case Labelled():
                    self._labels.append(told)
        try:
            if course.outcomes is not before.outcomes:
                self._keep(course)
        finally:
            if course.phase is wizard.Phase.OVER:
                self._finish(course)
        return sounds

    def _keep(self, course: wizard.Course) -> None:
        """Labels into the take's notes, and where the course stands into its file."""
        recorder = self._recorder
        if recorder is not None and recorder.first_us is not None and self._labels:
            notes = load_notes(recorder.path)
            for label in self._labels:
                start, end = (
                    (us - recorder.first_us) * 1e-6 for us in (label.start_us, label.end_us)
                )
                if end > start:
                    notes = with_label(notes, start, end, label.label)
            save_notes(recorder.path, notes)
            self._labels.clear()
        if self._courses is not None and self._takes:
            self._courses.keep(Left(course, self._takes))

    def _finish(self, course: wizard.Course) -> None:
        self.result = Result(course, solving=course.name in SOLVED)
        if self._courses is not None:
            self._courses.forget(course.name)
        self._let_go()

    def _let_go(self) -> None:
        self.capture.send(ShareSamples(on=False))
        self.taker.stop()
        self.guided, self._recorder = None, None


def _divided(layout: Layout, hand_type: HandType) -> Layout:
    return with_hand_type(layout, hand_type) if divisible(layout) else layout


def performs(newest: Newest) -> bool:
    """Whether whoever wears the glove does what it is asked: a virtual one, which tells so."""
    told = newest.description
    if told is None or newest.address.startswith("replay:"):
        return False
    return told.name.startswith("Virtual glove") or told.firmware.startswith("virtual")


def manner_of(newest: Newest) -> str:
    """How a virtual person does everything, as the address has it: ``~sloppy``."""
    wearer = VirtualWearer.of(newest.address)
    found = re.search(r"(~\s*[a-z_]+)+\s*$", wearer.motion) if wearer is not None else None
    return found.group() if found else ""


def _ended(newest: Newest) -> CalibrationError:
    if newest.phase in (Phase.IDLE, Phase.FAILED):
        return CalibrationError(
            "The device was let go of, and the take of this course ended.",
            "Connect the device, then go on; what was done is kept.",
        )
    return CalibrationError(
        "The take of this course ended: nothing is recorded now.",
        "Go on in a new take, or leave; what was done is kept.",
    )
