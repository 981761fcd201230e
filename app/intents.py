"""What a person can ask of the studio. Panels send these; only the studio acts on them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from app.shown.look import View
from app.work.joint_work import JointOrder
from handstudio.export.part import Content
from handstudio.hand.skeleton import HandType
from handstudio.wizards import course

# --- devices --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class FindDevices:
    """Look which devices are there."""


@dataclass(frozen=True, slots=True)
class ConnectDevice:
    """Use this device."""

    address: str


@dataclass(frozen=True, slots=True)
class DisconnectDevice:
    """Let go of the device."""


@dataclass(frozen=True, slots=True)
class BlinkSensor:
    """Make a sensor of the device blink."""

    name: str


@dataclass(frozen=True, slots=True)
class Perform:
    """Let the wearer of the virtual glove do this."""

    motions: str


@dataclass(frozen=True, slots=True)
class ResetHeading:
    """Take the heading anew, of one sensor or, with None, of all."""

    sensor: str | None = None


@dataclass(frozen=True, slots=True)
class FindTrackers:
    """Look for streams of trackers."""


@dataclass(frozen=True, slots=True)
class ChooseTracker:
    """Use this tracker from now on; an empty source: none.

    Attributes:
        source: ``lsl:NAME``, or ``virtual:SEGMENT``.
        terminal: Which of its terminals; empty: the first.
        sensor: The sensor that sits on; empty: found from the motion.
    """

    source: str
    terminal: str = ""
    sensor: str = ""


OfDevices: TypeAlias = (
    FindDevices
    | ConnectDevice
    | DisconnectDevice
    | BlinkSensor
    | Perform
    | ResetHeading
    | FindTrackers
    | ChooseTracker
)

# --- recording ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ToggleRecording:
    """Start a take, or end the one that is on, or the count before it."""

    page: int = -1  # which page asked: it may have to be asked back


@dataclass(frozen=True, slots=True)
class PutMark:
    """This moment is worth finding again, in the take that is recorded or open."""

    text: str = ""


OfRecording: TypeAlias = ToggleRecording | PutMark

# --- subjects -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ChooseSubject:
    """Whose takes are recorded from now on; an empty code: nobody's yet."""

    code: str


@dataclass(frozen=True, slots=True)
class SaveSubject:
    """A person, new or known, as typed; recording may have waited for it."""

    code: str
    side: str
    hand_length_mm: float
    then_record: bool = False
    then_begin: str = ""  # a course


@dataclass(frozen=True, slots=True)
class DeleteSubject:
    """A person and all that was recorded of them goes for good."""

    code: str
    typed: str


OfSubjects: TypeAlias = ChooseSubject | SaveSubject | DeleteSubject

# --- the library ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Search:
    """Show the takes in which all these words occur."""

    text: str


@dataclass(frozen=True, slots=True)
class RenameTake:
    """A file of the library gets another name."""

    path: Path
    name: str


@dataclass(frozen=True, slots=True)
class BinTake:
    """A file of the library goes to the bin."""

    path: Path


@dataclass(frozen=True, slots=True)
class Undo:
    """Take the last change to the library back."""


@dataclass(frozen=True, slots=True)
class RestoreTake:
    """A take of the bin goes back where it was."""

    key: str


@dataclass(frozen=True, slots=True)
class EmptyBin:
    """What is in the bin goes for good."""


@dataclass(frozen=True, slots=True)
class AddTake:
    """Copy a take from elsewhere into the library: a file here, or one that a page sent."""

    name: str
    content: bytes | None = None  # None: the name is a path of this computer


@dataclass(frozen=True, slots=True)
class TrimTake:
    """The part of the open take that counts becomes a take of its own, called so."""

    name: str = ""


@dataclass(frozen=True, slots=True)
class RecoverTake:
    """Get back what was saved of an interrupted recording."""

    path: Path


OfLibrary: TypeAlias = (
    Search | RenameTake | BinTake | Undo | RestoreTake | EmptyBin | AddTake | TrimTake | RecoverTake
)

# --- the open take: what is shown of it -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class OpenTake:
    """Show a take of the library."""

    path: Path


@dataclass(frozen=True, slots=True)
class ShowLive:
    """Leave the take, show the hand as it is now."""


@dataclass(frozen=True, slots=True)
class ComputeRest:
    """Of the open take only the first seconds are there: compute the rest after all."""


@dataclass(frozen=True, slots=True)
class Smooth:
    """Show the open take with its future taken in, or as it was live."""

    on: bool


@dataclass(frozen=True, slots=True)
class Compare:
    """Show the open take a second time, by another filter or smoothed; empty: no more."""

    name: str


@dataclass(frozen=True, slots=True)
class ChooseCurves:
    """Plot this set of curves; of signals, those of the sensor of this name."""

    name: str
    sensor: str = ""


OfOpenTake: TypeAlias = OpenTake | ShowLive | ComputeRest | Smooth | Compare | ChooseCurves

# --- the open take: which moment, which part ------------------------------------------------------


@dataclass(frozen=True, slots=True)
class TogglePlay:
    """Play, or pause."""


@dataclass(frozen=True, slots=True)
class GoOn:
    """The space bar: play or pause the open take; else record or stop."""

    page: int


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to a time of the take [s]; pauses."""

    at_s: float


@dataclass(frozen=True, slots=True)
class Step:
    """Go some instants on or back; pauses."""

    instants: int


@dataclass(frozen=True, slots=True)
class GoToMark:
    """On to the next mark of the open take, or back to the one before."""

    forward: bool


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """How fast to play; 1 is as it was."""

    factor: float


@dataclass(frozen=True, slots=True)
class SetLoop:
    """Whether playing begins again at the end."""

    on: bool


@dataclass(frozen=True, slots=True)
class MarkIn:
    """The part of the take that counts begins here."""


@dataclass(frozen=True, slots=True)
class MarkOut:
    """The part of the take that counts ends here."""


@dataclass(frozen=True, slots=True)
class WholeTake:
    """The whole take counts again."""


@dataclass(frozen=True, slots=True)
class ZoomPlots:
    """So many times less time in the plots of the open take."""

    factor: float


@dataclass(frozen=True, slots=True)
class PanPlots:
    """The plots of the open take go on by this share of their time, or back."""

    share: float


@dataclass(frozen=True, slots=True)
class FitPlots:
    """The part that counts fills the plots, or the whole take where it does already."""


@dataclass(frozen=True, slots=True)
class ShiftComparison:
    """Lay the begin of the take that is compared with so much later than the open one's [s]."""

    later_s: float


Move: TypeAlias = (
    TogglePlay
    | GoOn
    | Seek
    | Step
    | GoToMark
    | SetSpeed
    | SetLoop
    | MarkIn
    | MarkOut
    | WholeTake
    | ZoomPlots
    | PanPlots
    | FitPlots
    | ShiftComparison
)

# --- the open take: notes -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class NamePart:
    """The part of the open take that counts is called so."""

    label: str


@dataclass(frozen=True, slots=True)
class SetNotes:
    """The words beside the open take."""

    text: str


@dataclass(frozen=True, slots=True)
class RemoveMark:
    """The mark at this time [s] goes."""

    at_s: float


OfNotes: TypeAlias = NamePart | SetNotes | RemoveMark

# --- the open take: measures ----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class CompareVisits:
    """Compare the measures of the open take with those of an earlier one; None: with none."""

    earlier: Path | None


@dataclass(frozen=True, slots=True)
class CompareSides:
    """Hold the measures of the open take against those of the other hand; None: against none."""

    other: Path | None


@dataclass(frozen=True, slots=True)
class MeasureHand:
    """Measure the part of the open take that counts."""


@dataclass(frozen=True, slots=True)
class AddPosture:
    """Count the time in this posture too: an angle and its ends in degrees, as they are typed."""

    name: str
    angle: str
    above: str
    below: str


@dataclass(frozen=True, slots=True)
class RemovePosture:
    """Count it no more."""

    name: str


@dataclass(frozen=True, slots=True)
class MakeReport:
    """Write a report of the part that counts and send it to a page."""

    page: int


OfMeasures: TypeAlias = (
    CompareVisits | CompareSides | MeasureHand | AddPosture | RemovePosture | MakeReport
)

# --- files ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Export:
    """Write a file into the library and send it to a page."""

    content: Content | None  # None: the format has one, or a first
    page: int  # which open page asked
    format: str = "csv"


@dataclass(frozen=True, slots=True)
class ShareTake:
    """Send the open take and its notes to the page, as one file."""

    page: int


@dataclass(frozen=True, slots=True)
class SendDiagnostics:
    """A file for whoever helps, without anything of the people recorded."""

    page: int


@dataclass(frozen=True, slots=True)
class CancelWork:
    """The long work that is on is no longer wanted."""


OfFiles: TypeAlias = Export | ShareTake | SendDiagnostics | CancelWork

# --- guided courses -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BeginCourse:
    """Begin a guided course, or go on with one that was left."""

    name: str
    anew: bool = False
    page: int = -1


@dataclass(frozen=True, slots=True)
class Guide:
    """Say this to the course that is on."""

    event: course.Event


@dataclass(frozen=True, slots=True)
class RedoStep:
    """One step of the course once more, be it on or over."""

    index: int


@dataclass(frozen=True, slots=True)
class LeaveCourse:
    """No more for now; the course goes on another time."""


@dataclass(frozen=True, slots=True)
class CloseResult:
    """What came of the course was seen."""


@dataclass(frozen=True, slots=True)
class UseCalibration:
    """Use no calibration of the hand, the newest again, or the one before."""

    which: Literal["none", "again", "previous"]


OfCourses: TypeAlias = BeginCourse | Guide | RedoStep | LeaveCourse | CloseResult | UseCalibration

# --- joints by trackers ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class GiveTracks:
    """Look into a file of a tracker: one of this computer, or one that a page sent."""

    name: str
    content: bytes | None = None


@dataclass(frozen=True, slots=True)
class FindJoint:
    """Find the joint between two terminals of the file that was given."""

    order: JointOrder


@dataclass(frozen=True, slots=True)
class TryVirtualFinger:
    """A virtual finger with a tracker goes through the guided finding of this joint."""

    joint: str
    method: str


@dataclass(frozen=True, slots=True)
class CloseJoint:
    """What came of finding a joint was seen; or it is no longer wanted."""


OfJoints: TypeAlias = GiveTracks | FindJoint | TryVirtualFinger | CloseJoint

# --- pages ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PagesOpen:
    """So many pages are open, and the languages the newest asks for, best first."""

    count: int
    languages: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PageShown:
    """The slowest page answered what it was sent after so long [ms]; None: none answers."""

    ms: float | None


@dataclass(frozen=True, slots=True)
class SetLanguage:
    """The language of the page; empty: the browser's, or the system's."""

    language: str


@dataclass(frozen=True, slots=True)
class SetView:
    """Look at the hand from there."""

    view: View


@dataclass(frozen=True, slots=True)
class FaceForward:
    """Turn the picture so that the forearm points away from the viewer."""


OfPages: TypeAlias = PagesOpen | PageShown | SetLanguage | SetView | FaceForward

# --- preferences ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SetVisit:
    """What this visit is called; empty: by its day."""

    name: str


@dataclass(frozen=True, slots=True)
class SetTakeName:
    """What the next takes are called."""

    name: str


@dataclass(frozen=True, slots=True)
class SetHandType:
    """How the next calibration divides the palm."""

    hand_type: HandType


@dataclass(frozen=True, slots=True)
class SetCountdown:
    """How long to count before a take begins [s]; 0: not at all."""

    seconds: int


@dataclass(frozen=True, slots=True)
class SetSounds:
    """Whether start, stop and marks are to be heard."""

    on: bool


@dataclass(frozen=True, slots=True)
class SetFilter:
    """Fuse by the filter of this name from now on; empty: by the one that suits the device."""

    name: str


@dataclass(frozen=True, slots=True)
class SetTheme:
    """A dark page or a light one."""

    dark: bool


@dataclass(frozen=True, slots=True)
class SetShown:
    """Show or hide a kind of thing on the hand."""

    part: str
    on: bool


@dataclass(frozen=True, slots=True)
class ToggleShown:
    """Show it where it is hidden, hide it where it is shown."""

    part: str


Preference: TypeAlias = (
    SetVisit
    | SetTakeName
    | SetHandType
    | SetCountdown
    | SetSounds
    | SetFilter
    | SetTheme
    | SetShown
    | ToggleShown
)

Intent: TypeAlias = (
    OfDevices
    | OfRecording
    | OfSubjects
    | OfLibrary
    | OfOpenTake
    | Move
    | OfNotes
    | OfMeasures
    | OfFiles
    | OfCourses
    | OfJoints
    | OfPages
    | Preference
)
