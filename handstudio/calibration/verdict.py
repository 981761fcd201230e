"""What a step of a calibration was seen to be, held against what it should be.

Numbers only: the words belong to the page and the shell.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

What: TypeAlias = Literal[
    "answering",  # sensors that answered
    "upright",  # how far a sensor's attitude is from what its segment lets expect
    "stillness",  # how fast it turned where it should rest
    "range",  # how far the joint moved
    "second_axis",  # how far it moved about the second axis
    "pace",  # swings to and fro a second
    "others",  # how far another joint moved along, as a share of the joint's own range
    "time",  # how long it was done
    "turn",  # how far the whole rig was turned
    "together",  # how far sensors moved against one another while they should not
    "directions",  # how many directions the board lay still in
    "residual",  # what is left between what was computed and what was felt
    "against",  # how far it is from an earlier calibration
]
"""What was measured; a catalogue has words for each."""

Unit: TypeAlias = Literal["deg", "deg/s", "1/s", "%", "s", "mm", ""]


class Reading(msgspec.Struct, frozen=True):
    """One figure and its limit.

    Attributes:
        what: What was measured.
        value: How much, in the unit.
        limit: How much is wanted at least, or allowed at most.
        unit: Of both.
        at_least: Whether the limit is a least; otherwise it is a most.
        about: Which joint, segment or sensor, where it is not the step's own.
    """

    what: What
    value: float
    limit: float
    unit: Unit
    at_least: bool = True
    about: str = ""

    @property
    def ok(self) -> bool:
        """Whether the limit is kept; a figure that could not be had keeps none."""
        return self.value >= self.limit if self.at_least else self.value <= self.limit

    @property
    def share(self) -> float:
        """How much of the limit there is: of a least 1 is enough, of a most 1 is too much."""
        return self.value / self.limit if self.limit else float(self.value > 0.0)


class Verdict(msgspec.Struct, frozen=True):
    """What a step was seen to be.

    Attributes:
        step: Name of the step, which is its label in the take.
        readings: What was measured, the most telling first.
        over: Whether it has come to its end; until then it is not to be cut off, good as it is.
    """

    step: str
    readings: tuple[Reading, ...]
    over: bool = True

    @property
    def failing(self) -> tuple[Reading, ...]:
        """What is not as it should be."""
        return tuple(reading for reading in self.readings if not reading.ok)

    @property
    def ok(self) -> bool:
        """Whether the step was done well enough to be used."""
        return bool(self.readings) and not self.failing
