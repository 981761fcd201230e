"""What virtual subjects need from files: how characters are written, recordings of real hands."""

from __future__ import annotations

import os
from pathlib import Path

from handstudio.recording.leap import recordings_in
from handstudio.recording.strokes import kanji_strokes
from handstudio.simulation.motions.actor import Material

RECORDINGS = "HANDSTUDIO_DATA"
"""Environment variable: a folder of recordings, those of hands in its folder ``leap``."""


def material() -> Material:
    """Everything there is on this machine."""
    folder = os.environ.get(RECORDINGS)
    recordings = recordings_in(Path(folder) / "leap") if folder else {}
    return Material(kanji_strokes, recordings)
