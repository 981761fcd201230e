"""What comes of long work, and what is told of it meanwhile. Values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from app.work.joint_work import Finger, JointAnswer, TrackFile
from app.work.solving import Answer
from handstudio.analysis.stretches import Stretch
from handstudio.errors import HandstudioError
from handstudio.finds import Found
from handstudio.measure import Measured
from handstudio.pipeline import Motion
from handstudio.recording.take import Take
from handstudio.setup import Setup


@dataclass(frozen=True, slots=True)
class Download:
    """A file for one page: one that exists, or one that was made for it."""

    page: int
    name: str
    content: Path | bytes


@dataclass(frozen=True, slots=True)
class Work:
    """A job that runs, in words, and how far it is."""

    words: str
    share: float


@dataclass(frozen=True, slots=True)
class Computed:
    """The motion of this take is there now, by its own setup or another."""

    take: Take
    setup: Setup | None = None


@dataclass(frozen=True, slots=True)
class Uncomputed:
    """The motion of this take, by its own setup or another, will not be there, and why not."""

    take: Take
    error: HandstudioError
    own: bool = False


@dataclass(frozen=True, slots=True)
class Unseen:
    """Something about this take (as `Review.ordered` names it) will not be known, and why not."""

    take: Take
    what: str
    error: HandstudioError


@dataclass(frozen=True, slots=True)
class Previewed:
    """The first seconds of a take that is being computed."""

    take: Take
    motion: Motion


@dataclass(frozen=True, slots=True)
class Surveyed:
    """What wants a second look in this take, by its own setup or another."""

    take: Take
    setup: Setup | None
    stretches: tuple[Stretch, ...]


@dataclass(frozen=True, slots=True)
class Written:
    """What the sensors of this take told is there now."""

    take: Take


@dataclass(frozen=True, slots=True)
class WayFound:
    """The way of the hand of this take in a tracker's room is there now."""

    take: Take


@dataclass(frozen=True, slots=True)
class Trimmed:
    """A part of a take is a take of its own."""

    path: Path


@dataclass(frozen=True, slots=True)
class Added:
    """A take from elsewhere is in the library."""

    path: Path


@dataclass(frozen=True, slots=True)
class Exported:
    """A file was written, and is wanted by a page."""

    download: Download


@dataclass(frozen=True, slots=True)
class MeasuredPart:
    """A part of this take was measured."""

    take: Take
    measured: Measured


@dataclass(frozen=True, slots=True)
class Gathered:
    """A file was made for a page, and is nowhere else."""

    download: Download


@dataclass(frozen=True, slots=True)
class Solved:
    """What a course is for was computed, or not, and why not."""

    answer: Answer | HandstudioError


@dataclass(frozen=True, slots=True)
class FoundIn:
    """What was written and grasped in a take is known now, as its motion by this setup tells."""

    take: Take
    setup: Setup
    found: Found


@dataclass(frozen=True, slots=True, eq=False)
class OfJoint:
    """The next of finding a joint by trackers: what was looked into, bent, found; or why not."""

    number: int  # as it was ordered
    told: TrackFile | Finger | JointAnswer | HandstudioError


Outcome = (Computed | Uncomputed | Unseen | Previewed | Surveyed | Written | MeasuredPart) | (
    FoundIn | WayFound | Trimmed | Added | Exported | Gathered | Solved | OfJoint
)
