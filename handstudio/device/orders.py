"""What the capture thread is asked for, and what it tells: values that go between threads."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TypeAlias

from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.subject import SubjectCalibration
from handstudio.device.health import HealthView
from handstudio.device.recorder import Recorder
from handstudio.errors import HandstudioError
from handstudio.health.findings import Finding
from handstudio.pipeline import Motion
from handstudio.protocol.packets import Description, Reply
from handstudio.recording.tracker_message import TrackerFacts
from handstudio.samples import ImuSamples
from handstudio.setup import AnyFilter, HandModel, Setup


class Phase(Enum):
    """Where the line to a device stands."""

    IDLE = "idle"  # nobody asked for a device
    CONNECTING = "connecting"
    STREAMING = "streaming"
    LOST = "lost"  # it was there; looked for until it is back
    FAILED = "failed"  # it cannot be had; `problem` says why


@dataclass(frozen=True, slots=True)
class Connect:
    """Use this device from now on."""

    address: str
    hand: HandModel = HandModel()
    side: str = "right"  # for devices that do not know which hand they sit on
    decoder: str = "handstudio-1"


@dataclass(frozen=True, slots=True)
class Disconnect:
    """Let go of the device; a take that is being recorded ends."""


@dataclass(frozen=True, slots=True)
class SetHand:
    """Another wearer: the hand model of the next take."""

    hand: HandModel


@dataclass(frozen=True, slots=True)
class SetSubject:
    """The wearer's calibration, from now on; None: mean proportions.

    While a take is recorded it waits for its end, as `SetSensors` does.
    """

    calibration: SubjectCalibration | None


@dataclass(frozen=True, slots=True)
class SetSensors:
    """The errors of a device's sensors, from now on; None: as they were shipped."""

    errors: DeviceCalibration | None


@dataclass(frozen=True, slots=True)
class SetFilter:
    """The filter, from now on; every sensor waits for its rest anew.

    While a take is recorded it waits for its end, as `SetSubject` does.
    """

    filter: AnyFilter


@dataclass(frozen=True, slots=True)
class SetTracker:
    """The tracker whose poses go into takes that begin from now on; None: none.

    A take that is on keeps the one that it began with.
    """

    facts: TrackerFacts | None


@dataclass(frozen=True, slots=True)
class StartTake:
    """Record from now on."""

    path: Path
    subject: str


@dataclass(frozen=True, slots=True)
class StopTake:
    """End the take."""


@dataclass(frozen=True, slots=True)
class Ask:
    """Send a command to the device."""

    command: int
    argument: bytes = b""


@dataclass(frozen=True, slots=True)
class NotePage:
    """The slowest page answered what it was sent after so long [ms]; kept with the take."""

    ms: float


@dataclass(frozen=True, slots=True)
class ShareSamples:
    """Whether somebody wants the samples as they come, see `Capture.drain_samples`."""

    on: bool


@dataclass(frozen=True, slots=True)
class ShareMoves:
    """Whether somebody follows the hand in a room, see `Capture.drain_moves`."""

    on: bool


@dataclass(frozen=True, slots=True)
class ResetHeading:
    """Take the heading anew, the hand lying flat now; of one sensor or, with None, of all."""

    sensor: str | None


@dataclass(frozen=True, slots=True)
class SetHeading:
    """Turn every sensor's orientation about the vertical by so much [rad]; empty: not at all."""

    headings: tuple[float, ...]


Order: TypeAlias = (
    Connect
    | Disconnect
    | SetHand
    | SetSubject
    | SetSensors
    | SetFilter
    | SetTracker
    | StartTake
    | StopTake
    | Ask
    | NotePage
    | ShareSamples
    | ShareMoves
    | ResetHeading
    | SetHeading
)


@dataclass(frozen=True, slots=True)
class Newest:
    """Everything the capture thread knows, at one moment."""

    phase: Phase = Phase.IDLE
    address: str = ""
    description: Description | None = None
    setup: Setup | None = None
    motion: Motion | None = None  # one instant
    health: HealthView = HealthView()
    findings: tuple[Finding, ...] = ()  # what is wrong now, the worse first
    problem: HandstudioError | None = None
    recorder: Recorder | None = None
    last_reply: Reply | None = None

    @property
    def ready(self) -> bool:
        """Whether a take can begin: the device is known and there."""
        return self.setup is not None and self.phase in (Phase.CONNECTING, Phase.STREAMING)


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """What one chunk told: instants, and the readings that they were fused from.

    Attributes:
        arrival_ns: When it came, on the host's clock.
        setup: What it was fused by.
        motion: Its instants.
        runs: Its readings, an instant of the motion each, as they were read.
    """

    arrival_ns: int
    setup: Setup
    motion: Motion
    runs: tuple[ImuSamples, ...]


@dataclass(frozen=True, slots=True)
class TakeDone:
    """A take is whole."""

    path: Path


@dataclass(frozen=True, slots=True)
class HeadingTaken:
    """The heading was taken anew; of one sensor or, with None, of all."""

    sensor: str | None


Report: TypeAlias = TakeDone | HeadingTaken | HandstudioError
"""What the capture thread tells once: something that is done, or that went wrong."""
