"""Knowing that somebody is writing a file, in this process or another.

A hold ends with the process that has it, however that ends: what is left is an interrupted file.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

if sys.platform != "win32":
    import fcntl


def hold(file: BinaryIO) -> bool:
    """Hold an open file until it is closed; False where somebody else holds it."""
    if sys.platform == "win32":
        return True  # an open file cannot be moved there
    try:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True  # a file system that knows no locks
    return True


def movable(file: BinaryIO) -> None:
    """Let an open file be moved: on Windows it has to be closed, which ends the hold."""
    if sys.platform == "win32":
        file.close()


@contextlib.contextmanager
def held(path: Path) -> Iterator[bool]:
    """Hold a file that is there; whether nobody else does. It may be moved and removed meanwhile.

    Raises:
        OSError: it cannot be opened.
    """
    if sys.platform == "win32":
        yield True
        return
    with path.open("rb") as file:
        yield hold(file)


def is_held(path: Path) -> bool:
    """Whether a file is being written now; False where there is none."""
    try:
        if sys.platform == "win32":
            path.rename(path)  # refused while it is open
            return False
        with path.open("rb") as file:
            fcntl.flock(file.fileno(), fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except PermissionError:
        return sys.platform == "win32"
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
