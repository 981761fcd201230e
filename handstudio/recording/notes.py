"""Notes beside a take: labels, marks and words added later. The take itself never changes.

They may be written while the take is still being recorded: they lie where its closed file looks.
"""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import TypeVar

import msgspec

from handstudio.errors import TakeError
from handstudio.recording.atomic import BACKUP, write_json
from handstudio.recording.naming import closed_path

_Item = TypeVar("_Item")


class Label(msgspec.Struct, frozen=True):
    """A named stretch of time, seconds from the first instant of the take."""

    start_s: float
    end_s: float
    label: str


class Mark(msgspec.Struct, frozen=True):
    """A moment worth finding again, seconds from the first instant; it may have no words."""

    at_s: float
    text: str = ""


class Notes(msgspec.Struct, frozen=True):
    """Everything a person added to a take; labels and marks in order of time."""

    labels: tuple[Label, ...] = ()
    text: str = ""
    marks: tuple[Mark, ...] = ()


def stretches(take: Path) -> list[tuple[float, float, str]]:
    """The labels of a take as begin and end [s] and name, in order of time.

    Raises:
        TakeError: its notes cannot be read.
    """
    return sorted((each.start_s, each.end_s, each.label) for each in load_notes(take).labels)


def with_text(notes: Notes, text: str) -> Notes:
    """Notes with other words."""
    return msgspec.structs.replace(notes, text=text)


def with_mark(notes: Notes, at_s: float, text: str = "") -> Notes:
    """Notes with one more mark.

    Raises:
        TakeError: the time is no number.
    """
    _refuse_no_time(at_s)
    marks = sorted((*notes.marks, Mark(at_s, text)), key=lambda mark: mark.at_s)
    return msgspec.structs.replace(notes, marks=tuple(marks))


def without_mark(notes: Notes, mark: Mark) -> Notes:
    """Notes without this mark; as they are where it is gone already."""
    return msgspec.structs.replace(notes, marks=_without(notes.marks, mark))


def with_label(notes: Notes, start_s: float, end_s: float, label: str) -> Notes:
    """Notes with one more named stretch; begin and end in either order.

    Raises:
        TakeError: it has no name or no length, or a time is no number.
    """
    _refuse_no_time(start_s)
    _refuse_no_time(end_s)
    if not label.strip():
        raise TakeError("The stretch has no name.", "Type what happens in it.")
    if start_s == end_s:
        raise TakeError(
            "The stretch begins and ends at {at_s:.2f} s.",
            "Choose a begin and an end, or set a mark there.",
            at_s=start_s,
        )
    new = Label(min(start_s, end_s), max(start_s, end_s), label.strip())
    labels = sorted((*notes.labels, new), key=lambda each: (each.start_s, each.end_s))
    return msgspec.structs.replace(notes, labels=tuple(labels))


def without_label(notes: Notes, label: Label) -> Notes:
    """Notes without this named stretch; as they are where it is gone already."""
    return msgspec.structs.replace(notes, labels=_without(notes.labels, label))


def notes_path(take: Path) -> Path:
    """Where the notes of a take live, be it closed or still ``NAME.mcap.recording``."""
    return closed_path(take).with_suffix(".notes.json")


def load_notes(take: Path) -> Notes:
    """The notes of a take; empty where there are none.

    Raises:
        TakeError: neither the file nor its backup can be read.
    """
    path = notes_path(take)
    backup = path.with_name(path.name + BACKUP)
    problem: Exception | None = None
    for candidate in (path, backup):
        try:
            return msgspec.json.decode(candidate.read_bytes(), type=Notes)
        except FileNotFoundError:
            continue
        except (OSError, ValueError) as error:  # ValueError: no JSON, or no UTF-8
            problem = problem or error
    if problem is None:
        return Notes()
    raise TakeError(
        "{path}: the notes cannot be read ({reason}).",
        "Move it and {backup} away to go on without notes; the take itself is not touched.",
        path=path,
        reason=problem,
        backup=backup.name,
    )


def save_notes(take: Path, notes: Notes) -> None:
    """Store notes beside a take.

    Raises:
        TakeError: they cannot be written; the notes before are still there.
    """
    path = notes_path(take)
    write_json(path, notes)


def copy_notes(take: Path, other: Path) -> None:
    """Give another take the notes of this one; nothing where there are none to be had."""
    with contextlib.suppress(TakeError):
        notes = load_notes(take)
        if notes != Notes():
            save_notes(other, notes)


def _refuse_no_time(at_s: float) -> None:
    if not math.isfinite(at_s):
        raise TakeError("{at_s} is no time in a take.", "Choose a time in seconds.", at_s=at_s)


def _without(items: tuple[_Item, ...], one: _Item) -> tuple[_Item, ...]:
    if one not in items:
        return items
    at = items.index(one)
    return items[:at] + items[at + 1 :]
