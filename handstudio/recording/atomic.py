"""Writing small files so that there is always a whole one: the new, or the one before."""

from __future__ import annotations

import os
from pathlib import Path

BACKUP = ".bak"


def write_atomically(path: Path, data: bytes) -> None:
    """Replace a file's content at once; the previous content stays as ``NAME.bak``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(path.name + ".new")
    with fresh.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    if path.exists():
        path.with_name(path.name + BACKUP).write_bytes(path.read_bytes())
    fresh.replace(path)
