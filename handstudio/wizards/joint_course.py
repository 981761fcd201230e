"""Finding a joint with a tracker, guided: hold the finger straight, bend it, see the verdict.

``advance(course, event) -> course``, as all wizards. Time comes with the poses. What was seen is
judged as a whole whenever poses come, so that cutting them otherwise changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeAlias

import numpy as np

from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.findings import seen_at
from handstudio.trackers.methods import METHODS, Method
from handstudio.trackers.poses import seen_from
from handstudio.trackers.study import REST_S, JointStudy, study
from handstudio.trackers.track import Track

BEND_S = 20.0
"""The seed's fingers were bent for 15 to 30 s (0104)."""

STILL_RAD = float(np.deg2rad(5.0))
"""A finger that is held straight gives by a degree or two."""


class JointPhase(Enum):
    """Where it stands."""

    INTRO = "intro"  # what will be done is shown
    STRAIGHT = "straight"  # the finger is to be held straight
    BENDING = "bending"  # the finger is to be bent and stretched
    VERDICT = "verdict"


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """What the tracker told of both terminals since the last time: the same instants."""

    upper: Track
    lower: Track


@dataclass(frozen=True, slots=True)
class Begin:
    """Somebody begins, or begins anew."""


@dataclass(frozen=True, slots=True)
class Leave:
    """Somebody leaves it."""


JointEvent: TypeAlias = Poses | Begin | Leave


@dataclass(frozen=True, slots=True, eq=False)
class JointCourse:
    """A joint being found.

    Attributes:
        phase: Where it stands.
        methods: Ways to find it; the verdict is on the first.
        bend_s: How long it is bent.
        pieces: What was told since it began.
        done_s: How much of the phase is done [s].
        moved: How often the finger moved while it was to be held straight.
        study: What was found.
        refused: Why nothing was.
    """

    phase: JointPhase = JointPhase.INTRO
    methods: tuple[Method, ...] = tuple(METHODS.values())
    bend_s: float = BEND_S
    pieces: tuple[Poses, ...] = ()
    done_s: float = 0.0
    moved: int = 0
    study: JointStudy | None = None
    refused: TrackError | None = None

    @property
    def lasts_s(self) -> float:
        """How long the phase lasts [s]; 0: until somebody does something."""
        match self.phase:
            case JointPhase.STRAIGHT:
                return REST_S
            case JointPhase.BENDING:
                return self.bend_s
            case JointPhase.INTRO | JointPhase.VERDICT:
                return 0.0


def advance(course: JointCourse, event: JointEvent) -> JointCourse:
    """What becomes of it when this happens."""
    match event:
        case Begin():
            return JointCourse(JointPhase.STRAIGHT, course.methods, course.bend_s)
        case Leave():
            return JointCourse(JointPhase.INTRO, course.methods, course.bend_s)
        case Poses():
            match course.phase:
                case JointPhase.STRAIGHT | JointPhase.BENDING:
                    return _seen(replace(course, pieces=(*course.pieces, event)))
                case JointPhase.INTRO | JointPhase.VERDICT:
                    return course


def _seen(course: JointCourse) -> JointCourse:
    upper = _whole([piece.upper for piece in course.pieces])
    lower = _whole([piece.lower for piece in course.pieces])
    if len(upper.time_us) != len(lower.time_us) or not len(upper.time_us):
        return course
    begins_us, moved = _straight_since(upper, lower)
    now_us = int(upper.time_us[-1])
    if begins_us is None:
        return replace(course, moved=moved, done_s=0.0)
    straight_us = begins_us + round(1e6 * REST_S)
    end_us = straight_us + round(1e6 * course.bend_s)
    if now_us < straight_us:
        return replace(
            course, phase=JointPhase.STRAIGHT, moved=moved, done_s=1e-6 * (now_us - begins_us)
        )
    if now_us < end_us:
        return replace(
            course, phase=JointPhase.BENDING, moved=moved, done_s=1e-6 * (now_us - straight_us)
        )
    used = (upper.time_us >= begins_us) & (upper.time_us < end_us)
    upper, lower = upper[used], lower[used]
    rest = upper.time_us < straight_us
    course = replace(course, phase=JointPhase.VERDICT, moved=moved, done_s=0.0, pieces=())
    try:
        return replace(course, study=study(upper, lower, rest=rest, methods=course.methods))
    except TrackError as refused:
        return replace(course, refused=refused)


def _straight_since(upper: Track, lower: Track) -> tuple[int | None, int]:
    """Since when the finger has been straight, long enough or until now; how often it moved."""
    seen = np.flatnonzero(seen_at(upper) & seen_at(lower))
    if not len(seen):
        return None, 0
    a, b = upper[seen], lower[seen]
    q, _ = seen_from(a.q_room_terminal, a.t_room_terminal, b.q_room_terminal, b.t_room_terminal)
    start, moved = 0, 0
    while True:
        off = so3.angle_between(q[start], q[start:]) > STILL_RAD
        within = a.time_us[start:] < a.time_us[start] + round(1e6 * REST_S)
        early = np.flatnonzero(off & within)
        if not len(early):
            return int(a.time_us[start]), moved
        start, moved = start + int(early[0]), moved + 1


def _whole(pieces: list[Track]) -> Track:
    fields = ("time_us", "t_room_terminal", "q_room_terminal", "quality")
    first = pieces[0]
    return Track(first.name, *(np.concatenate([getattr(p, f) for p in pieces]) for f in fields))
