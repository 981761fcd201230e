"""What the sensors of a take told, instant by instant as in its motion, kept beside that."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from jaxtyping import Float32

from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.recording.take import Take
from handstudio.samples import ImuSamples

Progress: TypeAlias = Callable[[float], None]
"""Told the share that is done, 0 to 1."""

_KINDS = ("gyr", "acc", "mag")


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """Readings in SI as the sensors told them: no known error is taken off.

    Attributes:
        gyr: Turn rates [rad/s].
        acc: Specific forces [m/s2].
        mag: Magnetic field [uT]; held from the last reading where there is no new one.
    """

    gyr: Float32[Array, "n s 3"]
    acc: Float32[Array, "n s 3"]
    mag: Float32[Array, "n s 3"]


def signals(take: Take, progress: Progress = lambda _share: None) -> Signals:
    """The signals of a take, memory-mapped; written once, then found beside the take.

    Raises:
        TakeError: the take is damaged, or the disk does not take them.
    """
    kept = kept_signals(take)
    if kept is not None:
        return kept
    folder = _folder(take)
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(prefix="unfinished-", dir=folder.parent))
        try:
            _write(take, fresh, progress)
            if not folder.exists():  # else somebody was faster: the same numbers
                fresh.rename(folder)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)
    except OSError as error:
        raise TakeError(
            "{folder}: the signals cannot be kept ({reason}).",
            "Free some space or check the folder's permissions, then choose them again.",
            folder=folder,
            reason=error.strerror or error,
        ) from error
    kept = kept_signals(take)
    assert kept is not None  # they were just written
    return kept


def kept_signals(take: Take) -> Signals | None:
    """The signals of a take where they were written before, else None."""
    count = len(take.header.setup.layout.sensors)
    arrays = []
    for kind in _KINDS:
        try:
            flat = np.memmap(_folder(take) / kind, dtype="<f4", mode="r")
        except (OSError, ValueError):  # ValueError: an empty file
            return None
        arrays.append(flat.reshape(-1, count, 3))
    return Signals(*arrays)


def _write(take: Take, folder: Path, progress: Progress) -> None:
    whole = max(1, take.summary.chunks if take.summary else 1)
    files = [(folder / kind).open("wb") for kind in _KINDS]
    try:
        for done, events in enumerate(take.events()):
            for event in events:
                if isinstance(event, ImuSamples):
                    for file, kind in zip(files, _KINDS, strict=True):
                        file.write(getattr(event, kind).astype("<f4").tobytes())
            progress(min(1.0, done / whole))
    finally:
        for file in files:
            file.close()


def _folder(take: Take) -> Path:
    return take.path.with_suffix(".motion") / f"signals-{take.sha256()[:16]}"
