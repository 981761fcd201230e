"""Looking for devices beside everything else: when asked to, and when something was plugged in."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from handstudio.device import find
from handstudio.device.find import Found

EVERY_S = 3.0


@dataclass(frozen=True, slots=True)
class Looked:
    """What was found: all of it, and the gloves that were not there the time before."""

    found: tuple[Found, ...]
    new: tuple[Found, ...]


@dataclass
class Looker:
    """Looks in threads of its own; what it finds is told by ``hear``, from there.

    Args:
        hear: Is told what was found; called in the looker's thread.
    """

    hear: Callable[[Looked], None]
    busy: bool = False
    _ports: frozenset[str] | None = None
    _gloves: frozenset[str] | None = None
    _due_s: float = EVERY_S
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def look(self, in_use: str = "") -> None:
        """Ask every port who is there, but for the one that is in use."""
        self._begin(lambda: self._ask(in_use))

    def tick(self, elapsed_s: float, *, idle: bool) -> None:
        """So much later; while no device is used, a port that appears is asked who is there."""
        self._due_s -= elapsed_s
        if self._due_s <= 0.0:
            self._due_s = EVERY_S
            if idle:
                self._begin(self._watch)

    def _begin(self, work: Callable[[], None]) -> None:
        with self._lock:
            if self.busy:
                return
            self.busy = True

        def done() -> None:
            try:
                work()
            finally:
                self.busy = False

        threading.Thread(target=done, name="find devices", daemon=True).start()

    def _watch(self) -> None:
        ports = frozenset(port.address for port in find.ports())
        if self._ports is not None and ports != self._ports:
            self._ask(in_use="")
        self._ports = ports

    def _ask(self, in_use: str) -> None:
        found = tuple(
            port if port.address == in_use else find.probe(port.address) for port in find.ports()
        )
        gloves = frozenset(port.address for port in found if port.is_glove)
        before, self._gloves = self._gloves, gloves
        new = () if before is None else tuple(p for p in found if p.address in gloves - before)
        self._ports = frozenset(port.address for port in found)
        self.hear(Looked((*found, find.VIRTUAL), new))
