"""A course of calibration steps and where it stands, as one value."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal, TypeAlias

import numpy as np

from handstudio.calibration.course import Step
from handstudio.calibration.verdict import Verdict
from handstudio.layout import Layout
from handstudio.wizards.events import Told
from handstudio.wizards.window import Window

COUNT_S = 3.0
"""Counted before a step."""

SHOWN_S = 1.5
"""How long a good verdict is shown before it goes on by itself."""


class Phase(Enum):
    """Where a step stands."""

    INTRO = "intro"  # it is shown; somebody says when it begins
    COUNTDOWN = "countdown"
    RESTING = "resting"
    DOING = "doing"
    VERDICT = "verdict"
    AWAY = "away"  # the device was lost in the middle of it
    OVER = "over"  # every step is done or skipped


class Standing(Enum):
    """What became of a step."""

    OPEN = "open"
    GOOD = "good"
    REFUSED = "refused"
    ACCEPTED = "accepted"  # refused, and used all the same
    SKIPPED = "skipped"

    @property
    def settled(self) -> bool:
        """Whether the course goes on past it."""
        return self in (Standing.GOOD, Standing.ACCEPTED, Standing.SKIPPED)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a step was seen to be, and what became of it."""

    standing: Standing = Standing.OPEN
    verdict: Verdict | None = None


Trouble: TypeAlias = Literal["", "away", "gap"]
"""Why a step was begun anew by itself."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A course and where it stands.

    Attributes:
        name: Of the course.
        layout: Of the device.
        rate_hz: Of the device.
        steps: In order.
        outcomes: One a step.
        index: The step that is on.
        phase: Where it stands.
        performing: Whoever wears the glove does what the device is asked for.
        by_itself: It goes on without anybody saying so, except past a refused step.
        since_us: When the phase began; None: with the next instant.
        now_us: The newest instant.
        rest: What was felt while everything rested before the step.
        done: What was felt while it was done.
        live: What is seen of it so far.
        moved: The wearer was seen to move since it was asked to perform.
        calm_us: When it had rested for long enough, until the next look.
        trouble: Why it stands here, where that is no good news.
        told: What to hear, ask and write down since the last event.
    """

    name: str
    layout: Layout
    rate_hz: float
    steps: tuple[Step, ...]
    outcomes: tuple[Outcome, ...]
    index: int = 0
    phase: Phase = Phase.INTRO
    performing: bool = False
    by_itself: bool = False
    since_us: int | None = None
    now_us: int | None = None
    due_us: int = 0
    rest: Window = Window()
    done: Window = Window()
    live: Verdict | None = None
    moved: bool = False
    calm_us: int | None = None
    trouble: Trouble = ""
    told: tuple[Told, ...] = ()

    @property
    def step(self) -> Step:
        """The step that is on."""
        return self.steps[self.index]

    @property
    def outcome(self) -> Outcome:
        """What became of it so far."""
        return self.outcomes[self.index]

    @property
    def phase_s(self) -> float:
        """How long the phase has been on."""
        if self.since_us is None or self.now_us is None:
            return 0.0
        return (self.now_us - self.since_us) * 1e-6

    @property
    def count(self) -> int:
        """What is counted: 3, 2, 1."""
        return max(1, int(np.ceil(COUNT_S - self.phase_s)))

    @property
    def settled(self) -> int:
        """How many steps need nothing more."""
        return sum(outcome.standing.settled for outcome in self.outcomes)

    @property
    def seconds_left(self) -> float:
        """About how long the rest of it takes."""
        pairs = zip(self.steps, self.outcomes, strict=True)
        return sum((usual_s(step) for step, each in pairs if not each.standing.settled), 0.0)


def usual_s(step: Step) -> float:
    """About how long a step takes with everything around it [s]."""
    around = 0.0 if step.kind == "fit" else COUNT_S
    return around + step.rest_s + step.least_s + SHOWN_S


def begin(
    name: str,
    steps: tuple[Step, ...],
    layout: Layout,
    rate_hz: float,
    *,
    performing: bool = False,
) -> Course:
    """A course at its first step."""
    outcomes = tuple(Outcome() for _ in steps)
    return Course(
        name,
        layout,
        rate_hz,
        steps,
        outcomes,
        performing=performing,
        by_itself=performing,
    )
