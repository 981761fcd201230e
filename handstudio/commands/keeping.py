"""Keeping the library: what there is, renaming, the bin, subjects."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import tyro

from handstudio.commands.arguments import Json, Sessions, TakeFile
from handstudio.errors import TakeError
from handstudio.recording import bin as bin_
from handstudio.recording.deletion import Removal, what_deleting_removes
from handstudio.recording.deletion import delete_subject as delete
from handstudio.recording.housekeeping import rename_take
from handstudio.recording.library import Entry, entries, sessions_folder
from handstudio.recording.naming import is_unfinished
from handstudio.recording.search import search as found_in
from handstudio.recording.subjects import list_subjects
from handstudio.shell import err, out, print_json, print_table


def takes(*, search: str = "", sessions: Sessions = None, json: Json = False) -> int:
    """List the takes, newest first.

    Args:
        search: Only those in which all of these words stand: subject, visit, name, notes, day.
        sessions: Folder of the takes.
        json: Print JSON for a program instead of words.
    """
    rows = [_row(entry) for entry in found_in(entries(sessions_folder(sessions)), search)]
    if json:
        print_json(rows)
        return 0
    shown = [
        [row["name"], row["subject"], row["visit"], _seconds(row), row["state"], row["path"]]
        for row in rows
    ]
    print_table("Takes", ["take", "subject", "visit", "length", "state", "file"], shown)
    return 0


def rename(
    take: TakeFile,
    name: Annotated[str, tyro.conf.Positional],
    *,
    sessions: Sessions = None,
) -> int:
    """Give a take another name, its notes and motion with it.

    Args:
        take: The take.
        name: What to call it.
        sessions: Folder of the takes.
    """
    out.print(str(rename_take(sessions_folder(sessions), take, name).path))
    return 0


def bin(
    takes: Annotated[tuple[Path, ...], tyro.conf.Positional] = (),
    *,
    empty: bool = False,
    older_than_days: float = 0.0,
    sessions: Sessions = None,
    json: Json = False,
) -> int:
    """Put takes in the bin; without any, list what is in it.

    Args:
        takes: The takes.
        empty: Remove what is in the bin, for good.
        older_than_days: With --empty, only what was put there longer ago.
        sessions: Folder of the takes.
        json: Print JSON for a program instead of words.
    """
    folder, now = sessions_folder(sessions), datetime.now(UTC)
    if takes and empty:
        raise TakeError(
            "Takes were named, and the bin is to be emptied.",
            "Do one after the other: what is put in the bin can be had back until it is emptied.",
        )
    if empty:
        removed = bin_.empty_bin(folder, now, older_than_days)
        out.print(f"{removed} removed.")
        return 0
    if takes:
        keys = [bin_.move_to_bin(folder, take, now).key for take in takes]
        if json:
            print_json(keys)
            return 0
        for key in keys:
            out.print(f"{key}  (back with: handstudio restore '{key}')")
        return 0
    return _list_bin(folder, json)


def restore(
    keys: Annotated[tuple[str, ...], tyro.conf.Positional], *, sessions: Sessions = None
) -> int:
    """Put takes of the bin back where they were.

    Args:
        keys: Their names in the bin (handstudio bin lists them).
        sessions: Folder of the takes.
    """
    if not keys:
        raise TakeError("No take was named.", "Name them: handstudio restore NAME-IN-THE-BIN ...")
    for key in keys:
        out.print(str(bin_.restore(sessions_folder(sessions), key)))
    return 0


def subjects(*, sessions: Sessions = None, json: Json = False) -> int:
    """List the subjects.

    Args:
        sessions: Folder of the takes.
        json: Print JSON for a program instead of words.
    """
    folder = sessions_folder(sessions)
    counts: dict[str, int] = {}
    for entry in entries(folder):
        counts[entry.subject] = counts.get(entry.subject, 0) + 1
    known = list_subjects(folder)
    if json:
        print_json(
            [
                {
                    "subject": each.subject,
                    "visits": each.visits,
                    "takes": counts.get(each.subject.code, 0),
                    "problem": each.error.what if each.error else None,
                }
                for each in known
            ]
        )
        return 0
    rows = []
    for each in known:
        length = each.subject.hand_length_mm
        hand = [each.subject.side or "?", f"{length:g} mm" if length else "?"]
        count = str(counts.get(each.subject.code, 0))
        problem = each.error.what if each.error else ""
        rows.append([each.subject.code, *hand, str(len(each.visits)), count, problem])
    print_table("Subjects", ["code", "hand", "length", "visits", "takes", ""], rows)
    return 0


def delete_subject(
    code: Annotated[str, tyro.conf.Positional],
    *,
    typed: str = "",
    sessions: Sessions = None,
) -> int:
    """Delete a subject and everything recorded of it, for good, the bin included.

    Args:
        code: The subject (handstudio subjects lists them).
        typed: The code once more; without it, say what would be deleted and delete nothing.
        sessions: Folder of the takes.
    """
    folder = sessions_folder(sessions)
    if not typed:
        removal = what_deleting_removes(folder, code)
        _tell_removal("Would delete", removal)
        err.print("Nothing was deleted. It cannot be taken back; if that is what you want:")
        err.print(f"handstudio delete-subject '{removal.code}' --typed '{removal.code}'")
        return 1
    _tell_removal("Deleted", delete(folder, code, typed))
    return 0


def _row(entry: Entry) -> dict[str, Any]:
    summary = entry.take.summary if entry.take else None
    return {
        "path": str(entry.path),
        "subject": entry.subject,
        "visit": entry.visit,
        "name": entry.name,
        "state": _state(entry),
        "problem": entry.problem or None,
        "start": entry.start,
        "duration_s": summary.duration_s if summary else None,
        "notes": entry.notes,
    }


def _state(entry: Entry) -> str:
    if entry.take is not None:
        return "ready"
    if entry.recording:
        return "recording"
    return "interrupted" if is_unfinished(entry.path) else "damaged"


def _seconds(row: dict[str, Any]) -> str:
    return "?" if row["duration_s"] is None else f"{row['duration_s']:.1f} s"


def _list_bin(folder: Path, json: bool) -> int:
    binned = bin_.list_bin(folder)
    if json:
        rows = [
            {"key": each.key, "path": str(each.path), "origin": str(each.origin), "when": each.when}
            for each in binned
        ]
        print_json(rows)
        return 0
    shown = [[each.key, each.name, each.subject, each.visit] for each in binned]
    print_table("Bin", ["name in the bin", "take", "subject", "visit"], shown)
    return 0


def _tell_removal(words: str, removal: Removal) -> None:
    out.print(
        f"{words} subject {removal.code}: {removal.takes} takes in {removal.visits} visits, "
        f"{removal.in_bin} in the bin, {removal.minutes:.1f} min, {removal.bytes / 1e6:.1f} MB."
    )
    for path in removal.elsewhere:
        out.print(f"Not deleted, for it lies elsewhere: {path}")
