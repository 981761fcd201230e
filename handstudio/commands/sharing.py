"""Takes that come from elsewhere or go there, and parts of takes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from handstudio.commands.arguments import Sessions, TakeFile
from handstudio.errors import TakeError
from handstudio.recording.library import sessions_folder
from handstudio.recording.parcel import SUFFIX, pack, take_in
from handstudio.recording.take import open_take
from handstudio.shell import out, progress
from handstudio.trim import trim as trimmed


def trim(take: TakeFile, *, begin: float = 0.0, end: float | None = None, name: str = "") -> int:
    """Make a take of a part of one; the whole one stays as it is.

    Args:
        take: The whole take.
        begin: Where the part begins [s].
        end: Where it ends [s]; the end of the take unless given.
        name: What to call it; NAME-part unless given.
    """
    with progress("Trimming") as tell:
        path = trimmed(open_take(take), begin, end, name=name, progress=tell)
    out.print(str(path))
    return 0


def share(take: TakeFile, *, output: Path | None = None) -> int:
    """Put a take and its notes into one file, to be sent to somebody.

    Args:
        take: The take.
        output: The file to write; NAME.take.zip beside the take unless given.
    """
    out.print(str(pack(open_take(take), output or take.with_suffix(SUFFIX))))
    return 0


def add(
    files: Annotated[tuple[Path, ...], tyro.conf.Positional], *, sessions: Sessions = None
) -> int:
    """Copy takes from elsewhere into the library: NAME.mcap, or what `share` made.

    Args:
        files: The files.
        sessions: Folder of the takes.
    """
    if not files:
        raise TakeError("No file was named.", "Name them: handstudio add FILE ...")
    for file in files:
        out.print(str(take_in(file, sessions_folder(sessions))))
    return 0
