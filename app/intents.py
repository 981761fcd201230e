"""What a person can ask of the studio. Panels send these; only the studio acts on them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from handstudio.export.csv import Content


@dataclass(frozen=True, slots=True)
class FindDevices:
    """Look which devices are there."""


@dataclass(frozen=True, slots=True)
class ConnectDevice:
    """Use this device."""

    address: str


@dataclass(frozen=True, slots=True)
class DisconnectDevice:
    """Let go of the device."""


@dataclass(frozen=True, slots=True)
class BlinkSensor:
    """Make a sensor of the device blink."""

    name: str


@dataclass(frozen=True, slots=True)
class SetSubject:
    """Whose takes are recorded from now on."""

    code: str


@dataclass(frozen=True, slots=True)
class SetTakeName:
    """What the next takes are called."""

    name: str


@dataclass(frozen=True, slots=True)
class SetHandLength:
    """The wearer's hand length [mm]."""

    mm: float


@dataclass(frozen=True, slots=True)
class ToggleRecording:
    """Start a take, or end the one that is on."""


@dataclass(frozen=True, slots=True)
class OpenTake:
    """Show a take of the library."""

    path: Path


@dataclass(frozen=True, slots=True)
class RecoverTake:
    """Get back what was saved of an interrupted recording."""

    path: Path


@dataclass(frozen=True, slots=True)
class ShowLive:
    """Leave the take, show the hand as it is now."""


@dataclass(frozen=True, slots=True)
class TogglePlay:
    """Play, or pause."""


@dataclass(frozen=True, slots=True)
class Seek:
    """Go to a time of the take [s]; pauses."""

    at_s: float


@dataclass(frozen=True, slots=True)
class Step:
    """Go some instants on or back; pauses."""

    instants: int


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """How fast to play; 1 is as it was."""

    factor: float


@dataclass(frozen=True, slots=True)
class MarkIn:
    """The part of the take that counts begins here."""


@dataclass(frozen=True, slots=True)
class MarkOut:
    """The part of the take that counts ends here."""


@dataclass(frozen=True, slots=True)
class WholeTake:
    """The whole take counts again."""


@dataclass(frozen=True, slots=True)
class SetLoop:
    """Whether playing begins again at the end."""

    on: bool


@dataclass(frozen=True, slots=True)
class Export:
    """Write a CSV into the library and send it to a page."""

    content: Content
    page: int  # which open page asked


@dataclass(frozen=True, slots=True)
class FaceForward:
    """Turn the picture so that the forearm points away from the viewer."""


Move: TypeAlias = TogglePlay | Seek | Step | SetSpeed | MarkIn | MarkOut | WholeTake | SetLoop
"""What moves through the open take."""

Intent: TypeAlias = (
    FindDevices
    | ConnectDevice
    | DisconnectDevice
    | BlinkSensor
    | SetSubject
    | SetTakeName
    | SetHandLength
    | ToggleRecording
    | OpenTake
    | RecoverTake
    | ShowLive
    | TogglePlay
    | Seek
    | Step
    | SetSpeed
    | MarkIn
    | MarkOut
    | WholeTake
    | SetLoop
    | Export
    | FaceForward
)
