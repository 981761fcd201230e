"""A take and a setup make a motion, kept beside the take under the hash of both and the version.

One function, so that a folder of takes is a loop or a pool of processes.
"""

from __future__ import annotations

import hashlib
import math
import shutil
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import Literal, TypeAlias

import msgspec
import numpy as np

from handstudio import __version__, pipeline
from handstudio.alignment import aligned
from handstudio.arrays import Array
from handstudio.calibration.heading import HeadingAlignment
from handstudio.errors import SetupError, TakeError
from handstudio.pipeline import Motion
from handstudio.recording.notes import stretches
from handstudio.recording.take import Take
from handstudio.samples import Event, ImuSamples
from handstudio.setup import Setup
from handstudio.smoothing import Smoother

Progress: TypeAlias = Callable[[float], None]
"""Told the share that is done, 0 to 1."""

_BATCH = 1024  # instants fused at a time: memory does not grow with the take

_KINDS = {
    "time_us": "<i8",
    "q_world_sensor": "<f8",
    "q_world_start": "<f8",
    "doubt": "u1",
    "sd_rad": "<f4",
}


class _Meta(msgspec.Struct):
    count: int
    sensors: int
    version: str


def process(
    take: Take,
    setup: Setup | None = None,
    *,
    from_start: bool = False,
    progress: Progress | None = None,
) -> Motion:
    """The motion of a take, memory-mapped; computed once, then found beside the take.

    Args:
        take: The recording.
        setup: Another setup than the take's own, to compare.
        from_start: Ignore what was known before the first byte.
        progress: Told how far it is.

    Raises:
        TakeError: the take is damaged, or the disk does not take the result.
        SetupError: the stored state does not fit this version.
    """
    chosen = setup or take.header.setup
    _refuse_other_sensors(take, chosen)
    from_start = from_start or chosen != take.header.setup
    folder = motion_folder(take, chosen, from_start)
    motion = _opened(folder)
    if motion is None:
        _compute(take, chosen, from_start, folder, progress or (lambda share: None))
        motion = _opened(folder)
    if motion is None:
        raise TakeError(
            "{folder}: the motion does not stay as it was written.",
            "Check the disk, then process the take again.",
            folder=folder,
        )
    return motion


def process_head(take: Take, seconds: float = 10.0) -> Motion:
    """The motion of a take's first seconds, in memory: to look at until all of it is there.

    Raises:
        TakeError: the take is damaged.
        SetupError: the stored state does not fit this version.
    """
    setup = take.header.setup
    state, motions, wanted = first_state(take, setup), [], seconds * setup.rate_hz
    for events in take.events():
        motion, state = pipeline.run(setup, state, events)
        motions.append(motion)
        wanted -= len(motion)
        if wanted <= 0.0:
            break
    return pipeline.join(motions) if motions else pipeline.empty(len(setup.layout.sensors))


def kept_motion(take: Take, setup: Setup | None = None) -> Motion | None:
    """The motion of a take where it was computed before and is whole, else None.

    ``setup`` is another one than the take's own.
    """
    if not _home(take.path).exists():  # found without hashing a long take, which takes its time
        return None
    return _opened(kept_folder(take, setup))


def kept_folder(take: Take, setup: Setup | None = None) -> Path:
    """Where the motion of a take is kept, by its own setup or another, and what was found in it."""
    own = take.header.setup
    chosen = setup or own
    return motion_folder(take, chosen, from_start=chosen != own)


def aligned_setup(take: Take, setup: Setup | None = None) -> tuple[Setup, HeadingAlignment]:
    """The setup whose headings agree by a take's own quick start, and how well they do.

    Args:
        take: The recording; its labels say where the quick start is, else it is looked for.
        setup: Another setup than the take's own.

    Raises:
        CalibrationError: there is no quick start in it, or none that can be used.
        TakeError: the take or its notes cannot be read.
    """
    return aligned(setup or take.header.setup, take.runs(), stretches(take.path))


def motion_folder(take: Take, setup: Setup, from_start: bool) -> Path:
    """Where the motion of a take under a setup is kept."""
    parts = f"{take.sha256()} {setup.key} {__version__} {from_start}"
    key = hashlib.sha256(parts.encode()).hexdigest()[:16]
    return _home(take.path) / key


def _home(take: Path) -> Path:
    """What is computed of a take lies in here."""
    return take.with_suffix(".motion")


def _refuse_other_sensors(take: Take, setup: Setup) -> None:
    if len(setup.layout.sensors) != len(take.header.setup.layout.sensors):
        raise SetupError(
            "The setup has {given} sensors, the take {recorded}.",
            "Choose a setup with the sensors of the take.",
            given=len(setup.layout.sensors),
            recorded=len(take.header.setup.layout.sensors),
        )


class MotionWriter:
    """Puts a motion on disk piece by piece; it counts only once `finish` has given it its place.

    Args:
        beside: The take's path: the motion is kept in ``NAME.motion`` beside it.
        sensors: How many sensors the motion has.
    """

    def __init__(self, beside: Path, sensors: int) -> None:
        self._sensors = sensors
        self._count = 0
        home = _home(beside)
        home.mkdir(parents=True, exist_ok=True)
        self._folder = Path(tempfile.mkdtemp(prefix="unfinished-", dir=home))
        self._files = {name: (self._folder / name).open("wb") for name in _KINDS}

    def append(self, motion: Motion) -> None:
        """Add the next instants."""
        for name, kind in _KINDS.items():
            self._files[name].write(getattr(motion, name).astype(kind).tobytes())
        self._count += len(motion)

    def finish(self, folder: Path) -> None:
        """Close and move to where `process` looks for it."""
        for file in self._files.values():
            file.close()
        meta = _Meta(self._count, self._sensors, __version__)
        (self._folder / "meta.json").write_bytes(msgspec.json.encode(meta))
        if _opened(folder) is None:  # else somebody was faster: the same numbers
            shutil.rmtree(folder, ignore_errors=True)
            self._folder.rename(folder)
        self.discard()

    def discard(self) -> None:
        """Leave nothing behind."""
        for file in self._files.values():
            with suppress(OSError):  # a full disk does not take the rest: it is not wanted either
                file.close()
        shutil.rmtree(self._folder, ignore_errors=True)


def _compute(take: Take, setup: Setup, from_start: bool, folder: Path, progress: Progress) -> None:
    try:
        writer = MotionWriter(take.path, len(setup.layout.sensors))
        try:
            _fill(writer, take, setup, from_start, progress)
            writer.finish(folder)
        finally:
            writer.discard()
    except OSError as error:
        raise TakeError(
            "{folder}: the motion cannot be kept ({reason}).",
            "Free some space or check the folder's permissions, then process the take again.",
            folder=folder,
            reason=error.strerror or error,
        ) from error


def _fill(
    writer: MotionWriter, take: Take, setup: Setup, from_start: bool, progress: Progress
) -> None:
    state = first_state(take, setup, from_start)
    whole = max(1, take.summary.bytes if take.summary else take.path.stat().st_size)
    seen = 0
    smoother = Smoother(setup) if setup.smooth else None
    for batch in _ahead(_batches(take.events(from_start))):
        if smoother is None:
            motion, state = pipeline.run(setup, state, batch)
        else:
            motion, state = smoother.run(state, batch)
        writer.append(motion)
        seen += sum(_size(event, take.header.kind) for event in batch)
        progress(min(1.0, seen / whole))
    if smoother is not None:
        writer.append(smoother.rest())
    progress(1.0)


def _size(event: Event, kind: Literal["wire", "samples"]) -> int:
    """About what an event took in the file: progress need not be exact."""
    per_sensor = 18 if kind == "wire" else 75
    return len(event) * per_sensor * event.gyr.shape[1] if isinstance(event, ImuSamples) else 0


def first_state(take: Take, setup: Setup, from_start: bool = False) -> pipeline.State:
    """What the pipeline knew at the first byte of a take.

    Raises:
        SetupError: the stored state does not fit this version.
    """
    if from_start or not take.first_state.pipeline:
        return pipeline.begin(setup)
    return pipeline.unpack(setup, take.first_state.pipeline)


def _batches(events: Iterator[list[Event]]) -> Iterator[list[Event]]:
    """Join short runs of samples: fusing costs less in long ones, and the digits are the same."""
    batch: list[Event] = []
    count = 0
    for event in chain.from_iterable(events):
        batch.append(event)
        count += len(event) if isinstance(event, ImuSamples) else 0
        if count >= _BATCH:
            yield _joined(batch)
            batch, count = [], 0
    if batch:
        yield _joined(batch)


def _ahead(batches: Iterator[list[Event]]) -> Iterator[list[Event]]:
    """The same, the next one decoded while one is fused: the compiled filter leaves room for it."""
    with ThreadPoolExecutor(1, "decoding") as reader:
        coming = reader.submit(next, batches, None)
        while (batch := coming.result()) is not None:
            coming = reader.submit(next, batches, None)
            yield batch


def _joined(batch: list[Event]) -> list[Event]:
    out: list[Event] = []
    run: list[ImuSamples] = []
    for event in batch:
        if isinstance(event, ImuSamples):
            run.append(event)
            continue
        out += [_concatenated(run)] if run else []
        out.append(event)
        run = []
    return out + ([_concatenated(run)] if run else [])


def _concatenated(run: list[ImuSamples]) -> ImuSamples:
    if len(run) == 1:
        return run[0]
    names = ImuSamples.__slots__
    return ImuSamples(*(np.concatenate([getattr(part, name) for part in run]) for name in names))


def _opened(folder: Path) -> Motion | None:
    """The motion kept in a folder; None where there is none, or not the whole of it."""
    try:
        meta = msgspec.json.decode((folder / "meta.json").read_bytes(), type=_Meta)
        arrays = {name: _array(folder / name, kind, meta) for name, kind in _KINDS.items()}
    except (OSError, ValueError):
        return None
    return Motion(**arrays)


def _array(path: Path, kind: str, meta: _Meta) -> Array:
    n, s = meta.count, meta.sensors
    shapes = {
        "time_us": (n,),
        "q_world_sensor": (n, s, 4),
        "q_world_start": (n, 4),
        "doubt": (n, s),
        "sd_rad": (n, s, 2),
    }
    shape = shapes[path.name]
    if path.stat().st_size != np.dtype(kind).itemsize * math.prod(shape):
        raise ValueError(f"{path} is not of its size")
    return np.memmap(path, dtype=kind, mode="r", shape=shape) if n else np.empty(shape, dtype=kind)
