"""Findings from begin to end, so many and no more."""

from __future__ import annotations

from dataclasses import dataclass, field

from handstudio.health.findings import PER_SENSOR, Kind
from handstudio.health.latch import Latch
from handstudio.health.limits import EPISODES
from handstudio.health.record import Episode


@dataclass
class _Open:
    start_s: float
    end_s: float
    worst: float
    act: bool
    sensors: set[int] = field(default_factory=set)


class Episodes:
    """Gathers episodes; memory is bounded."""

    def __init__(self) -> None:
        self._open: dict[Kind, _Open] = {}
        self._closed: list[tuple[float, Kind, Episode]] = []
        self._beyond = 0

    def update(self, latch: Latch) -> None:
        """A latch after a window."""
        on = latch.on[0]
        if not on.any():
            if latch.kind in self._open:
                self._close(latch.kind, self._open.pop(latch.kind))
            return
        worst = float(latch.shown[on].max())
        here = self._open.get(latch.kind)
        if here is None:
            here = self._open[latch.kind] = _Open(latch.since_s, 0.0, worst, False)
        here.end_s = latch.bad_until_s
        here.worst = max(here.worst, worst)
        here.act |= bool(latch.on[1].any())
        if latch.kind in PER_SENSOR:
            here.sensors.update(int(i) for i in on.nonzero()[0])

    def kept(self) -> tuple[tuple[Episode, ...], int]:
        """Those until now, in the order they began, and how many more there were."""
        going_on = [(o.start_s, kind, _episode(kind, o)) for kind, o in self._open.items()]
        every = sorted([*self._closed, *going_on], key=lambda one: (one[0], one[1].value))
        beyond = self._beyond + max(0, len(every) - EPISODES)
        return tuple(episode for _, _, episode in every[:EPISODES]), beyond

    def _close(self, kind: Kind, done: _Open) -> None:
        if len(self._closed) < EPISODES:
            self._closed.append((done.start_s, kind, _episode(kind, done)))
        else:
            self._beyond += 1


def _episode(kind: Kind, one: _Open) -> Episode:
    return Episode(
        kind.value,
        "act" if one.act else "note",
        tuple(sorted(one.sensors)),
        one.start_s,
        one.end_s,
        one.worst,
    )
