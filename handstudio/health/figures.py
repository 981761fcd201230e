"""Figures of a stream as a whole, counted as it passes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.health.clock import ClockEstimate
from handstudio.health.distribution import Distribution
from handstudio.health.findings import Kind
from handstudio.health.limits import RECENT_WINDOWS
from handstudio.health.measures import Measures
from handstudio.protocol.packets import Corruption, Health, Packet, Restart, Temperature
from handstudio.samples import Event, Gap, ImuSamples, Why

_SPAN_NS = 2_000_000_000  # of arrivals in the rate


class Figures:
    """Counts from some moment on; a chunk costs a few microseconds, whatever is in it."""

    def __init__(self) -> None:
        self.instants = self.missing = self.damaged = self.restarts = 0
        self.dropped_by_device = 0  # as the device reports it, since it started
        self.dropped = 0  # since the first report heard here
        self.celsius: Float[Array, " s"] | None = None
        self.celsius_first: Float[Array, " s"] | None = None
        self.silent: tuple[int, ...] = ()  # in the newest instant
        self.delay_ms = 0.0
        self.clock = ClockEstimate()
        self.jitter = Distribution()
        self.latency = Distribution()
        self.page = Distribution()
        self._steps = self._steps_us = 0
        self._reported: int | None = None
        self._arrivals: deque[tuple[int, int]] = deque()  # arrival ns, instants
        self._recent: deque[tuple[int, ...]] = deque(maxlen=RECENT_WINDOWS)
        self._marked = (0, 0)  # damaged and dropped when the last window ended

    def note(
        self, packets: Iterable[Packet], events: Sequence[Event], arrival_ns: int | None
    ) -> None:
        """Count a chunk."""
        for packet in packets:
            match packet:
                case Corruption():
                    self.damaged += 1
                case Health(dropped=dropped):
                    self._note_dropped(dropped)
                case Temperature(celsius=celsius):
                    self._note_celsius(celsius)
                case Restart():
                    self._reported = 0  # the device's own count begins anew
                case _:
                    pass
        newest: ImuSamples | None = None
        before = self.instants
        for event in events:
            match event:
                case ImuSamples():
                    self.instants += len(event)
                    newest = event
                case Gap(why=Why.RESTART):
                    self._note_restart()
                case Gap(missing=missing):
                    self.missing += missing
        if newest is not None:
            self._note_newest(newest)
            if arrival_ns is not None:
                self._note_arrival(newest, self.instants - before, arrival_ns)

    def close_window(self, measures: Measures, nominal_hz: float) -> dict[Kind, float]:
        """Add a window; what the recent ones say of the stream, unit as `Kind` says."""
        self._steps += measures.steps
        self._steps_us += measures.steps_us
        damaged, dropped = self.damaged - self._marked[0], self.dropped - self._marked[1]
        self._marked = (self.damaged, self.dropped)
        counts = (measures.instants, measures.missing, damaged, dropped, measures.restarts)
        self._recent.append(counts)
        instants, missing, damaged, dropped, restarts = map(sum, zip(*self._recent, strict=True))
        # of a second at least: the first lost instant of a stream is not half of it
        percent = 100.0 / max(instants + missing, nominal_hz)
        nan = float("nan")
        drift = self.clock.sure_drift_ppm
        jitter = self.jitter.sure_quantile(0.95)
        late = self.latency.sure_quantile(0.99)
        self.jitter.turn()
        self.latency.turn()
        return {
            Kind.LOSS: percent * missing,
            Kind.DAMAGED: percent * damaged,
            Kind.DROPPED: percent * dropped,
            Kind.RESTARTED: float(restarts),
            Kind.RATE: abs(1e8 / (measures.step_us * nominal_hz) - 100.0),
            Kind.JITTER: nan if jitter is None else jitter,
            Kind.LATE: nan if late is None else late,
            Kind.DRIFT: nan if drift is None else abs(drift),
        }

    @property
    def measured_rate_hz(self) -> float | None:
        """Instants a second by the device's clock, gaps left out."""
        return 1e6 * self._steps / self._steps_us if self._steps_us else None

    def arrival_rate_hz(self, now_ns: int) -> float:
        """Instants a second by the host's clock over the last two seconds; 0: they stopped."""
        while self._arrivals and self._arrivals[0][0] < now_ns - _SPAN_NS:
            self._arrivals.popleft()
        if len(self._arrivals) < 2:
            return 0.0
        span_ns = self._arrivals[-1][0] - self._arrivals[0][0]
        # the instants of the first chunk lie before the span
        counted = sum(count for _, count in self._arrivals) - self._arrivals[0][1]
        return counted * 1e9 / span_ns if span_ns else 0.0

    @property
    def warmed(self) -> Float[Array, " s"] | None:
        """Change of temperature of every sensor since the first that was told [°C]."""
        if self.celsius is None or self.celsius_first is None:
            return None
        return self.celsius - self.celsius_first

    def _note_newest(self, newest: ImuSamples) -> None:
        answering = newest.valid[-1]
        every = bool(answering.all())
        self.silent = () if every else tuple(int(i) for i in np.flatnonzero(~answering))

    def _note_arrival(self, newest: ImuSamples, instants: int, arrival_ns: int) -> None:
        clock_us = int(newest.time_us[-1])
        self._arrivals.append((arrival_ns, instants))
        if self._arrivals[0][0] < arrival_ns - 2 * _SPAN_NS:
            self._arrivals.popleft()  # also where nobody asks for the rate
        self.clock.observe(clock_us, arrival_ns)
        self.delay_ms = self.clock.delay_ms(clock_us, arrival_ns)
        self.jitter.add(self.delay_ms)

    def _note_restart(self) -> None:
        self.restarts += 1
        self.clock.restart()

    def _note_dropped(self, dropped: int) -> None:
        if self._reported is not None and dropped >= self._reported:
            self.dropped += dropped - self._reported
        self._reported = self.dropped_by_device = dropped

    def _note_celsius(self, celsius: Array) -> None:
        last, first = self.celsius, self.celsius_first
        if last is None or first is None or len(last) != len(celsius):
            last = first = np.full(len(celsius), np.nan)
        self.celsius = np.where(np.isnan(celsius), last, celsius)
        self.celsius_first = np.where(np.isnan(first), celsius, first)
