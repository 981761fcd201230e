"""Moving several files as one: after a crash in the middle the rest follows.

What is to be moved is written down first, in ``<sessions>/.moves``. Whoever lists the library next
finishes what is written there and not held by a running process.
"""

from __future__ import annotations

import contextlib
import os
import uuid
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import BinaryIO

import msgspec

from handstudio.errors import TakeError
from handstudio.recording.held import held, hold, movable

FOLDER = ".moves"


class _Step(msgspec.Struct, frozen=True):
    source: str  # relative to the sessions folder, with forward slashes
    target: str


Pair = tuple[Path, Path]


def move(sessions: Path, pairs: Iterable[Pair]) -> None:
    """Move files and folders of the library, all or none.

    Args:
        sessions: The library.
        pairs: From where to where, both in the library; the take's own file last.

    Raises:
        TakeError: one cannot be moved; all are where they were.
    """
    steps = [(source, target) for source, target in pairs if source != target]
    if not steps:
        return
    settle(sessions)
    place = steps[-1][0]
    try:
        with _written_down(sessions, steps):
            _move_all(steps)
    except _HalfwayError as error:
        raise TakeError(
            "{path}: was moved in part only ({reason}).",
            "Make the disk writable again: the rest follows when the library is read next.",
            path=place,
            reason=error.reason.strerror or error.reason,
        ) from error
    except OSError as error:
        raise TakeError(
            "{path}: cannot be moved ({reason}).",
            "Close what else uses it, check the folder's permissions and the free space, "
            "then try again. Nothing has changed.",
            path=place,
            reason=error.strerror or error,
        ) from error


def settle(sessions: Path) -> None:
    """Finish what a crash interrupted. What cannot be finished now is left for the next time."""
    folder = sessions / FOLDER
    if not folder.is_dir():
        return
    for record in sorted(folder.iterdir()):
        with contextlib.suppress(OSError):
            _settle_one(sessions, record)
    with contextlib.suppress(OSError):
        folder.rmdir()


@contextlib.contextmanager
def _written_down(sessions: Path, steps: list[Pair]) -> Iterator[None]:
    """The record is there, and held, while the steps are made; a crash leaves it behind."""
    folder = sessions / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    fresh = folder / f"{uuid.uuid4().hex}.new"
    record = fresh.with_suffix(".json")
    with fresh.open("xb") as file:
        hold(file)
        try:
            _write(file, sessions, steps)
            movable(file)
            fresh.rename(record)
        except OSError:
            _forget(fresh)
            raise
        try:
            yield
        except OSError:
            _forget(record)
            raise
        _forget(record)


def _forget(record: Path) -> None:
    with contextlib.suppress(OSError):  # nothing is left to do of what it says: it may stay a while
        record.unlink()
        record.parent.rmdir()


class _HalfwayError(Exception):
    """A move failed, and so did taking it back: the record stays, so that the rest follows."""

    def __init__(self, reason: OSError) -> None:
        self.reason = reason


def _write(file: BinaryIO, sessions: Path, steps: list[Pair]) -> None:
    told = [_Step(_inside(sessions, a), _inside(sessions, b)) for a, b in steps]
    try:
        data = msgspec.json.encode(told)
    except UnicodeError as error:
        raise OSError(None, "its name is no UTF-8") from error
    file.write(data)
    file.flush()
    os.fsync(file.fileno())


def _inside(sessions: Path, path: Path) -> str:
    return path.relative_to(sessions).as_posix()


def _move_all(steps: list[Pair]) -> None:
    done: list[Pair] = []
    try:
        for source, target in steps:
            _move_one(source, target)
            done.append((source, target))
    except OSError as error:
        try:
            for source, target in reversed(done):
                target.rename(source)
        except OSError:
            raise _HalfwayError(error) from error
        raise


def _move_one(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    # a rename replaces what is there; where case does not count it is the file itself
    if target.exists() and not target.samefile(source):
        raise FileExistsError(None, f"{target.name} exists already", str(target))
    source.rename(target)


def _settle_one(sessions: Path, record: Path) -> None:
    with held(record) as ours:
        if not ours:
            return  # somebody is at it
        if record.suffix == ".json":
            for source, target in _read(sessions, record.read_bytes()):
                if source.exists() and not target.exists():
                    _move_one(source, target)
        record.unlink()


def _read(sessions: Path, data: bytes) -> list[Pair]:
    try:
        steps = msgspec.json.decode(data, type=list[_Step])
    except ValueError:
        return []
    names = [PurePosixPath(name) for step in steps for name in (step.source, step.target)]
    if any(name.is_absolute() or ".." in name.parts for name in names):
        return []  # not one of ours
    return [(sessions / step.source, sessions / step.target) for step in steps]
