"""A small take, and the chunks in it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handstudio.layout import glove
from handstudio.recording.header import Header, Summary
from handstudio.recording.notes import Label, Mark, Notes, save_notes
from handstudio.recording.take import FirstState, pack_first_state
from handstudio.recording.writer import TakeWriter
from handstudio.samples import Ranges
from handstudio.setup import Setup

START_NS = 1_700_000_000_000_000_000
FIRST_STATE = pack_first_state(FirstState(b"what the decoder knew", b"what the pipeline knew"))
Chunks = list[tuple[int, bytes]]


@pytest.fixture(scope="session")
def header() -> Header:
    setup = Setup(
        glove("right", ["SN1", "SN11"]),
        100.0,
        ranges=Ranges(acc=78.0, gyr=35.0, mag=4912.0),
        decoder="handstudio-1",
    )
    return Header("squeeze", "S01", START_NS, setup, "wire", "virtual:")


@pytest.fixture(scope="session")
def chunks() -> Chunks:
    """Bytes that do not compress, of different lengths."""
    rng = np.random.default_rng(3)
    return [
        (START_NS + k * 50_000_000, rng.integers(0, 256, 40 + 30 * k, dtype=np.uint8).tobytes())
        for k in range(7)
    ]


@pytest.fixture
def written(header: Header, chunks: Chunks) -> Callable[..., Path]:
    """``written(path)``: a closed take, its chunks flushed one by one."""

    def write(path: Path) -> Path:
        writer = TakeWriter(path, header, FIRST_STATE)
        for chunk in chunks:
            writer.write(*chunk)
            writer.flush()
        return writer.close(Summary(7, 910, 0.35, packets=7))

    return write


@pytest.fixture
def taken(written: Callable[..., Path]) -> Callable[..., Path]:
    """``taken(path)``: a closed take with all that may stand beside one."""

    def write(path: Path) -> Path:
        written(path)
        save_notes(path, Notes((), "the words before"))
        save_notes(path, Notes((Label(0.1, 0.2, "static"),), "left hand", (Mark(0.1),)))
        motion = path.with_suffix(".motion") / "0123456789abcdef"
        motion.mkdir(parents=True)
        (motion / "meta.json").write_text("{}")
        path.with_suffix(".reference.npz").write_bytes(b"reference")
        path.with_suffix(".truth.npz").write_bytes(b"truth")
        path.with_suffix(".angles.csv").write_text("an export")
        return path

    return write


@pytest.fixture
def content() -> Callable[[Path], dict[str, bytes | None]]:
    """``content(folder)``: relative names of all in it, and the bytes of files."""
    return _content


@pytest.fixture
def tripwire(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """``with tripwire(passes, error) as wire``: see `Tripwire`."""

    @contextmanager
    def stretched(passes: int, error: BaseException, once: bool = False) -> Iterator[Tripwire]:
        wire = Tripwire(passes, error, once)
        with monkeypatch.context() as patch:
            wire.set(patch)
            yield wire

    return stretched


def _content(folder: Path) -> dict[str, bytes | None]:
    """Everything in a folder: relative names, and bytes of files."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
        for path in sorted(folder.rglob("*"))
    }


class Tripwire:
    """Lets some moves and removals of files pass, then raises: once, or from then on."""

    def __init__(self, passes: int, error: BaseException, once: bool = False) -> None:
        self.left = passes
        self.error = error
        self.once = once
        self.tripped = False

    def set(self, patch: pytest.MonkeyPatch) -> None:
        for name in ("rename", "replace", "unlink", "rmdir"):
            patch.setattr(os, name, self._guarded(getattr(os, name)))

    def _guarded(self, real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            if self.left <= 0 and not (self.once and self.tripped):
                self.tripped = True
                raise self.error
            self.left -= 1
            return real(*arguments, **named)

        return call
