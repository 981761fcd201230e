"""The health of a take, as its summary keeps it. Times in seconds from its first instant."""

from __future__ import annotations

import msgspec

from handstudio.health.findings import UNITS, Level


class Latency(msgspec.Struct, frozen=True):
    """From the arrival of bytes to the published pose, or from that to the page and back [ms]."""

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


class Trouble(msgspec.Struct, frozen=True):
    """All kept episodes of one kind together.

    Attributes:
        kind: Value of a `Kind`.
        level: The worst.
        unit: Of ``worst``; empty where the kind is unknown to this version.
        worst: Worst value.
        seconds: How long it lasted, all episodes together.
        times: How many episodes.
        sensors: Indices in the layout, all that were concerned.
    """

    kind: str
    level: Level
    unit: str
    worst: float
    seconds: float
    times: int
    sensors: tuple[int, ...]


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
        page: From a pose that is sent to the slowest page to its answer; None without a page.
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
    page: Latency | None = None
    sensors: tuple[SensorTotals, ...] = ()
    episodes: tuple[Episode, ...] = ()
    episodes_not_kept: int = 0

    @property
    def loss_percent(self) -> float:
        """Share of the instants that were lost."""
        whole = self.instants + self.missing
        return 100.0 * self.missing / whole if whole else 0.0

    @property
    def troubles(self) -> tuple[Trouble, ...]:
        """What was wrong, one entry a kind, those to act on first."""
        kinds: dict[str, list[Episode]] = {}
        for episode in self.episodes:
            kinds.setdefault(episode.kind, []).append(episode)
        every = [_trouble(kind, episodes) for kind, episodes in kinds.items()]
        return tuple(sorted(every, key=lambda one: (one.level != "act", one.kind)))


_UNITS = {kind.value: unit for kind, unit in UNITS.items()}


def _trouble(kind: str, episodes: list[Episode]) -> Trouble:
    return Trouble(
        kind=kind,
        level="act" if any(one.level == "act" for one in episodes) else "note",
        unit=_UNITS.get(kind, ""),
        worst=max(one.worst for one in episodes),
        seconds=round(sum(one.end_s - one.start_s for one in episodes), 3),
        times=len(episodes),
        sensors=tuple(sorted({sensor for one in episodes for sensor in one.sensors})),
    )
