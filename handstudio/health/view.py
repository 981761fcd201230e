"""Figures of a stream at one moment, for whoever shows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handstudio.arrays import Array
from handstudio.health.account import Account, known
from handstudio.health.distribution import Quantiles


@dataclass(frozen=True, slots=True)
class SensorView:
    """One sensor in the newest window, of half a second; None: nothing to say.

    Attributes:
        silent_percent: Instants it did not answer.
        saturated_percent: Instants at the limit of its range.
        saturated: The same as a count, since the device was met.
        stuck_s: How long its readings have not changed.
        noise: White noise at rest, as a multiple of what is usual.
        field_percent: How far the magnetic field is from what it was.
        celsius: Its temperature.
        warmed_celsius: Change of that since the first that was told.
    """

    silent_percent: float | None = None
    saturated_percent: float | None = None
    saturated: int = 0
    stuck_s: float = 0.0
    noise: float | None = None
    field_percent: float | None = None
    celsius: float | None = None
    warmed_celsius: float | None = None


@dataclass(frozen=True, slots=True)
class HealthView:
    """Figures of a stream at one moment; *recent* is the last 5 s, *whole* since it was connected.

    Rates: ``rate_hz`` by arrival in the last 2 s, ``measured_rate_hz`` by the device's own clock.
    Jitter and delay: how much later than the least delayed a chunk came. Latency: from a chunk's
    arrival to its published pose.
    """

    rate_hz: float = 0.0
    packets: int = 0
    missing: int = 0
    damaged: int = 0
    restarts: int = 0
    dropped_by_device: int = 0
    latency_p99_ms: float = 0.0  # recent
    delay_ms: float = 0.0  # of the newest chunk
    drift_ppm: float | None = None
    offset_ns: int | None = None
    silent: tuple[int, ...] = ()  # sensors that did not answer the newest instant
    celsius: float | None = None  # the warmest sensor
    nominal_rate_hz: float | None = None
    measured_rate_hz: float | None = None
    jitter_p95_ms: float = 0.0  # recent
    latency_p50_ms: float = 0.0  # recent
    latency_max_ms: float = 0.0  # recent
    latency_whole: Quantiles | None = None
    jitter_whole_p95_ms: float | None = None
    time_s: float = 0.0  # on the axis of `Finding.since`
    sensors: tuple[SensorView, ...] = ()  # in the order of the layout

    @property
    def loss_percent(self) -> float:
        """Share of the instants that were lost."""
        whole = self.packets + self.missing
        return 100.0 * self.missing / whole if whole else 0.0


def view(account: Account, nominal_rate_hz: float | None, now_ns: int) -> HealthView:
    """The figures of an account now, at host time ``now_ns``."""
    figures = account.figures
    latency = figures.latency.recent_quantiles() or Quantiles(0.0, 0.0, 0.0)
    return HealthView(
        rate_hz=figures.arrival_rate_hz(now_ns),
        packets=figures.instants,
        missing=figures.missing,
        damaged=figures.damaged,
        restarts=figures.restarts,
        dropped_by_device=figures.dropped_by_device,
        latency_p99_ms=latency.p99_ms,
        delay_ms=figures.delay_ms,
        drift_ppm=figures.clock.drift_ppm,
        offset_ns=figures.clock.offset_ns(),
        silent=figures.silent,
        celsius=_warmest(figures.celsius),
        nominal_rate_hz=nominal_rate_hz,
        measured_rate_hz=figures.measured_rate_hz,
        jitter_p95_ms=figures.jitter.recent_quantile(0.95) or 0.0,
        latency_p50_ms=latency.p50_ms,
        latency_max_ms=latency.max_ms,
        latency_whole=figures.latency.quantiles(),
        jitter_whole_p95_ms=figures.jitter.quantile(0.95),
        time_s=account.time_s,
        sensors=sensors_of(account),
    )


def sensors_of(account: Account) -> tuple[SensorView, ...]:
    """Every sensor in the newest window; none before the first."""
    values = account.values
    if values is None:
        return ()
    figures, warmed = account.figures, account.figures.warmed
    return tuple(
        SensorView(
            known(values.silent, i),
            known(values.saturated, i),
            int(account.saturated[i]),
            float(values.stuck[i]),
            known(values.noisy, i),
            known(values.magnetic, i),
            known(figures.celsius, i),
            known(warmed, i),
        )
        for i in range(len(values.silent))
    )


def _warmest(celsius: Array | None) -> float | None:
    if celsius is None or np.isnan(celsius).all():
        return None
    return float(np.nanmax(celsius))
