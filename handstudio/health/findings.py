"""What can be wrong with a stream or a sensor, and what a person should do about it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Literal, TypeAlias

Level: TypeAlias = Literal["note", "act"]
"""``note``: worth knowing. ``act``: it spoils what is recorded; do something about it now."""


class Kind(Enum):
    """What is wrong. Below each: what the value is, and what to do."""

    LOSS = "loss"
    """Instants that never came, % of the last 5 s. Check the cable; lower the rate."""
    DAMAGED = "damaged"
    """Damaged packets, % of the instants of the last 5 s. Change the cable, keep it off motors."""
    DROPPED = "dropped by device"
    """Instants the device had to drop, % of the last 5 s: the line or this computer is too slow.
    Lower the rate, close other programs, use a direct port instead of a hub."""
    RESTARTED = "restarted"
    """How often the device began anew within 5 s. Check its supply and plug; rest the hand for
    half a second so that its attitude is found again."""
    RATE = "rate"
    """How far the rate by the device's clock is from the one it told, %. Set the rate anew; if
    that does not help, tell the maker: speeds and angles in between are wrong by that much."""
    JITTER = "jitter"
    """Delay of arriving chunks, 95 of 100 below [ms]. Close other programs, use a direct port."""
    LATE = "late"
    """From the arrival of bytes to the published pose, 99 of 100 below [ms]. Close other programs;
    lower the rate."""
    DRIFT = "drift"
    """How the device's clock runs against the computer's [ppm]. Do not compare long takes with
    other recordings by time alone; tell the maker."""
    SILENT = "silent"
    """Instants the sensor did not answer, %. Check its cable and plug."""
    STUCK = "stuck"
    """How long its readings have not changed by a count [s]. Switch the glove off and on; if it
    comes back, the sensor is broken."""
    SATURATED = "saturated"
    """Instants at the limit of gyroscope or accelerometer, %. Move more slowly, avoid knocks, or
    set a wider range; angles at these instants are wrong."""
    NOISY = "noisy"
    """Noise at rest, as a multiple of what the others, or the data sheet, have. Check its solder
    and supply; replace the sensor if it stays."""
    MAGNETIC = "magnetic"
    """How far the field is from what it was and the others feel, %. Move away from iron, magnets,
    phones, motors; take off rings. Heading is in doubt while it lasts."""
    WARMED = "warmed"
    """Change of temperature since the start [°C]: biases drift with it. Rest the hand for half a
    second before the next take, or connect anew when it is warm."""


PER_SENSOR = frozenset(
    {Kind.SILENT, Kind.STUCK, Kind.SATURATED, Kind.NOISY, Kind.MAGNETIC, Kind.WARMED}
)
"""The others are of the stream as a whole and name no sensors."""

UNITS: dict[Kind, str] = {
    **dict.fromkeys((Kind.LOSS, Kind.DAMAGED, Kind.DROPPED, Kind.RATE), "%"),
    Kind.RESTARTED: "times",
    **dict.fromkeys((Kind.JITTER, Kind.LATE), "ms"),
    Kind.DRIFT: "ppm",
    **dict.fromkeys((Kind.SILENT, Kind.SATURATED, Kind.MAGNETIC), "%"),
    Kind.STUCK: "s",
    Kind.NOISY: "times the usual noise",
    Kind.WARMED: "°C",
}
"""What the value of each kind is in."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something is wrong, and has not been well again for long enough.

    Attributes:
        kind: What.
        level: How much it matters.
        sensors: Indices in the layout, rising; none for a finding of the stream.
        value: The worst of them at the last bad moment; unit as `Kind` says.
        limit: What it should stay at or below.
        since: Begin, seconds from the first instant; ``HealthView.time_s`` is now.
    """

    kind: Kind
    level: Level
    sensors: tuple[int, ...]
    value: float
    limit: float
    since: float
