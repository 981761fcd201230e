"""A small take, and the chunks in it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from handstudio.layout import glove
from handstudio.recording.header import Header, Summary
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
