"""A measure: one figure about a hand, how sure it is, what is usual, or why there is none.

Numbers only: the words belong to the page, the shell and the report. Units are a reader's (degrees,
not radians), as those of a verdict are.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

Kind: TypeAlias = Literal[
    "most",  # the largest angle reached (flexion, abduction, ...)
    "least",  # the smallest (extension, adduction, ...)
    "range",  # between the two
    "tam",  # total active motion of a finger
    "strickland",  # of PIP and DIP, as a share of 175 deg
    "kapandji",  # opposition of the thumb, 0 to 10
    "pronation",  # of the thumb's base where it touched that
    "cycles",  # how often a joint moved to and fro
    "cycle_amplitude",
    "cycle_amplitude_cv",
    "cycle_period",
    "cycle_period_cv",
    "peak_speed",
    "mean_speed",
    "sparc",  # spectral arc length
    "ldlj",  # log dimensionless jerk
    "tremor_amplitude",
    "tremor_frequency",
    "individuation",  # how still the others are while this finger moves
    "stationarity",  # how still this finger is while others move
    "time_in_posture",
]
"""What was measured; a catalogue has words for each."""

Unit: TypeAlias = Literal["deg", "deg/s", "%", "s", "Hz", ""]

WhyNot: TypeAlias = Literal[
    "",
    "no_hand",  # the layout is not a hand's
    "no_sensor",  # the joint has none on one side
    "in_doubt",  # never placed, or silent: no instant can be trusted
    "no_start",  # an angle from the start, and the take has no rest to start from
    "no_calibration",  # needs the hand's own lengths and axes
    "too_short",
    "gaps",  # what there is lies in pieces too short for it
    "no_movement",  # nothing was done that it could be taken from
    "moving",  # wants a joint that is held
    "no_peak",  # nothing stands out of the spectrum
]
"""Why a measure cannot be given."""


class Measure(msgspec.Struct, frozen=True):
    """One figure.

    Attributes:
        kind: What was measured.
        about: Of which angle, finger or posture.
        value: How much, in the unit; None: it cannot be given, and ``why`` tells why not.
        unit: Of value, sd, norm and detectable.
        sd: Standard uncertainty; None: it cannot be told.
        norm: What adults reach; None: there is no such figure.
        detectable: The smallest change against another visit that is no mere error.
        grade: Of a score: excellent, good, fair, poor.
        at_s: When, seconds from the take's first instant.
        low, high: Where the value may lie, of what has no standard uncertainty.
        why: Why there is none.
        details: Figures beside it, by name: what a score was made of.
    """

    kind: Kind
    about: str
    value: float | None
    unit: Unit
    sd: float | None = None
    norm: float | None = None
    detectable: float | None = None
    grade: Literal["", "excellent", "good", "fair", "poor"] = ""
    at_s: float | None = None
    low: float | None = None
    high: float | None = None
    why: WhyNot = ""
    details: dict[str, float] = {}

    @property
    def deviation(self) -> float | None:
        """How much more than usual, negative: less."""
        if self.value is None or self.norm is None:
            return None
        return self.value - self.norm


def missing(kind: Kind, about: str, unit: Unit, why: WhyNot) -> Measure:
    """A measure that cannot be given, and why."""
    return Measure(kind, about, None, unit, why=why)
