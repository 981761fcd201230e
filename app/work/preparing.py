"""Getting the whole-hand filter ready while another one serves: compiled aside, then loaded.

A process of its own compiles, as that takes up to a minute of a processor. What it leaves on disk
is then loaded here by a thread, so that neither the page nor the capture waits for it.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import threading

from handstudio.warming import warm

_log = logging.getLogger(__name__)

_POLITE = 10  # nobody waits for it: whatever else the machine has to do comes first


class Preparation:
    """Begins when it is made; ask `ready` now and then, from one thread.

    Where the process fails the filter stays unprepared.

    Attributes:
        process: Compiles.
        loaded: Set once what it compiled is here.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.process = context.Process(target=_compile, name="compiling", daemon=True)
        self.process.start()
        self._loading: threading.Thread | None = None
        self.loaded = threading.Event()

    @property
    def ready(self) -> bool:
        """Whether the filter can be used without anybody waiting for it."""
        if self._loading is None and self.process.exitcode == 0:
            self._loading = threading.Thread(target=self._load, name="loading", daemon=True)
            self._loading.start()
        return self.loaded.is_set()

    @property
    def failed(self) -> bool:
        """Whether it will never be."""
        return bool(self.process.exitcode)

    def close(self) -> None:
        """No longer wanted."""
        self.process.terminate()
        self.process.join()

    def _load(self) -> None:
        warm()
        self.loaded.set()
        _log.info("the whole-hand filter is ready")


def _compile() -> None:
    if hasattr(os, "nice"):
        os.nice(_POLITE)
    warm()
