"""Who finds joints by trackers: orders the work, guides a virtual finger, keeps what came of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app.board import Board
from app.intents import CloseJoint, FindJoint, GiveTracks, Intent, TryVirtualFinger
from app.state import JointFinding
from app.work.joint_work import Finger, JointAnswer, TrackFile, unfinished
from app.work.outcomes import OfJoint, Outcome
from app.work.workshop import Workshop
from handstudio.errors import HandstudioError
from handstudio.trackers.methods import method_named
from handstudio.wizards.joint_course import (
    Begin,
    JointCourse,
    JointPhase,
    Poses,
    advance,
)

_PIECE_US = 100_000
"""Poses are told to the course so seldom: it looks at all of them each time."""


@dataclass
class JointFinder:
    """Finds joints; for one thread.

    Attributes:
        workshop: Where long work is ordered.
        finding: What is shown of it.
    """

    board: Board
    workshop: Workshop
    finding: JointFinding = JointFinding()
    _count: int = 0  # of orders
    _reading: int = 0  # the newest of files: what comes of others is no longer wanted
    _number: int = 0  # the newest of joints, likewise
    _person: int = 0
    _finger: Finger | None = None
    _told_us: int = 0
    _now_s: float = 0.0

    def hear(self, intent: Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        match intent:
            case GiveTracks(name=name, content=content):
                self._count += 1
                self._reading = self._count
                self.finding = replace(self.finding, file=None, problem=None, reading=True)
                self.workshop.look_into_tracks(self._reading, name, content)
            case FindJoint(order=order):
                self._begin(order.joint)
                self.workshop.find_joint(self._number, order)
            case TryVirtualFinger(joint=joint, method=method):
                self._begin(joint)
                course = JointCourse(methods=(method_named(method),))
                self.finding = replace(self.finding, course=course)
                self._person += 1
                self.workshop.bend_virtual_finger(self._number, joint, self._person)
            case CloseJoint():
                self._begin("")
                self.finding = replace(self.finding, working=False)
            case _:
                return False
        return True

    def done(self, outcome: Outcome) -> bool:
        """Take in what was ordered, or why it will not be; False: it is about something else."""
        if not isinstance(outcome, OfJoint):
            return False
        self._take_in(outcome)
        return True

    def tick(self, elapsed_s: float) -> None:
        """So much later; the state shows what is found by then."""
        self._bend_on(elapsed_s)
        self.board.state = replace(self.board.state, joint=self.finding)

    def _take_in(self, outcome: OfJoint) -> None:
        if outcome.number == self._reading:
            file = outcome.told if isinstance(outcome.told, TrackFile) else None
            problem = outcome.told if isinstance(outcome.told, HandstudioError) else None
            self.finding = replace(self.finding, file=file, problem=problem, reading=False)
            return
        if outcome.number != self._number or not self.finding.working:
            return
        match outcome.told:
            case Finger() if self.finding.course is not None:
                self._finger, self._told_us, self._now_s = outcome.told, 0, 0.0
                self.finding = replace(
                    self.finding, course=advance(self.finding.course, Begin()), working=False
                )
            case JointAnswer() | HandstudioError():
                self.finding = replace(
                    self.finding, answer=outcome.told, course=None, working=False
                )

    def _bend_on(self, elapsed_s: float) -> None:
        """The virtual finger goes on."""
        course, finger = self.finding.course, self._finger
        if course is None or finger is None:
            return
        self._now_s += elapsed_s
        now_us = round(1e6 * self._now_s)
        while self._finger is not None and now_us - self._told_us >= _PIECE_US:
            self._tell_piece(finger)

    def _tell_piece(self, finger: Finger) -> None:
        course = self.finding.course
        if course is None:
            return
        time_us = finger.upper.time_us - finger.upper.time_us[0]
        used = (time_us >= self._told_us) & (time_us < self._told_us + _PIECE_US)
        self._told_us += _PIECE_US
        if not used.any():
            self._finger = None
            self.finding = replace(self.finding, answer=unfinished(course), course=None)
            return
        ends = course.done_s + 2e-6 * _PIECE_US >= course.lasts_s
        if course.phase is JointPhase.BENDING and ends:
            # the last poses go to where the joint is found, and a few more than enough of them
            used = (time_us >= self._told_us - _PIECE_US) & (
                time_us < self._told_us + 2 * _PIECE_US
            )
            self._finger = None
            self.finding = replace(self.finding, working=True)
            piece = Poses(finger.upper[used], finger.lower[used])
            self.workshop.judge_joint(self._number, course, piece, finger)
            return
        piece = Poses(finger.upper[used], finger.lower[used])
        self.finding = replace(self.finding, course=advance(course, piece))

    def _begin(self, joint: str) -> None:
        self._count += 1
        self._number, self._finger = self._count, None
        self.finding = replace(self.finding, joint=joint, course=None, answer=None, working=True)
