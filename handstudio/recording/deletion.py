"""Removing a subject with everything there is of it. This cannot be taken back."""

from __future__ import annotations

import contextlib
import os
import shutil
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from handstudio.errors import TakeError
from handstudio.recording import bin as bin_
from handstudio.recording.held import is_held
from handstudio.recording.library import Entry, entries, folders, take_files, visits
from handstudio.recording.moves import settle
from handstudio.recording.naming import file_name, is_unfinished
from handstudio.recording.subjects import existing


@dataclass(frozen=True, slots=True)
class Removal:
    """What deleting a subject removes.

    Attributes:
        code: The subject.
        takes: Takes and interrupted recordings in the library.
        in_bin: The same in the bin.
        visits: Folders of visits.
        minutes: How long the takes are that say so, the bin included.
        bytes: What all its files take on the disk.
        elsewhere: What is not removed: takes below other subjects whose header has this code, and
            what links in the subject's folder point to.
    """

    code: str
    takes: int
    in_bin: int
    visits: int
    minutes: float
    bytes: int
    elsewhere: tuple[Path, ...] = ()


def what_deleting_removes(sessions: Path, code: str) -> Removal:
    """Count what `delete_subject` would remove.

    Raises:
        TakeError: there is no subject of this code.
    """
    settle(sessions)
    code = _code(sessions, code)
    listed = entries(sessions)
    own = [entry for entry in listed if entry.subject == code]
    binned = [
        entry
        for each in folders(sessions / bin_.FOLDER)
        for entry in entries(each)
        if entry.subject == code
    ]
    places = _places(sessions, code)
    files = [file for place in places for file in _files(place)]
    strangers = [e.path for e in listed if e.subject != code and _tells(e, code)]
    links = [file.resolve() for file in (*places, *files) if file.is_symlink()]
    return Removal(
        code,
        len(own),
        len(binned),
        len(visits(sessions / code)),
        sum(_seconds(entry) for entry in (*own, *binned)) / 60.0,
        sum(file.lstat().st_size for file in files),
        (*strangers, *links),
    )


def delete_subject(sessions: Path, code: str, typed: str) -> Removal:
    """Remove a subject with takes, calibrations and all in the bin; says what was removed.

    Files are removed, not overwritten: copies made elsewhere, and what an undelete tool may find
    on the disk, are beyond this. A second call goes on where a first one failed.

    Args:
        sessions: The library.
        code: The subject.
        typed: The code once more, as the person typed it.

    Raises:
        TakeError: it is not the same code, there is no such subject, one of its takes is being
            recorded, or something is left (which is named).
    """
    settle(sessions)
    code = _code(sessions, code)
    if _composed(typed) != _composed(code):
        raise TakeError(
            "“{typed}” was typed, the subject is {code}.",
            "Type the code exactly as it is shown to delete everything of this subject.",
            typed=typed,
            code=code,
        )
    _refuse_recording(sessions, code)
    removal = what_deleting_removes(sessions, code)
    for place in _places(sessions, code):
        _remove(place)
    settle(sessions)  # what was written down of moves names the subject too
    _tidy(sessions)
    left = [file for place in _places(sessions, code) for file in (*_files(place), place)]
    if left:
        raise TakeError(
            "{count} files of subject {code} cannot be removed: {path} is one of them.",
            "Close what uses them and check the folder's permissions, then delete the subject "
            "again.",
            count=len(left),
            code=code,
            path=left[0],
        )
    return removal


def _code(sessions: Path, code: str) -> str:
    """The code as the folders have it, those of the bin too."""
    try:
        return existing(sessions, code).name
    except TakeError:
        if any(place.name == code for place in _places(sessions, code)):
            return code  # all its takes are in the bin
        raise


def _composed(code: str) -> str:
    return unicodedata.normalize("NFC", code)  # some systems write accents apart


def _places(sessions: Path, code: str) -> list[Path]:
    """Where there is something of a subject; its own folder last, by which it is still found."""
    roots = [*folders(sessions / bin_.FOLDER), sessions]
    return [folder for root in roots for folder in folders(root) if folder.name == code]


def _files(place: Path) -> Iterator[Path]:
    for folder, inner, names in os.walk(place):
        links = [name for name in inner if (Path(folder) / name).is_symlink()]
        yield from (Path(folder) / name for name in (*names, *links))


def _tells(entry: Entry, code: str) -> bool:
    if entry.take is None:
        return False
    with contextlib.suppress(TakeError):
        return file_name(entry.take.header.subject, "subject") == code
    return False


def _seconds(entry: Entry) -> float:
    summary = entry.take.summary if entry.take else None
    return summary.duration_s if summary else 0.0


def _refuse_recording(sessions: Path, code: str) -> None:
    for path in take_files(sessions):
        if path.parent.parent.name == code and is_unfinished(path) and is_held(path):
            raise TakeError(
                "{path}: is being recorded.",
                "End the recording, then delete the subject.",
                path=path,
            )


def _remove(place: Path) -> None:
    if place.is_symlink():
        with contextlib.suppress(OSError):
            place.unlink()
    else:
        shutil.rmtree(place, ignore_errors=True)


def _tidy(sessions: Path) -> None:
    for folder in (*folders(sessions / bin_.FOLDER), sessions / bin_.FOLDER):
        with contextlib.suppress(OSError):
            folder.rmdir()
