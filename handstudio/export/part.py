"""What is exported: a take's motion by some setup, and the window of it that a file holds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.export import metadata
from handstudio.hand.angles import Angle
from handstudio.hand.pose import Pose
from handstudio.kinematics import exported_angles, pose_of
from handstudio.pipeline import Motion
from handstudio.recording.take import Take
from handstudio.rooted import Root, root_of
from handstudio.setup import Setup

Content: TypeAlias = Literal[
    "angles", "orientations", "segments", "positions", "skeleton", "motion"
]
"""What of a motion a file holds; ``skeleton``: how segments turn on each other, ``motion``: that
and angles, of sensors where there is no hand."""

PLACED: tuple[Content, ...] = ("positions", "skeleton", "motion")
"""Of these it matters where the hand was."""

BLOCK = 8192
"""Instants that are written at a time: memory does not grow with the take."""


@dataclass(frozen=True, slots=True)
class Window:
    """The part to export, seconds from the take's first instant; None: to its end."""

    start_s: float = 0.0
    end_s: float | None = None


@dataclass(frozen=True)
class Processed:
    """A take and its motion by a setup."""

    take: Take
    setup: Setup
    motion: Motion

    @cached_property
    def about(self) -> dict[str, Any]:
        """What every file of it tells; found once, for hash and health need the whole take."""
        return metadata.of_take(self.take, self.setup)

    @cached_property
    def root(self) -> Root | None:
        """Where the hand was in a tracker's room, where the take has a track.

        Raises:
            CalibrationError: by this setup the track cannot be aligned.
        """
        return root_of(self.take, self.setup, self.motion)


def _nobody(_share: float) -> None:
    pass


@dataclass(frozen=True, slots=True)
class Part:
    """The instants of a window, and all that a writer needs to know of them.

    Attributes:
        setup: What the motion was computed by.
        motion: The instants of the window.
        start_us: The take's first instant: second zero of every file.
        start_utc_ns: When that was, nanoseconds since 1970 UTC.
        content: What of the motion is wanted.
        about: What the file tells of itself.
        only: Names of the angles that are wanted; empty: all there are.
        tell: Told the share that is written.
        root: Where the hand was in a tracker's room, where that matters and is known.
    """

    setup: Setup
    motion: Motion
    start_us: int
    start_utc_ns: int
    content: Content
    about: dict[str, Any] = field(default_factory=dict)
    only: tuple[str, ...] = ()
    tell: Callable[[float], None] = _nobody
    root: Root | None = None

    def blocks(self) -> Iterator[Motion]:
        """The motion, some instants at a time."""
        for at in range(0, len(self.motion), BLOCK):
            yield self.motion[at : at + BLOCK]
            self.tell(min(1.0, (at + BLOCK) / len(self.motion)))

    def pose(self, motion: Motion) -> Pose:
        """The placed hand at instants of the part; NaN where a room is known but not its place."""
        pose = pose_of(self.setup, motion.q_world_sensor)
        return pose if self.root is None else self.root.placing(pose, motion.time_us)

    def seconds(self, motion: Motion) -> Float[Array, " n"]:
        """Times of instants [s], to the microsecond."""
        return seconds(motion.time_us - self.start_us)

    @property
    def angles(self) -> tuple[Angle, ...]:
        """The angles a file holds.

        Raises:
            TakeError: one is wanted that there is not.
        """
        known = {angle.name: angle for angle in exported_angles(self.setup, self.motion)}
        missing = [name for name in self.only if name not in known]
        if missing:
            raise TakeError(
                "There is no angle {names} here.",
                "Choose from: {known}.",
                names=", ".join(missing),
                known=", ".join(known),
            )
        return tuple(known[name] for name in self.only or known)


def seconds(time_us: Int64[Array, " n"]) -> Float[Array, " n"]:
    """Microseconds as the nearest numbers of seconds."""
    rounded: Array = np.round(time_us * 1e-6, 6)
    return rounded


def cut(motion: Motion, window: Window) -> Motion:
    """The instants of a window, both ends included.

    Raises:
        TakeError: the motion or the window holds no instant.
    """
    if len(motion) == 0:
        raise TakeError("The take holds no instant of motion.", "Record it again.")
    # whole microseconds: 0.1 s is an instant, 100000 times 1e-6 a little less
    time_us = motion.time_us - motion.time_us[0]
    whole_s = float(time_us[-1]) * 1e-6
    end_s = whole_s if window.end_s is None else window.end_s
    first = int(np.searchsorted(time_us, round(window.start_s * 1e6), side="left"))
    last = int(np.searchsorted(time_us, round(end_s * 1e6), side="right"))
    if first >= last:
        raise TakeError(
            "Nothing lies between {start:.2f} s and {end:.2f} s.",
            "Choose a window within 0 and {whole:.2f} s.",
            start=window.start_s,
            end=end_s,
            whole=whole_s,
        )
    return motion[first:last]
