"""The library: where takes live, which there are, what a new one is called.

``<sessions>/<subject>/<visit>/<take>.mcap``; a visit is a day unless it is given a name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

import platformdirs

from handstudio.errors import HandstudioError, TakeError
from handstudio.recording.take import Take, open_take
from handstudio.recording.writer import UNFINISHED

_FORBIDDEN = re.compile(r"[^\w\-+.]+")


@dataclass(frozen=True, slots=True)
class Entry:
    """A file of the library: a take, or why it cannot be opened."""

    path: Path
    take: Take | None
    error: HandstudioError | None = None

    @property
    def problem(self) -> str:
        """Why it cannot be opened, in English; empty where it can."""
        return "" if self.error is None else self.error.what

    @property
    def remedy(self) -> str:
        """What to do about that, in English; empty where there is nothing to do."""
        return "" if self.error is None else self.error.remedy


def sessions_folder(chosen: Path | None = None) -> Path:
    """Where takes live: the one chosen, else a checkout's own, else the user's data folder."""
    if chosen is not None:
        return chosen
    here = Path.cwd()
    if (here / "sessions").is_dir() and (here / "pyproject.toml").is_file():
        return here / "sessions"
    return platformdirs.user_data_path("handstudio", appauthor=False) / "sessions"


def entries(sessions: Path) -> list[Entry]:
    """Every take and every interrupted recording, newest first."""
    found = [*sessions.glob("*/*/*.mcap"), *sessions.glob(f"*/*/*.mcap{UNFINISHED}")]
    return [_entry(path) for path in sorted(found, key=_age, reverse=True)]


def new_take_path(sessions: Path, subject: str, name: str, now: datetime) -> Path:
    """A path no take has yet; a number is added to a name that is taken.

    Raises:
        TakeError: subject or name leave nothing to call a file.
    """
    folder = sessions / file_name(subject, "subject") / f"{now:%Y-%m-%d}"
    stem = file_name(name, "take")
    candidates = [stem, *(f"{stem}-{n}" for n in range(2, 10_000))]
    for candidate in candidates:
        path = folder / f"{candidate}.mcap"
        if not path.exists() and not path.with_name(path.name + UNFINISHED).exists():
            return path
    raise TakeError(
        "{folder}: ten thousand takes are called {name}.",
        "Choose another name.",
        folder=folder,
        name=stem,
    )


def file_name(text: str, what: Literal["subject", "take"]) -> str:
    """Words as a file name that every system accepts; letters of any language stay.

    Raises:
        TakeError: nothing is left.
    """
    clean = _FORBIDDEN.sub("_", text.strip()).strip("._")[:80]
    if clean:
        return clean
    if what == "subject":
        raise TakeError("The subject has no name.", "Type a name with letters or digits.")
    raise TakeError("The take has no name.", "Type a name with letters or digits.")


def _entry(path: Path) -> Entry:
    try:
        return Entry(path, open_take(path))
    except HandstudioError as error:
        return Entry(path, None, error)


def _age(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0
