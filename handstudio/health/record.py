"""The health of a take, as its summary keeps it. Times in seconds from its first instant."""

from __future__ import annotations

import msgspec

from handstudio.health.findings import Level


class Latency(msgspec.Struct, frozen=True):
    """From the arrival of bytes to the published pose [ms]."""

    p50_ms: float
    p99_ms: float
    max_ms: float


class SensorTotals(msgspec.Struct, frozen=True):
    """What became of one sensor.

    Attributes:
        saturated: Instants at the limit of its range.
        silent: Instants it did not answer.
        stuck_s: How long a finding of this kind was on [s]; likewise
        noisy_s: and
        disturbed_s: for the magnetic field.
        celsius_first: Temperature first told, None never.
        celsius_last: The last one.
    """

    saturated: int = 0
    silent: int = 0
    stuck_s: float = 0.0
    noisy_s: float = 0.0
    disturbed_s: float = 0.0
    celsius_first: float | None = None
    celsius_last: float | None = None


class Episode(msgspec.Struct, frozen=True):
    """A finding from its begin to its end.

    Attributes:
        kind: Value of a `Kind`; text, so that a kind of a later version does not hide a take.
        level: The worst it reached.
        sensors: Indices in the layout, all that were concerned; none for the stream.
        start_s: First bad moment.
        end_s: Last bad moment.
        worst: Worst value, unit as `Kind` says.
    """

    kind: str
    level: Level
    sensors: tuple[int, ...]
    start_s: float
    end_s: float
    worst: float


class TakeHealth(msgspec.Struct, frozen=True):
    """Figures over a take.

    Attributes:
        nominal_rate_hz: What the device told.
        measured_rate_hz: By the device's clock, gaps left out; None of less than two instants.
        instants: That came.
        missing: That did not.
        damaged: Packets.
        dropped_by_device: Instants the device says it dropped, from its first report in the take.
        restarts: Of the device.
        jitter_p95_ms: Delay of chunks against the least delayed; None of an import.
        drift_ppm: How much faster the host's clock ran, at the end; None within ten seconds.
        latency: None where nobody looked on: recomputed from the file.
        sensors: In the order of the layout.
        episodes: In the order they began; at most `limits.EPISODES`.
        episodes_not_kept: How many more there were.
    """

    nominal_rate_hz: float
    measured_rate_hz: float | None
    instants: int
    missing: int = 0
    damaged: int = 0
    dropped_by_device: int = 0
    restarts: int = 0
    jitter_p95_ms: float | None = None
    drift_ppm: float | None = None
    latency: Latency | None = None
    sensors: tuple[SensorTotals, ...] = ()
    episodes: tuple[Episode, ...] = ()
    episodes_not_kept: int = 0

    @property
    def loss_percent(self) -> float:
        """Share of the instants that were lost."""
        whole = self.instants + self.missing
        return 100.0 * self.missing / whole if whole else 0.0
