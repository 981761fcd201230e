"""Taking a take: the countdown before it, the disk it goes to, and what ends it by itself. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

ALONE_LIMIT_S = 60.0
"""A take ends this long after the last page was closed: time enough to open it again."""

LOST_LIMIT_S = 600.0
"""A take ends when its device has been away this long: a glove that was put away."""

BLIP_S = 2.0
"""A device that has been still for less is as good as there: on a busy machine nothing may come for
half a second, and nobody's press of *Record* is to be refused for that."""

WARN_SECONDS = 15 * 60
"""Say so when the disk has room for less than this: longer than most takes."""

WARN_BYTES = 500_000_000
"""Say so when the disk has less room than this, whatever the rate."""

STOP_BYTES = 50_000_000
"""End the take when the disk has less room than this: it, its motion and its notes still fit."""

BYTES = 55
"""What a take grows by for each sensor and instant: 20 as they came, 35 of motion beside them."""


class Ending(Enum):
    """Why a take was ended by the studio itself."""

    ALONE = "alone"
    LOST = "lost"
    FULL = "full"


@dataclass(frozen=True, slots=True)
class Disk:
    """The disk that takes go to."""

    free_bytes: int
    bytes_per_s: float

    @property
    def seconds_left(self) -> float:
        """How long a take it can hold."""
        return max(0.0, self.free_bytes - STOP_BYTES) / max(self.bytes_per_s, 1.0)

    @property
    def low(self) -> bool:
        """Whether to say so."""
        return self.free_bytes < WARN_BYTES or self.seconds_left < WARN_SECONDS

    @property
    def full(self) -> bool:
        """Whether no take may go on, or begin."""
        return self.free_bytes < STOP_BYTES


@dataclass(frozen=True, slots=True)
class Countdown:
    """A take is about to begin."""

    left_s: float

    @property
    def shown(self) -> int:
        """What is counted: 3, 2, 1."""
        return max(1, math.ceil(self.left_s))

    @property
    def over(self) -> bool:
        """Whether it is time."""
        return self.left_s <= 0.0


def counted(countdown: Countdown, elapsed_s: float) -> Countdown:
    """So much later."""
    return Countdown(countdown.left_s - elapsed_s)


@dataclass(frozen=True, slots=True)
class Watch:
    """What may end a take that is on: how long nobody has looked, and no device has sent."""

    alone_s: float = 0.0
    lost_s: float = 0.0


def watched(watch: Watch, elapsed_s: float, *, pages: int, lost: bool) -> Watch:
    """So much later, with so many pages open, and the device away or there."""
    return replace(
        watch,
        alone_s=0.0 if pages else watch.alone_s + elapsed_s,
        lost_s=watch.lost_s + elapsed_s if lost else 0.0,
    )


def ending_of(watch: Watch, disk: Disk | None) -> Ending | None:
    """Whether the take is to end now, and why."""
    if disk is not None and disk.full:
        return Ending.FULL
    if watch.alone_s > ALONE_LIMIT_S:
        return Ending.ALONE
    if watch.lost_s > LOST_LIMIT_S:
        return Ending.LOST
    return None
