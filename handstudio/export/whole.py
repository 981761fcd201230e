"""Files that are there whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from handstudio.errors import TakeError


@contextmanager
def written_whole(target: Path, sidecar: bytes) -> Iterator[BinaryIO]:
    """A file to write, which takes its name only when it is complete and its sidecar is there.

    Whatever ends the writing before, what had these names stays as it was.

    Raises:
        TakeError: the file cannot be written.
    """
    beside = sidecar_of(target)
    unfinished = [path.with_name(path.name + ".part") for path in (target, beside)]
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with unfinished[1].open("wb") as file:
            file.write(sidecar)
            _settle(file)
        with unfinished[0].open("wb") as file:
            yield file
            _settle(file)
        unfinished[1].replace(beside)
        unfinished[0].replace(target)
    except OSError as error:
        raise TakeError(
            "{path}: cannot be written ({reason}).",
            "Free some space, choose another folder, or close the program that has the file open.",
            path=target,
            reason=error.strerror or error,
        ) from error
    finally:
        for path in unfinished:
            with suppress(OSError):
                path.unlink(missing_ok=True)


def sidecar_of(target: Path) -> Path:
    """Where the metadata of an export lies: ``NAME.csv.json`` of ``NAME.csv``."""
    return target.with_name(target.name + ".json")


def _settle(file: BinaryIO) -> None:
    file.flush()
    os.fsync(file.fileno())
