"""A joint by trackers: what is asked for, how the job's process computes it, what comes of it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias, TypeVar

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import HandstudioError, TrackError
from handstudio.hand.skeleton import FINGERS, JOINTS, SEGMENTS
from handstudio.maths import so3
from handstudio.recording.tracks import read_markers, read_tracks
from handstudio.trackers.methods import METHODS, method_named
from handstudio.trackers.study import JointStudy, study
from handstudio.trackers.track import Track
from handstudio.wizards.joint_course import JointCourse, Poses, advance

T = TypeVar("T")

Tell: TypeAlias = Callable[[float], None]
Across: TypeAlias = Literal["x", "y", "z"]

FINDABLE = tuple(
    joint.name
    for joint in JOINTS
    if joint.name.partition("_")[0] in FINGERS and not joint.name.endswith("_cmc")
)
"""Joints that are bent by themselves, a terminal on each side."""

_AXES: dict[Across, list[float]] = {
    "x": [1.0, 0.0, 0.0],
    "y": [0.0, 1.0, 0.0],
    "z": [0.0, 0.0, 1.0],
}
ACROSS = tuple(_AXES)
"""Axes of a tracker that may lie across a finger."""

_RATE_HZ = 120.0
_TUGGED = float(np.deg2rad(0.3))
_SKIN = "ideal,soft_tissue,mounting"


@dataclass(frozen=True, slots=True, eq=False)
class TrackFile:
    """A file of a tracker that was given.

    Attributes:
        name: Its path on the studio's computer, or what it is called where it was sent from.
        content: What a page sent; None: it is read from its path.
        terminals: In a file of poses.
        markers: In a file of markers; clusters of them are terminals.
    """

    name: str
    content: bytes | None = None
    terminals: tuple[str, ...] = ()
    markers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class JointOrder:
    """What a joint is to be found from, and how.

    Attributes:
        file: Which was given.
        clusters: ``NAME=marker,marker,marker; NAME=...``, as typed.
        upper: Name of the terminal nearer to the hand.
        lower: Of the one beyond the joint.
        method: Name of one of `METHODS`.
        joint: Which joint of the hand it is.
        across: Axis of the tracker that lies across the finger while it is straight.
    """

    file: TrackFile
    upper: str
    lower: str
    joint: str
    clusters: str = ""
    method: str = next(iter(METHODS))
    across: Across = "y"


@dataclass(frozen=True, slots=True, eq=False)
class JointAnswer:
    """What came of it.

    Attributes:
        study: Everything there is to show.
        joint: Of the hand.
        source: The file, or nothing of a virtual finger.
        off_m: How far a virtual finger's true centre is from where it was found [m].
    """

    study: JointStudy
    joint: str
    source: str = ""
    off_m: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Finger:
    """A virtual finger that is held straight and bent, with a terminal on each side of a joint.

    Attributes:
        joint: Which.
        upper: What the tracker tells of the terminal nearer to the hand.
        lower: Of the other one.
        t_room_centre: Where the joint truly is [m].
    """

    joint: str
    upper: Track
    lower: Track
    t_room_centre: Float[Array, "n 3"]


def looked_into(name: str, content: bytes | None) -> TrackFile:
    """What a file holds.

    Raises:
        TrackError: it cannot be read.
    """

    def look(path: Path) -> TrackFile:
        if path.suffix.lower() == ".csv" or not path.is_file():
            terminals = tuple(track.name for track in read_tracks(path))
            return TrackFile(name, content, terminals)
        return TrackFile(name, content, markers=read_markers(path).names)

    return _with_file(name, content, look)


def clusters_of(text: str) -> dict[str, tuple[str, ...]]:
    """Which markers make a terminal, from ``NAME=a,b,c; NAME=d,e,f``.

    Raises:
        TrackError: it is not written so.
    """
    found: dict[str, tuple[str, ...]] = {}
    for part in filter(None, (each.strip() for each in text.split(";"))):
        name, equals, markers = (each.strip() for each in part.partition("="))
        names = tuple(each.strip() for each in markers.split(",") if each.strip())
        if not (equals and name and names):
            raise TrackError(
                "{text!r} names no markers of a terminal.",
                "Write NAME=marker,marker,marker.",
                text=part,
            )
        found[name] = names
    return found


def find_joint(order: JointOrder, tell: Tell) -> JointAnswer:
    """Read both terminals and find the joint between them.

    Raises:
        TrackError: what is wrong with file or tracks leaves nothing to find a joint from.
    """
    tell(0.05)
    clusters = clusters_of(order.clusters) if order.file.markers else {}
    if order.file.markers and not clusters:
        raise TrackError(
            "{file} holds markers, and nothing says which of them make a terminal.",
            "Write under Clusters: NAME=marker,marker,marker; NAME=... It has {markers}.",
            file=Path(order.file.name).name,
            markers=", ".join(order.file.markers),
        )
    tracks = _with_file(
        order.file.name, order.file.content, lambda path: read_tracks(path, clusters)
    )
    tell(0.5)
    upper, lower = _two(order, {track.name: track for track in tracks})
    method, width = method_named(order.method), np.array(_AXES[order.across])
    found = study(upper, lower, methods=(method,), width=width)
    tell(1.0)
    return JointAnswer(found, order.joint, Path(order.file.name).name)


def virtual_finger(joint: str, number: int, tell: Tell) -> Finger:
    """A virtual person of this number bends this joint for 20 s, after 3 s of holding it straight.

    Skin slides and rocks, terminals are tugged at and noisy, but nothing knocks against them.
    """
    from handstudio.simulation.bending import bending  # noqa: PLC0415 - takes a while
    from handstudio.simulation.imperfections.strengths import parse  # noqa: PLC0415
    from handstudio.simulation.motions.actor import Actor  # noqa: PLC0415
    from handstudio.simulation.subject import subject  # noqa: PLC0415
    from handstudio.simulation.trackers import TrackerErrors, tracked  # noqa: PLC0415

    tell(0.05)
    beside = next((each.parent, each.child) for each in JOINTS if each.name == joint)
    segments = (beside[0] or "", beside[1])
    someone = subject(number)
    told = tracked(
        someone,
        bending(Actor(someone), joint, _BENT_S),
        segments,
        TrackerErrors(tug_rad=_TUGGED),
        number,
        skin=parse(_SKIN),
        base="hand" if segments[0] not in ("hand", "hand_ulnar") else None,
        rate_hz=_RATE_HZ,
    )
    tell(1.0)
    upper, lower = told.tracks
    return Finger(joint, upper, lower, told.t_room_joint[:, SEGMENTS.index(segments[1])])


_BENT_S = 20.5  # a little longer than the course lasts


def judged(course: JointCourse, piece: Poses, finger: Finger, tell: Tell) -> JointAnswer:
    """The end of a guided course: its last poses come, and the joint is found.

    Raises:
        TrackError: there is none to be found.
    """
    tell(0.1)
    course = advance(course, piece)
    if course.study is None:
        raise course.refused or unfinished(course)
    tell(1.0)
    return JointAnswer(course.study, finger.joint, off_m=off_truth_m(course.study, finger))


def unfinished(course: JointCourse) -> TrackError:
    """Why a course ended without a verdict."""
    return TrackError(
        "The finger was not held straight for 3 s: it moved {count} times.",
        "Begin anew, and hold it still at first.",
        count=course.moved,
    )


def off_truth_m(found: JointStudy, finger: Finger) -> float | None:
    """How far the true centre is from where it was found, in the mean over both terminals [m]."""
    first = next(iter(found.found.values()), None)
    if first is None:
        return None
    sides = (finger.upper, first.estimate.p_upper), (finger.lower, first.estimate.p_lower)
    return float(np.mean([_off(track, finger.t_room_centre, point) for track, point in sides]))


def _off(track: Track, centre: Array, point: Array) -> float:
    """Of one terminal: what goes to and fro with every swing is not counted."""
    bent = track.time_us >= track.time_us[0] + 3_000_000
    back = so3.conjugate(track.q_room_terminal)
    seen = so3.rotate(back, centre - track.t_room_terminal)[bent]
    return float(np.linalg.norm(np.nanmean(seen, axis=0) - point))


def _two(order: JointOrder, known: dict[str, Track]) -> tuple[Track, Track]:
    names = order.upper, order.lower
    if len(known) < 2 or order.upper == order.lower or any(name not in known for name in names):
        raise TrackError(
            "{file} has the terminals {known}; chosen were {upper} and {lower}. A joint lies "
            "between two.",
            "Choose the terminal nearer to the hand as the upper one, and another as the lower.",
            file=Path(order.file.name).name,
            known=", ".join(known),
            upper=order.upper or "–",
            lower=order.lower or "–",
        )
    return known[order.upper], known[order.lower]


def _with_file(name: str, content: bytes | None, use: Callable[[Path], T]) -> T:
    """A file of this computer, or what a page sent: words then have its name, not its place."""
    if content is None:
        return use(Path(name).expanduser())
    with tempfile.TemporaryDirectory(prefix="handstudio-") as place:
        sent = Path(place) / (Path(name).name or "sent")
        sent.write_bytes(content)
        try:
            return use(sent)
        except HandstudioError as error:
            raise error.about(path=sent.name) from error
