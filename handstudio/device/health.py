"""The health of the device that is connected, as the capture thread keeps it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from handstudio.health.findings import Finding
from handstudio.health.view import HealthView
from handstudio.health.watch import Watch
from handstudio.protocol.packets import Packet
from handstudio.recording.header import Summary
from handstudio.samples import Event
from handstudio.setup import Setup

__all__ = ["HealthKeeper", "HealthView"]

HEALTH_S = 0.1
"""Between two times the figures are renewed: they cost as much as a filter step."""


class HealthKeeper:
    """A watch and its newest view, renewed now and then; owned by the capture thread."""

    def __init__(self) -> None:
        self.view = HealthView()
        self.findings: tuple[Finding, ...] = ()
        self._watch = Watch()
        self._due_ns = 0

    def meet(self, setup: Setup) -> None:
        """It is known what the device is, or that it is another than before."""
        self._watch.begin(setup)

    def note(self, packets: Iterable[Packet], events: Sequence[Event], arrival_ns: int) -> None:
        """A chunk came at host time ``arrival_ns``."""
        self._watch.note(packets, events, arrival_ns)

    def note_published(self, arrival_ns: int, now_ns: int) -> None:
        """What came then was published now; renews the view when it is time."""
        self._watch.note_latency((now_ns - arrival_ns) * 1e-6)
        if now_ns >= self._due_ns:
            self.renew(now_ns)

    def renew(self, now_ns: int) -> None:
        """Renew the view."""
        self.view, self.findings = self._watch.view(now_ns), self._watch.findings
        self._due_ns = now_ns + round(HEALTH_S * 1e9)

    def note_page(self, ms: float) -> None:
        """The slowest page answered what it was sent after so long."""
        self._watch.note_page(ms)

    def begin_take(self) -> None:
        """From the next chunk on a take is recorded."""
        self._watch.begin_take()

    def summary(self, seconds: float, now_ns: int) -> Summary:
        """The take ended; what is to be kept of it. The writer knows how much it wrote."""
        view, health = self._watch.view(now_ns), self._watch.end_take()
        return Summary(
            chunks=0,
            bytes=0,
            duration_s=seconds,
            packets=health.instants if health else 0,
            missing=health.missing if health else 0,
            damaged=health.damaged if health else 0,
            clock_offset_ns=view.offset_ns,
            clock_drift_ppm=view.drift_ppm,
            health=health,
        )
