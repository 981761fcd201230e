"""Renaming takes and editing notes, and taking back what was done."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

import msgspec

from handstudio.errors import TakeError
from handstudio.recording.bin import UndoBin, refuse_absent, renamed, restore
from handstudio.recording.library import located
from handstudio.recording.moves import move, settle
from handstudio.recording.naming import (
    TAKE,
    UNFINISHED,
    closed_path,
    file_name,
    free_path,
    is_free,
    is_unfinished,
    same_name,
    take_stem,
)
from handstudio.recording.notes import Notes, load_notes, save_notes


class UndoRename(msgspec.Struct, frozen=True, tag="rename"):
    """How to take back a new name.

    Attributes:
        path: The take, as it is called now.
        before: The take, as it was called.
    """

    path: Path
    before: Path


class UndoNotes(msgspec.Struct, frozen=True, tag="notes"):
    """How to take back what was written into the notes of a take."""

    path: Path
    before: Notes


Undo: TypeAlias = UndoRename | UndoBin | UndoNotes
"""What `undo` takes back."""


def rename_take(sessions: Path, take: Path, name: str) -> UndoRename:
    """Give a take another name, with all that belongs to it but exports.

    The raw file does not change, so its header keeps the name of the day: the file's name counts.

    Raises:
        TakeError: the name is taken or no name, the take is not closed or not in the library, or
            the folder cannot be written.
    """
    path = located(sessions, take)
    settle(sessions)
    if is_unfinished(path):
        raise TakeError(
            "{path}: is a recording that is not closed.",
            "End the recording, or recover it where it was interrupted, then rename the take.",
            path=path,
        )
    refuse_absent(path)
    target = path.with_name(file_name(name, "take") + TAKE)
    if target != path:
        _refuse_taken(path, target)
        move(sessions, renamed(path, target))
    return UndoRename(target, path)


def edit_notes(take: Path, notes: Notes) -> UndoNotes:
    """Store notes beside a take, closed or being recorded.

    Raises:
        TakeError: they cannot be written; the notes before are still there.
    """
    before = load_notes(take)
    save_notes(take, notes)
    return UndoNotes(take, before)


def undo(sessions: Path, value: Undo) -> Path:
    """Take back what was done; the take's path afterwards.

    Raises:
        TakeError: the take is no longer there, or the folder cannot be written.
    """
    match value:
        case UndoBin(key=key):
            return restore(sessions, key)
        case UndoRename(path=path, before=before):
            return _undo_rename(sessions, path, before)
        case UndoNotes(path=path, before=notes):
            closed = closed_path(path)
            if not closed.with_name(closed.name + UNFINISHED).exists():
                refuse_absent(closed)
            save_notes(path, notes)
            return path


def _undo_rename(sessions: Path, path: Path, before: Path) -> Path:
    settle(sessions)
    refuse_absent(path)
    if path == before:
        return path
    target = before if same_name(path.name, before.name) else free_path(before)
    move(sessions, renamed(path, target))
    return target


def _refuse_taken(path: Path, target: Path) -> None:
    """A name counts as taken also where only another system takes both for the same."""
    others = {take_stem(each) for each in path.parent.iterdir() if _is_take(each)} - {
        take_stem(path)
    }
    stem = take_stem(target)
    only_the_case = same_name(stem, take_stem(path))
    if any(same_name(stem, other) for other in others) or not (only_the_case or is_free(target)):
        raise TakeError(
            "{name}: another take of this visit has this name.",
            "Choose a name that is free.",
            name=stem,
        )


def _is_take(path: Path) -> bool:
    return closed_path(path).name.endswith(TAKE)
