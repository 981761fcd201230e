"""The bin: takes that somebody no longer wants, until it is emptied.

``<sessions>/.bin/<stamp>-<take>/<subject>/<visit>/<take>.mcap``: where a take came from is told by
the folders it lies in, so that there is no record that could be lost.
"""

from __future__ import annotations

import contextlib
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec

from handstudio.errors import TakeError
from handstudio.recording.held import is_held
from handstudio.recording.library import folders, located, take_files
from handstudio.recording.moves import move, settle
from handstudio.recording.naming import belongings, cut, free_path, is_unfinished, take_stem

FOLDER = ".bin"

_STAMP = "%Y%m%d-%H%M%S"


@dataclass(frozen=True, slots=True)
class Binned:
    """A take in the bin.

    Attributes:
        key: What `restore` asks for: the name of its folder in the bin.
        path: The file, as it lies in the bin.
        origin: Where it was.
        when: When it was put there, UTC.
    """

    key: str
    path: Path
    origin: Path
    when: datetime

    @property
    def subject(self) -> str:
        """Code of the person."""
        return self.origin.parent.parent.name

    @property
    def visit(self) -> str:
        """The visit: a day, or its name."""
        return self.origin.parent.name

    @property
    def name(self) -> str:
        """The take's name."""
        return take_stem(self.origin)


class UndoBin(msgspec.Struct, frozen=True, tag="bin"):
    """How to take back that a take was put in the bin."""

    key: str


def move_to_bin(sessions: Path, take: Path, now: datetime) -> UndoBin:
    """Put a take, or an interrupted recording, in the bin with all that belongs to it but exports.

    Raises:
        TakeError: it is being recorded, is not in the library, or cannot be moved.
    """
    path = located(sessions, take)
    settle(sessions)
    refuse_absent(path)
    if is_unfinished(path) and is_held(path):
        raise TakeError(
            "{path}: is being recorded.", "End the recording, then put it in the bin.", path=path
        )
    entry = _free_entry(sessions, f"{now.astimezone(UTC):{_STAMP}}-{cut(take_stem(path))}")
    target = entry / path.parent.relative_to(sessions)
    try:
        move(sessions, [(each, target / each.name) for each in belongings(path)])
    except TakeError:
        _tidy(sessions, target)
        raise
    return UndoBin(entry.name)


def list_bin(sessions: Path) -> list[Binned]:
    """The takes in the bin, last put there first."""
    settle(sessions)
    found = [
        Binned(entry.name, path, sessions / path.relative_to(entry), _put_there(entry))
        for entry in folders(sessions / FOLDER)
        for path in take_files(entry)
    ]
    return sorted(found, key=lambda binned: (binned.when, binned.key), reverse=True)


def restore(sessions: Path, key: str) -> Path:
    """Put a take of the bin back where it was, or beside what has taken its place; where it is now.

    Raises:
        TakeError: it is not in the bin, or cannot be moved.
    """
    for binned in list_bin(sessions):
        if binned.key == key:
            break
    else:
        raise TakeError(
            "{key}: is not in the bin.", "Choose one that is: handstudio bin lists them.", key=key
        )
    target = free_path(binned.origin)
    move(sessions, renamed(binned.path, target))
    _tidy(sessions, binned.path.parent)
    return target


def empty_bin(sessions: Path, now: datetime, older_than_days: float = 0.0) -> int:
    """Remove what is in the bin, for good; how many entries there were.

    Args:
        sessions: The library.
        now: The time to count days from.
        older_than_days: What was put there later stays.

    Raises:
        TakeError: something cannot be removed; all else is.
    """
    settle(sessions)
    limit = now.astimezone(UTC) - timedelta(days=older_than_days)
    old = [
        entry
        for entry in folders(sessions / FOLDER)
        if older_than_days <= 0.0 or _put_there(entry) <= limit
    ]
    for entry in old:
        shutil.rmtree(entry, ignore_errors=True)
    with contextlib.suppress(OSError):
        (sessions / FOLDER).rmdir()
    left = [entry for entry in old if entry.exists()]
    if left:
        raise TakeError(
            "{path}: cannot be removed.",
            "Close what uses it and check the folder's permissions, then empty the bin again.",
            path=left[0],
        )
    return len(old)


def renamed(path: Path, target: Path) -> list[tuple[Path, Path]]:
    """Each file of a take, and where it goes when the take's file goes to ``target``."""
    stem, new = take_stem(path), take_stem(target)
    return [
        (each, target.with_name(new + each.name.removeprefix(stem))) for each in belongings(path)
    ]


def refuse_absent(path: Path) -> None:
    """Raises TakeError where there is no such file."""
    if not path.is_file():
        raise TakeError("{path}: is not there.", "Look for it in the library again.", path=path)


def _free_entry(sessions: Path, name: str) -> Path:
    number, entry = 1, sessions / FOLDER / name
    while entry.exists():
        number += 1
        entry = sessions / FOLDER / f"{name}-{number}"
    return entry


def _put_there(entry: Path) -> datetime:
    try:
        return datetime.strptime(entry.name[:15], _STAMP).replace(tzinfo=UTC)
    except ValueError:  # a folder somebody put there
        return datetime.fromtimestamp(entry.stat().st_mtime, UTC)


def _tidy(sessions: Path, folder: Path) -> None:
    """Remove empty folders of the bin, from this one upwards."""
    with contextlib.suppress(OSError):
        while folder != sessions:
            folder.rmdir()
            folder = folder.parent
