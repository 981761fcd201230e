"""Notes beside a take: labels and words added later. The take itself never changes."""

from __future__ import annotations

from pathlib import Path

import msgspec

from handstudio.errors import TakeError
from handstudio.recording.atomic import BACKUP, write_atomically


class Label(msgspec.Struct, frozen=True):
    """A named stretch of time, seconds from the first instant of the take."""

    start_s: float
    end_s: float
    label: str


class Notes(msgspec.Struct, frozen=True):
    """Everything a person added to a take."""

    labels: tuple[Label, ...] = ()
    text: str = ""


def notes_path(take: Path) -> Path:
    """Where the notes of a take live."""
    return take.with_suffix(".notes.json")


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
        except (OSError, msgspec.MsgspecError) as error:
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
    try:
        write_atomically(path, msgspec.json.format(msgspec.json.encode(notes)))
    except OSError as error:
        raise TakeError(
            "{path}: cannot be written ({reason}).",
            "Free some space or check the folder's permissions.",
            path=path,
            reason=error.strerror or error,
        ) from error
