"""The watch over a stream: what came goes in, figures and findings come out.

The same live and over a recording: it knows no clock but the device's and the times of arrival it
is told.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from handstudio.health.account import Account
from handstudio.health.findings import Finding
from handstudio.health.measures import measure
from handstudio.health.record import TakeHealth
from handstudio.health.view import HealthView, view
from handstudio.health.windows import Window, Windows
from handstudio.protocol.packets import Packet
from handstudio.samples import Event
from handstudio.setup import Setup


class Watch:
    """Watches one device; a take that is recorded has an account of its own.

    A chunk is only counted and kept; every half second of the device's time all that was kept is
    judged at once, which costs a small part of what fusing the same instants costs.
    """

    def __init__(self) -> None:
        self._nominal_hz: float | None = None
        self._sensors = 0
        self._windows: Windows | None = None
        self._live = Account(0, 1.0)
        self._take: Account | None = None

    def begin(self, setup: Setup) -> None:
        """It is known now, or anew, what the device is; what was counted stays."""
        self._nominal_hz, self._sensors = setup.rate_hz, len(setup.layout.sensors)
        self._windows = Windows(self._sensors, setup.rate_hz)
        self._live = Account(self._sensors, setup.rate_hz, self._live.figures)

    def note(
        self, packets: Iterable[Packet], events: Sequence[Event], arrival_ns: int | None
    ) -> None:
        """Count and keep a chunk that arrived at host time ``arrival_ns``, None: nobody knows."""
        packets = list(packets)
        self._live.note(packets, events, arrival_ns)
        if self._take is not None:
            self._take.note(packets, events, arrival_ns)
        if self._windows is not None:
            for event in events:
                for window in self._windows.add(event):
                    self._judge(window)

    def note_latency(self, ms: float) -> None:
        """A chunk was published this long after it came."""
        self._live.figures.latency.add(ms)
        if self._take is not None:
            self._take.figures.latency.add(ms)

    def note_page(self, ms: float) -> None:
        """The slowest page answered after so long."""
        if self._take is not None:
            self._take.figures.page.add(ms)

    def begin_take(self) -> None:
        """From the next chunk on a take is recorded.

        Raises:
            ValueError: nothing is known of the device.
        """
        if self._nominal_hz is None:
            raise ValueError("The watch was not told what the device is.")
        self._flush()  # a take's first window begins with its first instant, as from the file
        self._take = Account(self._sensors, self._nominal_hz)

    def end_take(self) -> TakeHealth | None:
        """The take ended with the chunk before; its health, None if there was no take."""
        self._flush()
        take, self._take = self._take, None
        return None if take is None else take.kept()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is wrong now, the worse first."""
        return self._live.findings

    def view(self, now_ns: int) -> HealthView:
        """The figures now."""
        return view(self._live, self._nominal_hz, now_ns)

    def _flush(self) -> None:
        window = None if self._windows is None else self._windows.flush()
        if window is not None:
            self._judge(window)

    def _judge(self, window: Window) -> None:
        measures = measure(window)
        self._live.judge(measures)
        if self._take is not None:
            self._take.judge(measures)
