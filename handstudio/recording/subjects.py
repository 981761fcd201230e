"""Subjects: a code, which hand, how long it is. A code only: no name is needed.

``<sessions>/<code>/subject.json``. A folder of takes without it is a subject too.
"""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import msgspec

from handstudio.errors import HandstudioError, TakeError
from handstudio.recording.atomic import BACKUP, write_json
from handstudio.recording.library import folders, visits
from handstudio.recording.naming import file_name, same_name

FILE = "subject.json"

HAND_MM = 50.0, 400.0
"""Lengths that a hand may have, and metres or inches have not."""

Side: TypeAlias = Literal["left", "right", ""]
"""Which hand; empty: not known."""


class Subject(msgspec.Struct, frozen=True):
    """A person as the studio knows one.

    Attributes:
        code: What the person is called here; also the name of the folder.
        side: Which hand.
        hand_length_mm: Wrist crease to the tip of the middle finger; None: not known.
        note: Free words.
    """

    code: str
    side: Side = ""
    hand_length_mm: float | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Known:
    """A subject of the library; what its file says, or why that cannot be read."""

    subject: Subject
    visits: tuple[str, ...]
    error: HandstudioError | None = None


def list_subjects(sessions: Path) -> list[Known]:
    """Every subject, by code; one whose file cannot be read has an error and nothing known."""
    return [_known(sessions, folder) for folder in folders(sessions)]


def load_subject(sessions: Path, code: str) -> Subject:
    """A subject; side and length unknown where nobody told them.

    Raises:
        TakeError: there is none of this code, or neither its file nor the backup can be read.
    """
    return _read(existing(sessions, code))


def create_subject(sessions: Path, subject: Subject) -> Subject:
    """Add a subject.

    Raises:
        TakeError: the code is no name of a folder, or some system takes it for one there is; the
            hand has no such length; or the folder cannot be written.
    """
    code = _valid(subject.code)
    for folder in folders(sessions):
        if same_name(folder.name, code):
            raise TakeError(
                "There is a subject {code} already.",
                "Choose another code, or go on with this one.",
                code=folder.name,
            )
    return _write(sessions, msgspec.structs.replace(subject, code=code))


def save_subject(sessions: Path, subject: Subject) -> Subject:
    """Store what changed of a subject; the content before stays as a backup.

    Raises:
        TakeError: there is none of this code, the hand has no such length, or the folder cannot be
            written.
    """
    code = existing(sessions, subject.code).name
    return _write(sessions, msgspec.structs.replace(subject, code=code))


def existing(sessions: Path, code: str) -> Path:
    """The folder of a subject there is.

    Raises:
        TakeError: there is none of this code.
    """
    there = {folder.name: folder for folder in folders(sessions)}
    alike = [folder for name, folder in there.items() if same_name(name, code)]
    for folder in (there.get(code), *alike):
        if folder is not None:
            return folder
    raise TakeError(
        "There is no subject {code}.", "Choose one that there is: handstudio subjects.", code=code
    )


def _valid(code: str) -> str:
    clean = file_name(code, "subject")
    if clean != unicodedata.normalize("NFC", code.strip()):
        raise TakeError(
            "{code}: cannot be the code of a subject.",
            "Use letters, digits and - + . _ only, up to 80; for example {clean}.",
            code=code,
            clean=clean,
        )
    return clean


def _known(sessions: Path, folder: Path) -> Known:
    names = tuple(visit.name for visit in visits(folder))
    try:
        return Known(_read(folder), names)
    except TakeError as error:
        return Known(Subject(folder.name), names, error)


def _read(folder: Path) -> Subject:
    path = folder / FILE
    backup = path.with_name(FILE + BACKUP)
    problem: Exception | None = None
    for candidate in (path, backup):
        try:
            read = msgspec.json.decode(candidate.read_bytes(), type=Subject)
        except FileNotFoundError:
            continue
        except (OSError, ValueError) as error:  # ValueError: no JSON, or no UTF-8
            problem = problem or error
        else:
            return msgspec.structs.replace(read, code=folder.name)
    if problem is None:
        return Subject(folder.name)
    raise TakeError(
        "{path}: what is known of the subject cannot be read ({reason}).",
        "Enter side and length of the hand again; the takes are not touched.",
        path=path,
        reason=problem,
    )


def _write(sessions: Path, subject: Subject) -> Subject:
    _refuse_length(subject.hand_length_mm)
    path = sessions / subject.code / FILE
    write_json(path, subject)
    return subject


def _refuse_length(length_mm: float | None) -> None:
    shortest, longest = HAND_MM
    if length_mm is not None and not shortest <= length_mm <= longest:
        raise TakeError(
            "A hand is not {length:g} mm long.",
            "Give it in millimetres, from the wrist crease to the tip of the middle finger: "
            "{shortest:g} to {longest:g}.",
            length=length_mm,
            shortest=shortest,
            longest=longest,
        )
