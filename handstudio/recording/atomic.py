"""Writing small files so that there is always a whole one: the new, or the one before."""

from __future__ import annotations

import os
from pathlib import Path

import msgspec

from handstudio.errors import TakeError

BACKUP = ".bak"


def write_atomically(path: Path, data: bytes) -> None:
    """Replace a file's content at once; the previous content stays as ``NAME.bak``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(path.name + ".new")
    with fresh.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    if path.exists():
        path.with_name(path.name + BACKUP).write_bytes(path.read_bytes())
    fresh.replace(path)


def write_json(path: Path, value: msgspec.Struct) -> None:
    """Store a value as JSON that a person can read; what was there before stays as a backup.

    Raises:
        TakeError: it cannot be written; what was there before still is.
    """
    try:
        write_atomically(path, msgspec.json.format(msgspec.json.encode(value)))
    except OSError as error:
        raise unwritable(path, error) from error


def unwritable(path: Path, error: OSError) -> TakeError:
    """Why a file cannot be written, and what to do."""
    return TakeError(
        "{path}: cannot be written ({reason}).",
        "Free some space or check the folder's permissions.",
        path=path,
        reason=error.strerror or error,
    )
