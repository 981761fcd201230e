"""Long work in a process of its own: the page and the capture never wait for it."""

from __future__ import annotations

import multiprocessing
import os
import threading
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

from handstudio.export.csv import Content, Window, export_csv
from handstudio.process import process
from handstudio.recording.take import open_take

_share: Synchronized[float] | None = None  # in the job's process: where it tells how far it is


class Jobs:
    """One job process; jobs run one after the other."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._done: Synchronized[float] = context.Value("d", 0.0)
        self._pool = ProcessPoolExecutor(
            max_workers=1, mp_context=context, initializer=_begin, initargs=(self._done,)
        )

    @property
    def share_done(self) -> float:
        """How far the present job is, 0 to 1."""
        return float(self._done.value)

    def warm_up(self) -> None:
        """Start the process before it is needed."""
        self._pool.submit(_nothing)

    def process(self, path: Path) -> Future[None]:
        """Compute the motion of a take, so that opening it finds it."""
        self._done.value = 0.0
        return self._pool.submit(_process, path)

    def export(self, path: Path, target: Path, content: Content, window: Window) -> Future[Path]:
        """Write a CSV of a part of a take."""
        self._done.value = 0.0
        return self._pool.submit(_export, path, target, content, window)

    def close(self) -> None:
        """End; a job that runs is abandoned."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def _begin(share: Synchronized[float]) -> None:
    global _share  # noqa: PLW0603 - set once, when the job's process starts
    _share = share
    threading.Thread(target=_end_with_the_studio, name="parent", daemon=True).start()


def _end_with_the_studio() -> None:
    """A studio that is killed says nothing: without this its job process would wait for ever."""
    studio = multiprocessing.parent_process()
    if studio is not None:
        studio.join()
        os._exit(1)


def _tell(share: float) -> None:
    if _share is not None:
        _share.value = share


def _nothing() -> None:
    pass


def _process(path: Path) -> None:
    process(open_take(path), progress=_tell)


def _export(path: Path, target: Path, content: Content, window: Window) -> Path:
    take = open_take(path)
    motion = process(take, progress=_tell)
    return export_csv(take, take.header.setup, motion, target, content=content, window=window)
