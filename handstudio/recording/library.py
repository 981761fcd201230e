"""The library: where takes live, which there are, what a new one is called.

``<sessions>/<subject>/<visit>/<take>.mcap``; a visit is a day unless it is given a name.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeAlias

import platformdirs

from handstudio.errors import HandstudioError, TakeError
from handstudio.recording.held import is_held
from handstudio.recording.moves import settle
from handstudio.recording.naming import (
    TAKE,
    UNFINISHED,
    VIEW,
    file_name,
    free_path,
    is_unfinished,
    same_name,
    take_stem,
)
from handstudio.recording.notes import Notes, load_notes, notes_path
from handstudio.recording.take import Take, open_take

Stamp: TypeAlias = tuple[int, int, int]
"""Time of the last change [ns], size [bytes] and number of a file; zeros where there is none."""

_NO_FILE: Stamp = (0, 0, 0)

CALIBRATIONS = "calibrations"
"""Folder of a subject that is no visit: every calibration there ever was."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A file of the library: a take, or why it cannot be opened.

    Attributes:
        path: The file; its name is the take's name on screen, whatever the header says.
        take: The take; None where it cannot be opened.
        error: Why not, and what to do about it.
        recording: Whether the file is being written now, here or by another program.
        notes: What a person added.
        notes_error: Why the notes cannot be read; they count as empty then.
        stamp: State of the file when it was read.
        notes_stamp: The same of the notes.
    """

    path: Path
    take: Take | None
    error: HandstudioError | None = None
    recording: bool = False
    notes: Notes = Notes()
    notes_error: HandstudioError | None = None
    stamp: Stamp = _NO_FILE
    notes_stamp: Stamp = _NO_FILE

    @property
    def problem(self) -> str:
        """Why it cannot be opened, in English; empty where it can."""
        return "" if self.error is None else self.error.what

    @property
    def remedy(self) -> str:
        """What to do about that, in English; empty where there is nothing to do."""
        return "" if self.error is None else self.error.remedy

    @property
    def subject(self) -> str:
        """Code of the person: the name of the folder."""
        return self.path.parent.parent.name

    @property
    def visit(self) -> str:
        """The visit: a day, or its name."""
        return self.path.parent.name

    @property
    def name(self) -> str:
        """The take's name: its file's."""
        return take_stem(self.path)

    @property
    def start(self) -> datetime | None:
        """When the recording began, UTC; None where it is not known."""
        if self.take is None:
            return None
        try:
            return datetime.fromtimestamp(self.take.header.start_utc_ns * 1e-9, UTC)
        except (OverflowError, OSError, ValueError):  # a clock that was never set
            return None


def sessions_folder(chosen: Path | None = None) -> Path:
    """Where takes live: the one chosen, else a checkout's own, else the user's data folder."""
    if chosen is not None:
        return chosen
    here = Path.cwd()
    if (here / "sessions").is_dir() and (here / "pyproject.toml").is_file():
        return here / "sessions"
    return platformdirs.user_data_path("handstudio", appauthor=False) / "sessions"


def entries(sessions: Path, known: Iterable[Entry] = ()) -> list[Entry]:
    """Every take and every interrupted recording, newest first.

    Args:
        sessions: The library.
        known: What was listed before: of this, only files that changed since are read again.
    """
    settle(sessions)
    before = {entry.path: entry for entry in known}
    found = [_entry(path, before.get(path)) for path in take_files(sessions)]
    return sorted(found, key=lambda entry: (entry.stamp[0], entry.path), reverse=True)


def take_files(sessions: Path) -> list[Path]:
    """The file of every take and every interrupted recording, in no order."""
    return [
        Path(file.path)
        for subject in folders(sessions)
        for visit in folders(subject)
        for file in _scan(visit)
        if file.name.endswith((TAKE, TAKE + UNFINISHED)) and not file.name.startswith(".")
        if not file.name.endswith(VIEW)
    ]


def folders(parent: Path) -> list[Path]:
    """The folders in a folder, by name, without hidden ones; none where it cannot be read."""
    found = [Path(each.path) for each in _scan(parent) if each.is_dir()]
    return sorted(path for path in found if not path.name.startswith("."))


def visits(subject: Path) -> list[Path]:
    """The folders of a subject's visits, by name."""
    return [folder for folder in folders(subject) if not same_name(folder.name, CALIBRATIONS)]


def subject_folder(sessions: Path, code: str) -> Path:
    """Where a subject's takes lie: the folder there is, also if it is written ``s01`` for ``S01``.

    Raises:
        TakeError: the code leaves nothing to call a folder.
    """
    return _folder_called(sessions, file_name(code, "subject"))


def new_take_path(sessions: Path, subject: str, name: str, now: datetime, visit: str = "") -> Path:
    """A path no take has yet; a number is added to a name that is taken.

    Args:
        sessions: The library.
        subject: Code of the person.
        name: What to call the take.
        now: The day of the visit.
        visit: Name of the visit, where it is not the day.

    Raises:
        TakeError: subject, visit or name leave nothing to call a file, or no visit can be called
            so.
    """
    home = subject_folder(sessions, subject)
    called = file_name(visit, "visit") if visit.strip() else f"{now:%Y-%m-%d}"
    if same_name(called, CALIBRATIONS):
        raise TakeError(
            "No visit can be called {name}: calibrations are kept there.",
            "Give the visit another name.",
            name=called,
        )
    return free_path(_folder_called(home, called) / f"{file_name(name, 'take')}{TAKE}")


def located(sessions: Path, path: Path) -> Path:
    """A file of the library as the library writes its path.

    Raises:
        TakeError: it lies elsewhere.
    """
    real = path.parent.resolve() / path.name
    for inside, root in ((_absolute(path), _absolute(sessions)), (real, sessions.resolve())):
        if inside.is_relative_to(root):
            parts = inside.relative_to(root).parts
            if len(parts) == 3 and not any(part.startswith(".") for part in parts[:2]):
                return sessions.joinpath(*parts)
    raise TakeError(
        "{path}: is no take of the library {sessions}.",
        "Choose one of its takes, or the library it is in (--sessions FOLDER).",
        path=path,
        sessions=sessions,
    )


def _entry(path: Path, before: Entry | None) -> Entry:
    stamp, notes_stamp = _stamp(path), _stamp(notes_path(path))
    fresh = before is not None and (before.stamp, before.notes_stamp) == (stamp, notes_stamp)
    if before is not None and fresh and not is_unfinished(path):
        return before
    take, error = _opened(path)
    notes, notes_error = _noted(path)
    return Entry(
        path,
        take,
        error,
        is_unfinished(path) and is_held(path),
        notes,
        notes_error,
        stamp,
        notes_stamp,
    )


def _opened(path: Path) -> tuple[Take | None, HandstudioError | None]:
    if is_unfinished(path) and is_held(path):
        return None, TakeError(
            "{path}: is being recorded.", "End the recording to open it.", path=path
        )
    try:
        return open_take(path), None
    except HandstudioError as error:
        return None, error


def _noted(path: Path) -> tuple[Notes, HandstudioError | None]:
    try:
        return load_notes(path), None
    except HandstudioError as error:
        return Notes(), error


def _folder_called(parent: Path, name: str) -> Path:
    if (parent / name).is_dir():
        return parent / name
    alike = (folder for folder in folders(parent) if same_name(folder.name, name))
    return next(alike, parent / name)


def _stamp(path: Path) -> Stamp:
    try:
        status = path.stat()
    except OSError:
        return _NO_FILE
    return status.st_mtime_ns, status.st_size, status.st_ino


def _scan(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as found:
            return list(found)
    except OSError:
        return []


def _absolute(path: Path) -> Path:
    return Path(os.path.abspath(path))  # noqa: PTH100 - links stay as they are
