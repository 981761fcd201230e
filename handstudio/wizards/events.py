"""What happens in a course, and what it tells: to hear, to ask of the device, to write down."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from handstudio.samples import ImuSamples


class Cue(Enum):
    """Something to be heard."""

    TICK = "tick"
    START = "start"
    STOP = "stop"
    REFUSED = "refused"


@dataclass(frozen=True, slots=True)
class Perform:
    """Have whoever wears the glove do this, where the device can ask."""

    motions: str


@dataclass(frozen=True, slots=True)
class Labelled:
    """This stretch of the device's time is to be written down [µs]."""

    label: str
    start_us: int
    end_us: int


Told: TypeAlias = Cue | Perform | Labelled


# --- what happens ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """The device sent these."""

    samples: ImuSamples


@dataclass(frozen=True, slots=True)
class Lost:
    """The device is away."""


@dataclass(frozen=True, slots=True)
class Next:
    """Go on: begin the step, end it now, repeat a refused one, or go to the next."""


@dataclass(frozen=True, slots=True)
class Repeat:
    """The step once more."""


@dataclass(frozen=True, slots=True)
class Accept:
    """Use the step though it was refused."""


@dataclass(frozen=True, slots=True)
class Skip:
    """Leave the step out, where it may be."""


@dataclass(frozen=True, slots=True)
class Redo:
    """This step, by its place in the course, once more; the others stay."""

    index: int


@dataclass(frozen=True, slots=True)
class GoByItself:
    """Whether the course goes on without anybody saying so."""

    on: bool


@dataclass(frozen=True, slots=True)
class Leave:
    """No more for now; the step that is on is begun anew when somebody comes back."""


Event: TypeAlias = Samples | Lost | Next | Repeat | Accept | Skip | Redo | GoByItself | Leave
