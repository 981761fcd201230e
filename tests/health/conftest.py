"""A glove on a hand, read into packets that a test may spoil, and a watch that looks at them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from handstudio.arrays import Array
from handstudio.hand.skeleton import FINGERS
from handstudio.health.findings import Finding, Kind
from handstudio.health.watch import Watch
from handstudio.protocol.packets import ImuPacket, Missing, Packet, Status
from handstudio.samples import Event, Ranges, from_packets
from handstudio.setup import Setup, for_device
from handstudio.simulation.glove import description, plain_glove
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.postures import Script, scripted

START_NS = 1_800_000_000_000_000_000
DEVICE_US = 7_300_000  # the device's clock at the first instant: not on the edge of a window

_FIST = {f"{finger}_{joint}_flexion": 85.0 for finger in FINGERS[1:] for joint in ("mcp", "pip")}
_UP = {"elbow_flexion": 60.0, "wrist_flexion": 50.0, "forearm_pronation": -100.0}
SCRIPTS: dict[str, Script] = {
    "rest": [(60.0, {})],
    # 570 deg/s at a joint, more than 1000 at a fingertip, 5 g
    "fast": [(1.0, {}), *([(0.3, _FIST | _UP), (0.3, {})] * 30)],
}

Chunk = tuple[list[Packet], list[Event], int]


@dataclass(frozen=True)
class Glove:
    """What a glove says; `counts` may be changed, they are the test's own."""

    setup: Setup
    ranges: Ranges
    rate_hz: int
    clock_us: Array
    counts: Array  # n s 9
    fresh: Array
    answering: Array

    def packets(self) -> list[ImuPacket]:
        return [
            ImuPacket(
                epoch=1,
                status=Status(0),
                sequence=k,
                clock_us=int(self.clock_us[k]),
                answering=self.answering[k],
                fresh=self.fresh[k],
                counts=self.counts[k],
            )
            for k in range(len(self.clock_us))
        ]

    def arrival_ns(self, clock_us: int) -> int:
        return START_NS + (clock_us - DEVICE_US) * 1000 + 2_000_000

    def chunks(self, packets: Iterable[Packet] | None = None, at_once: int = 1) -> list[Chunk]:
        """Packets in chunks of so many, each arriving 2 ms after its newest instant."""
        every = list(self.packets() if packets is None else packets)
        out, arrival_ns = list[Chunk](), START_NS
        for first in range(0, len(every), at_once):
            part = every[first : first + at_once]
            for packet in part:
                if isinstance(packet, ImuPacket):
                    arrival_ns = self.arrival_ns(packet.clock_us)
            out.append((part, from_packets(part, self.ranges), arrival_ns))
        return out


def glove(rate_hz: int = 100, seconds: float = 8.0, seed: int = 0, motion: str = "rest") -> Glove:
    """A glove that performs."""
    setup, ranges, clock_us, counts, fresh = _performed(rate_hz, seconds, seed, motion)
    answering = np.ones(fresh.shape, dtype=bool)
    return Glove(setup, ranges, rate_hz, clock_us.copy(), counts.copy(), fresh.copy(), answering)


@lru_cache(maxsize=8)
def _performed(
    rate_hz: int, seconds: float, seed: int, motion: str
) -> tuple[Setup, Ranges, Array, Array, Array]:
    told = description("right", seed, rate_hz, epoch=1, name="glove")
    played = showcase("right") if motion == "showcase" else scripted(SCRIPTS[motion], "right")
    time_us = np.arange(round(seconds * rate_hz)) * (1_000_000 // rate_hz)
    readings = plain_glove("right", seed, played).read(time_us, rate_hz)
    setup = for_device(told, "handstudio-1")
    return setup, Ranges.of(told), DEVICE_US + time_us, readings.counts, readings.fresh


@dataclass
class Seen:
    """What a watch found while it watched, with the second it was there."""

    watch: Watch
    findings: list[tuple[float, Finding]]

    def kinds(self) -> set[Kind]:
        return {finding.kind for _, finding in self.findings}

    def of(self, kind: Kind) -> list[tuple[float, Finding]]:
        return [(at, finding) for at, finding in self.findings if finding.kind is kind]


def watched(one: Glove, chunks: Iterable[Chunk], latency_ms: float = 3.0) -> Seen:
    """Feed chunks to a watch."""
    watch, found = Watch(), list[tuple[float, Finding]]()
    watch.begin(one.setup)
    watch.begin_take()
    for packets, events, arrival_ns in chunks:
        watch.note(packets, events, arrival_ns)
        watch.note_latency(latency_ms)
        now_s = (arrival_ns - START_NS) * 1e-9
        found += [(now_s, finding) for finding in watch.findings]
    return Seen(watch, found)


def with_missing(packets: Iterable[ImuPacket]) -> list[Packet]:
    """The same, and what its decoder says of those that are not there."""
    out: list[Packet] = []
    last: int | None = None
    for packet in packets:
        if last is not None and packet.sequence > last + 1:
            out.append(Missing(packet.sequence - last - 1))
        out.append(packet)
        last = packet.sequence
    return out
