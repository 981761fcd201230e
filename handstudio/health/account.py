"""The health of a stream from some moment on: since it was connected, or during a take."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from handstudio.arrays import Array
from handstudio.health.distribution import Quantiles
from handstudio.health.episodes import Episodes
from handstudio.health.figures import Figures
from handstudio.health.findings import PER_SENSOR, Finding, Kind
from handstudio.health.latch import Latch
from handstudio.health.measures import Measures
from handstudio.health.record import Latency, SensorTotals, TakeHealth
from handstudio.health.sensors import SensorJudge, SensorValues
from handstudio.protocol.packets import Packet
from handstudio.samples import Event


class Account:
    """Figures, findings and episodes; chunks and windows go in, values come out."""

    def __init__(self, sensors: int, rate_hz: float, figures: Figures | None = None) -> None:
        self.figures = figures or Figures()
        self.findings: tuple[Finding, ...] = ()
        self.values: SensorValues | None = None  # of the newest window
        self.time_s = 0.0  # of the end of the newest window
        self._rate_hz = rate_hz
        self._sensors = sensors
        self._judge = SensorJudge(sensors, rate_hz)
        self._latches = {kind: Latch(kind, sensors if kind in PER_SENSOR else 1) for kind in Kind}
        self._episodes = Episodes()
        self._on_s = {kind: np.zeros(sensors) for kind in (Kind.STUCK, Kind.NOISY, Kind.MAGNETIC)}
        self._first_us: int | None = None

    def note(
        self, packets: Iterable[Packet], events: Sequence[Event], arrival_ns: int | None
    ) -> None:
        """Count a chunk."""
        self.figures.note(packets, events, arrival_ns)

    def judge(self, measures: Measures) -> None:
        """Judge a window."""
        if self._first_us is None:
            self._first_us = measures.start_us
        start_s = (measures.start_us - self._first_us) * 1e-6
        self.time_s = (measures.end_us - self._first_us) * 1e-6
        span_s = self.time_s - start_s + 1.0 / self._rate_hz
        for kind, value in self._values(measures).items():
            latch = self._latches[kind]
            latch.update(value, start_s, self.time_s, span_s)
            self._episodes.update(latch)
        for kind, seconds in self._on_s.items():
            seconds += span_s * self._latches[kind].on[0]  # noqa: PLW2901 - in place
        every = [finding for latch in self._latches.values() for finding in latch.findings()]
        self.findings = tuple(sorted(every, key=lambda finding: finding.level != "act"))

    @property
    def saturated(self) -> Array:
        """Instants at the limit, of every sensor."""
        return self._judge.saturated

    def kept(self) -> TakeHealth:
        """Everything until now, as a take keeps it."""
        figures = self.figures
        episodes, beyond = self._episodes.kept()
        return TakeHealth(
            nominal_rate_hz=self._rate_hz,
            measured_rate_hz=figures.measured_rate_hz,
            instants=figures.instants,
            missing=figures.missing,
            damaged=figures.damaged,
            dropped_by_device=figures.dropped,
            restarts=figures.restarts,
            jitter_p95_ms=figures.jitter.quantile(0.95),
            drift_ppm=figures.clock.drift_ppm,
            latency=_latency(figures.latency.quantiles()),
            page=_latency(figures.page.quantiles()),
            sensors=self._totals(),
            episodes=episodes,
            episodes_not_kept=beyond,
        )

    def _values(self, measures: Measures) -> dict[Kind, Array]:
        stream = self.figures.close_window(measures, self._rate_hz)
        disturbed = self._latches[Kind.MAGNETIC].on[0]
        self.values = self._judge.judge(measures, disturbed)
        warmed = self.figures.warmed
        if warmed is None or len(warmed) != self._sensors:
            warmed = np.full(self._sensors, np.nan)
        return {
            **{kind: np.array([value]) for kind, value in stream.items()},
            **self.values.by_kind(),
            Kind.WARMED: np.abs(warmed),
        }

    def _totals(self) -> tuple[SensorTotals, ...]:
        stuck, noisy, disturbed = (self._on_s[kind] for kind in self._on_s)
        first, last = self.figures.celsius_first, self.figures.celsius
        return tuple(
            SensorTotals(
                saturated=int(self._judge.saturated[i]),
                silent=int(self._judge.silent[i]),
                stuck_s=float(stuck[i]),
                noisy_s=float(noisy[i]),
                disturbed_s=float(disturbed[i]),
                celsius_first=known(first, i),
                celsius_last=known(last, i),
            )
            for i in range(self._sensors)
        )


def known(values: Array | None, index: int) -> float | None:
    """One of the values; None where it is not there or not known."""
    if values is None or index >= len(values) or not np.isfinite(values[index]):
        return None
    return float(values[index])


def _latency(quantiles: Quantiles | None) -> Latency | None:
    if quantiles is None:
        return None
    return Latency(quantiles.p50_ms, quantiles.p99_ms, quantiles.max_ms)
