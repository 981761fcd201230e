"""Everything the page is drawn from: one value, made anew by the studio, read by everybody."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

from app.shown.guided import Guided, InUse, Result, Stand
from app.shown.live import LiveHistory
from app.shown.look import View
from app.shown.review import Review
from app.shown.shaken import Shaking
from app.shown.taking import BLIP_S, Countdown, Disk
from app.sounds import Sound
from app.work.joint_work import JointAnswer, TrackFile
from app.work.outcomes import Download, Work
from handstudio.arrays import Array
from handstudio.device import find
from handstudio.device.find import Found
from handstudio.device.live_tracker import LiveNow
from handstudio.device.orders import Newest
from handstudio.errors import HandstudioError
from handstudio.recording.bin import Binned
from handstudio.recording.library import Entry
from handstudio.recording.subjects import Subject
from handstudio.settings import Settings
from handstudio.setup import HandModel
from handstudio.wizards.joint_course import JointCourse

HAND_LENGTH_MM = (120.0, 240.0)
"""Plausible hand lengths, children to the largest adults [mm]."""


Preparing: TypeAlias = Literal["no", "yes", "failed"]
"""Whether the whole-hand filter is being prepared, while another one serves."""


@dataclass(frozen=True, slots=True)
class Message:
    """Something to tell the person once."""

    text: str
    remedy: str = ""
    alarm: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Shelf:
    """The library as it is shown."""

    takes: tuple[Entry, ...] = ()  # all of them, newest first
    found: tuple[Entry, ...] = ()  # those in which the words searched for occur
    search: str = ""
    subjects: tuple[Subject, ...] = ()
    undo: str = ""  # what can be taken back, in words
    binned: tuple[Binned, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class JointFinding:
    """A joint that is being found by trackers, or was.

    Attributes:
        file: The tracker's file that was given.
        problem: Why the last one that was given cannot be used.
        reading: One is being looked into.
        joint: Which joint of the hand is sought.
        course: The guided course that a virtual finger goes through.
        working: It is being computed.
        answer: What came of it, until somebody has seen it.
    """

    file: TrackFile | None = None
    problem: HandstudioError | None = None
    reading: bool = False
    joint: str = ""
    course: JointCourse | None = None
    working: bool = False
    answer: JointAnswer | HandstudioError | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Tracking:
    """The tracker in use, and which there are.

    Attributes:
        now: What is known of it; None: none is in use.
        streams: Names of the streams that were found.
        searching: They are being looked for.
        anchor: Elbow and attitude of the world in the room where the picture begins.
    """

    now: LiveNow | None = None
    streams: tuple[str, ...] = ()
    searching: bool = False
    anchor: tuple[Array, Array] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """Everything the page is drawn from.

    Attributes:
        settings: What is kept from one start to the next.
        language: The language that is spoken now.
        pages: How many pages are open; all of them show and control the same studio.
        page_ms: How long the slowest of them takes to answer what it is sent [ms].
        view: Where the picture is taken from; ``aimed`` counts how often it was asked for.
        yaw: Turn of the picture about the vertical; None: to be found anew.
        stands: Where the courses of the subject and the device stand.
        in_use: The calibrations that are in use.
        preparing: Whether the whole-hand filter is still awaited.
        away_s: How long no take could begin, as the device sends nothing or nobody is known [s].
        guided: The course that is on.
        result: What came of the last course, until somebody has seen it.
        joint: What is found of a joint by trackers.
        tracker: The tracker that goes along with the glove.
        asking: The page that must say whose hand it is before a take can begin.
        asking_for: The course that waits for that; empty: a take.
    """

    sessions: Path
    newest: Newest = Newest()
    settings: Settings = field(default_factory=Settings)
    language: str = "en"
    pages: int = 0
    page_ms: float | None = None
    devices: tuple[Found, ...] = (find.VIRTUAL,)
    searching: bool = False
    shelf: Shelf = Shelf()
    away_s: float = 0.0
    countdown: Countdown | None = None
    disk: Disk | None = None
    marks: int = 0  # put into the take that is on
    live: LiveHistory | None = None
    shaking: Shaking | None = None
    review: Review | None = None
    stands: tuple[Stand, ...] = ()
    in_use: InUse = InUse()
    preparing: Preparing = "no"
    guided: Guided | None = None
    result: Result | None = None
    joint: JointFinding = JointFinding()
    tracker: Tracking = Tracking()
    work: Work | None = None
    view: View = View.DESK
    aimed: int = 0
    yaw: float | None = None
    # told once, and gone at the next tick
    asking: int | None = None
    asking_for: str = ""
    messages: tuple[Message, ...] = ()
    downloads: tuple[Download, ...] = ()
    sounds: tuple[Sound, ...] = ()

    @property
    def subject(self) -> Subject | None:
        """The person whose takes are recorded; None: nobody was chosen."""
        code = self.settings.subject
        return next((known for known in self.shelf.subjects if known.code == code), None)

    @property
    def can_record(self) -> bool:
        """Whether a take can begin; a device that has only just gone still is waited for."""
        return self.newest.ready or (self.newest.setup is not None and self.away_s < BLIP_S)

    @property
    def hand_length_mm(self) -> float:
        """The wearer's hand length."""
        subject = self.subject
        measured = subject.hand_length_mm if subject is not None else None
        return self.settings.hand_length_mm if measured is None else measured

    @property
    def hand(self) -> HandModel:
        """The hand of whoever is chosen now, before any calibration."""
        return HandModel(hand_length_m=self.hand_length_mm * 1e-3)
