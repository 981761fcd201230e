"""A take, and an earlier one of the same hand → measures and what changed: for page and shell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import TypeAlias

import msgspec
import numpy as np
from msgspec.structs import replace

from handstudio import __version__
from handstudio.analysis.change import Change, changes
from handstudio.analysis.measure import Measure, missing
from handstudio.analysis.posture_time import DEFAULT_BANDS, Band
from handstudio.analysis.series import series_of
from handstudio.analysis.sides import SideRatio, against_other_side
from handstudio.analysis.whole import Asked, measures_of
from handstudio.errors import TakeError
from handstudio.export.part import Window, cut
from handstudio.hand.angles import hand_angles
from handstudio.pipeline import Motion
from handstudio.process import process
from handstudio.recording.notes import stretches
from handstudio.recording.take import Take
from handstudio.setup import Setup

Progress: TypeAlias = Callable[[float], None]


class Visit(msgspec.Struct, frozen=True):
    """What was measured: who, when, by what.

    Attributes:
        subject: Code of the person.
        side: Which hand.
        take: Name of the take.
        visit: Name of the visit: the take's folder.
        start_utc: When the recording began, ISO 8601.
        start_s, end_s: The part of the take.
        known_percent: How much of all angles of that part is known and not in doubt.
        calibration: Id of the subject calibration, or that there is none.
        zero: What angles are measured from.
        filter: Name of the filter.
        smooth: Whether the future was taken in.
        uncertainty_told: Whether the filter tells how sure it is.
        software: Which version measured.
        raw_sha256: Of the take's file.
    """

    subject: str
    side: str
    take: str
    visit: str
    start_utc: str
    start_s: float
    end_s: float
    known_percent: float
    calibration: str
    zero: str
    filter: str
    smooth: bool
    uncertainty_told: bool
    software: str
    raw_sha256: str


class Measured(msgspec.Struct, frozen=True):
    """Measures of a take, and what changed since an earlier one.

    Attributes:
        visit: What was measured.
        measures: All of them, also those that cannot be given, and why.
        earlier: What it is compared with.
        changes: Of every measure that both have.
        other_side: The take of the other hand it is held against.
        sides: Ranges and scores as shares of that hand's.
    """

    visit: Visit
    measures: tuple[Measure, ...]
    earlier: Visit | None = None
    changes: tuple[Change, ...] = ()
    other_side: Visit | None = None
    sides: tuple[SideRatio, ...] = ()


def measure(
    take: Take,
    setup: Setup | None = None,
    window: Window | None = None,
    *,
    earlier: Take | None = None,
    other_side: Take | None = None,
    bands: Sequence[Band] = DEFAULT_BANDS,
    progress: Progress = lambda _: None,
) -> Measured:
    """Measure a take or a part of it, and compare with the whole of an earlier one.

    Args:
        take: The recording.
        setup: Another setup than the take's own.
        window: The part; all of it unless given.
        earlier: A take of the same hand of the same person.
        other_side: A take of the other hand of the same person; all of it is measured.
        bands: Postures whose time is counted.
        progress: Told how far it is.

    Raises:
        TakeError: the part holds no instant, a take cannot be read, the earlier one is of
            another hand, or the other side's of the same or somebody else's.
    """
    if earlier is not None:
        _refuse_strangers(take, earlier)
    if other_side is not None:
        _refuse_same_side(take, other_side)
    beside = [one for one in (earlier, other_side) if one is not None]
    share = 1.0 / (1 + len(beside))

    def part_of(turn: int) -> Progress:
        return lambda done: progress(share * (turn + done))

    visit, found = _one(take, setup, window, bands, part_of(0))
    measured = Measured(visit, tuple(found))
    if earlier is not None:
        before, old = _one(earlier, None, None, bands, part_of(1))
        measured = replace(measured, earlier=before, changes=tuple(changes(old, found)))
    if other_side is not None:
        other, theirs = _one(other_side, None, None, bands, part_of(len(beside)))
        sides = tuple(against_other_side(found, theirs))
        measured = replace(measured, other_side=other, sides=sides)
    return measured


def band_of(text: str) -> Band:
    """A posture as it is typed: ``NAME=ANGLE:FROM:TO`` in degrees, either end may be empty.

    Raises:
        TakeError: it is not written so, or there is no such angle.
    """
    name, _, rest = text.partition("=")
    angle, *ends = rest.split(":")
    known = [one.name for one in hand_angles()]
    try:
        above, below = (float(end) if end.strip() else None for end in ends)
    except ValueError:
        above = below = None
    if not name.strip() or angle not in known or (above is None and below is None):
        raise TakeError(
            "{text!r} is no posture.",
            "Write NAME=ANGLE:FROM:TO in degrees, such as bent=wrist_flexion:15: (one end may be "
            "empty); angles are named as in an export of angles.",
            text=text,
        )
    return Band(name.strip(), angle, above, below)


def band_from(name: str, angle: str, above: str, below: str) -> Band:
    """A posture of which every part was typed by itself; either end may be empty.

    Raises:
        TakeError: no end is a number of degrees, or the first is not the lesser one.
    """
    try:
        least, most = (float(text) if text.strip() else None for text in (above, below))
    except ValueError:
        least = most = None
    known = [end for end in (least, most) if end is not None]
    if not known or not np.isfinite(known).all() or known != sorted(set(known)):
        raise TakeError(
            "From {above!r} to {below!r} is no range of degrees.",
            "Give both ends as numbers, the lesser one first, or leave one empty.",
            above=above,
            below=below,
        )
    return Band(name.strip(), angle, least, most)


def bands_with(own: Sequence[Band]) -> tuple[Band, ...]:
    """The usual postures and one's own; of two of a name one's own counts."""
    return tuple({band.name: band for band in (*DEFAULT_BANDS, *own)}.values())


def _one(
    take: Take,
    setup: Setup | None,
    window: Window | None,
    bands: Sequence[Band],
    progress: Progress,
) -> tuple[Visit, list[Measure]]:
    chosen = setup or take.header.setup
    motion = process(take, chosen, progress=lambda done: progress(0.5 * done))
    window = window or Window()
    part = cut(motion, window)
    if not chosen.layout.is_hand:
        progress(1.0)
        return _visit(take, chosen, motion, part, 0.0), [missing("range", "", "deg", "no_hand")]
    series = series_of(chosen, part, start_us=int(motion.time_us[0]))
    asked = Asked(_labels(take), tuple(bands))
    found = measures_of(chosen, part, series, asked, lambda done: progress(0.5 + 0.5 * done))
    known = 100.0 * float(np.isfinite(series.angles).mean()) if series.angles.size else 0.0
    return _visit(take, chosen, motion, part, known), found


def _labels(take: Take) -> tuple[tuple[float, float, str], ...]:
    try:
        return tuple(stretches(take.path))
    except TakeError:  # notes that cannot be read: the motion can be measured all the same
        return ()


def _visit(take: Take, setup: Setup, motion: Motion, part: Motion, known: float) -> Visit:
    header = take.header
    first = int(motion.time_us[0])
    start = datetime.fromtimestamp(header.start_utc_ns * 1e-9, UTC)
    return Visit(
        subject=header.subject,
        side=setup.layout.side,
        take=take.path.stem,
        visit=take.path.parent.name,
        start_utc=start.isoformat(timespec="seconds"),
        start_s=(int(part.time_us[0]) - first) * 1e-6,
        end_s=(int(part.time_us[-1]) - first) * 1e-6,
        known_percent=known,
        calibration=setup.calibration,
        zero=setup.zero,
        filter=msgspec.to_builtins(setup.filter)["type"],
        smooth=setup.smooth,
        uncertainty_told=bool(np.isfinite(part.sd_rad[-1]).all()),
        software=f"handstudio {__version__}",
        raw_sha256=take.sha256(),
    )


def _refuse_strangers(take: Take, earlier: Take) -> None:
    of, before = take.header, earlier.header
    if (of.subject, of.setup.layout.side) != (before.subject, before.setup.layout.side):
        raise TakeError(
            "{earlier} is of {other} ({other_side}), {take} of {subject} ({side}).",
            "Compare takes of the same hand of the same person.",
            earlier=earlier.path.name,
            other=before.subject,
            other_side=before.setup.layout.side,
            take=take.path.name,
            subject=of.subject,
            side=of.setup.layout.side,
        )
    if before.start_utc_ns > of.start_utc_ns:
        raise TakeError(
            "{earlier} was recorded after {take}.",
            "Name the earlier one as the earlier one.",
            earlier=earlier.path.name,
            take=take.path.name,
        )


def _refuse_same_side(take: Take, other: Take) -> None:
    sides = {take.header.setup.layout.side, other.header.setup.layout.side}
    if take.header.subject != other.header.subject or sides != {"left", "right"}:
        raise TakeError(
            "{other} is of {whose} ({other_side}), {take} of {subject} ({side}).",
            "Compare with a take of the other hand of the same person.",
            other=other.path.name,
            whose=other.header.subject,
            other_side=other.header.setup.layout.side,
            take=take.path.name,
            subject=take.header.subject,
            side=take.header.setup.layout.side,
        )
