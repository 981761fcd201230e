"""What a stream tells of itself, counted as it passes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from handstudio.device.clock import ClockEstimate
from handstudio.protocol.packets import (
    Corruption,
    Health,
    ImuPacket,
    Missing,
    Packet,
    Restart,
    Temperature,
)

_SPAN_NS = 2_000_000_000


@dataclass(frozen=True, slots=True)
class HealthView:
    """Figures of a stream at one moment."""

    rate_hz: float = 0.0
    packets: int = 0
    missing: int = 0
    damaged: int = 0
    restarts: int = 0
    dropped_by_device: int = 0
    latency_p99_ms: float = 0.0  # from a chunk's arrival to its published pose, last 2 s
    delay_ms: float = 0.0  # how much later than the least delayed the newest chunk came
    drift_ppm: float | None = None
    offset_ns: int | None = None
    silent: tuple[int, ...] = ()  # sensors that did not answer the newest instant
    celsius: float | None = None  # the warmest sensor

    @property
    def loss_percent(self) -> float:
        """Share of the instants that were lost."""
        whole = self.packets + self.missing
        return 100.0 * self.missing / whole if whole else 0.0


@dataclass
class HealthCount:
    """Counts of one stream; owned by the capture thread."""

    packets: int = 0
    missing: int = 0
    damaged: int = 0
    restarts: int = 0
    dropped_by_device: int = 0
    celsius: float | None = None
    silent: tuple[int, ...] = ()
    delay_ms: float = 0.0
    clock: ClockEstimate = field(default_factory=ClockEstimate)
    _arrivals: deque[tuple[int, int]] = field(default_factory=deque)  # arrival ns, instants
    _latencies: deque[float] = field(default_factory=lambda: deque(maxlen=1000))

    def note(self, packets: Iterable[Packet], arrival_ns: int) -> None:
        """Count the packets of a chunk."""
        newest: ImuPacket | None = None
        instants = 0
        for packet in packets:
            match packet:
                case ImuPacket():
                    newest, instants = packet, instants + 1
                case Missing(count=count):
                    self.missing += count
                case Corruption():
                    self.damaged += 1
                case Restart():
                    self.restarts += 1
                    self.clock.restart()
                case Health(dropped=dropped):
                    self.dropped_by_device = dropped
                case Temperature(celsius=celsius) if np.isfinite(celsius).any():
                    self.celsius = float(np.nanmax(celsius))
                case _:
                    pass
        self.packets += instants
        if newest is not None:
            self._note_newest(newest, instants, arrival_ns)

    def note_latency(self, ms: float) -> None:
        """A chunk was published this long after it came."""
        self._latencies.append(ms)

    def view(self, now_ns: int) -> HealthView:
        """The figures now."""
        while self._arrivals and self._arrivals[0][0] < now_ns - _SPAN_NS:
            self._arrivals.popleft()
        return HealthView(
            rate_hz=self._rate(),
            packets=self.packets,
            missing=self.missing,
            damaged=self.damaged,
            restarts=self.restarts,
            dropped_by_device=self.dropped_by_device,
            latency_p99_ms=float(np.percentile(self._latencies, 99)) if self._latencies else 0.0,
            delay_ms=self.delay_ms,
            drift_ppm=self.clock.drift_ppm,
            offset_ns=self.clock.offset_ns(),
            silent=self.silent,
            celsius=self.celsius,
        )

    def _note_newest(self, newest: ImuPacket, instants: int, arrival_ns: int) -> None:
        self._arrivals.append((arrival_ns, instants))
        self.clock.observe(newest.clock_us, arrival_ns)
        self.delay_ms = self.clock.delay_ms(newest.clock_us, arrival_ns)
        self.silent = tuple(int(i) for i in np.flatnonzero(~newest.answering))

    def _rate(self) -> float:
        """Instants a second over the last two seconds; 0 when they stopped."""
        if len(self._arrivals) < 2:
            return 0.0
        span_ns = self._arrivals[-1][0] - self._arrivals[0][0]
        # the instants of the first chunk lie before the span
        counted = sum(count for _, count in self._arrivals) - self._arrivals[0][1]
        return counted * 1e9 / span_ns if span_ns else 0.0
