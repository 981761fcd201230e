"""The stretches of a take's motion that want a second look, computed once and kept beside it."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import msgspec

from handstudio.analysis.stretches import Stretch, stretches_of
from handstudio.errors import TakeError
from handstudio.process import Progress, kept_folder, process
from handstudio.recording.atomic import write_json
from handstudio.recording.take import Take
from handstudio.setup import Setup

_VERSION = 1


class _Kept(msgspec.Struct):
    stretches: tuple[Stretch, ...]
    version: int = _VERSION


def survey(
    take: Take, setup: Setup | None = None, progress: Progress = lambda _share: None
) -> tuple[Stretch, ...]:
    """The stretches of a take's motion, by its own setup or another.

    Raises:
        TakeError: the take is damaged, or the disk does not take the motion.
        SetupError: the stored state does not fit this version.
    """
    motion = process(take, setup, progress=progress)
    kept = kept_survey(take, setup)
    if kept is not None:
        return kept
    found = stretches_of(setup or take.header.setup, motion, progress) if len(motion) else ()
    with suppress(TakeError):  # a full disk: it is computed again the next time
        write_json(_path(take, setup), _Kept(found))
    return found


def kept_survey(take: Take, setup: Setup | None = None) -> tuple[Stretch, ...] | None:
    """The stretches where they were computed before, else None."""
    try:
        kept = msgspec.json.decode(_path(take, setup).read_bytes(), type=_Kept)
    except (OSError, ValueError):
        return None
    return kept.stretches if kept.version == _VERSION else None


def _path(take: Take, setup: Setup | None) -> Path:
    return kept_folder(take, setup) / "stretches.json"
