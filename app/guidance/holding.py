"""Which calibrations are in use: those of the wearer and of the device, loaded and passed on."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from app.shown.guided import InUse
from app.state import State
from handstudio.calibration.subject import SubjectCalibration
from handstudio.device.capture import Capture
from handstudio.device.orders import SetSensors, SetSubject
from handstudio.errors import CalibrationError, HandstudioError
from handstudio.hand.skeleton import HandSide
from handstudio.recording.calibrations import (
    Loaded,
    LoadedSubject,
    history,
    load_calibration,
    restore,
)
from handstudio.recording.device_calibrations import LoadedDevice, load_device_calibration


@dataclass
class Holder:
    """Owner of what is in use; the capture is told of every change."""

    capture: Capture
    sessions: Path
    in_use: InUse = InUse()
    _of: tuple[str, HandSide | None, str] = ("", None, "")
    _none: bool = False  # somebody wants none
    _told: list[HandstudioError] = field(default_factory=list)

    def follow(self, state: State) -> list[HandstudioError]:
        """Load what belongs to whoever and whatever is there now; what is amiss."""
        of = _of(state)
        if of != self._of:
            self._of, self._none = of, False
            self.load()
        told, self._told = self._told, []
        return told

    def load(self) -> None:
        """Read the files again, and use what they hold."""
        (code, side, serial), before = self._of, self.in_use
        subject: LoadedSubject = Loaded(None)
        sensors: LoadedDevice = Loaded(None)
        older: tuple[str, ...] = ()
        if code and side is not None:
            try:
                subject = load_calibration(self.sessions, code, side)
                older = self._older(code, side, subject.calibration)
            except HandstudioError as error:
                self._told.append(error)
        if serial:
            try:
                sensors = load_device_calibration(self.sessions, serial)
            except HandstudioError as error:
                self._told.append(error)
        self._told += [one.problem for one in (subject, sensors) if one.problem is not None]
        used = None if self._none else subject.calibration
        self.in_use = InUse(used, sensors.calibration, older, self._none, _now())
        if self.in_use.subject != before.subject:
            self.capture.send(SetSubject(self.in_use.subject))
        if self.in_use.sensors != before.sensors:
            self.capture.send(SetSensors(self.in_use.sensors))

    def use(self, which: str) -> None:
        """Use none, the one in the file again, or the one before it.

        Raises:
            CalibrationError: there is none before, or it cannot be read.
        """
        self._none = which == "none"
        if which == "previous":
            if not self.in_use.older:
                raise CalibrationError(
                    "There is no calibration before this one.", "Calibrate again."
                )
            restore(self.sessions, self._of[0], self.in_use.older[0])
        self.load()

    def solved(self) -> None:
        """Something new was kept: it is wanted."""
        self._none = False
        self.load()

    def _older(self, code: str, side: HandSide, used: SubjectCalibration | None) -> tuple[str, ...]:
        """Ids of those made before the one in use, newest first."""
        good = [v for v in history(self.sessions, code, side) if v.calibration is not None]
        if used is None:
            return tuple(version.id for version in good)
        return tuple(
            version.id
            for version in good
            if version.calibration is not None and version.calibration.made_utc < used.made_utc
        )


def _of(state: State) -> tuple[str, HandSide | None, str]:
    """Whose hand, which one, and which device."""
    subject, setup = state.subject, state.newest.setup
    code = subject.code if subject is not None else ""
    told = setup.layout.side if setup is not None else ""
    if told not in ("left", "right"):
        told = (subject.side if subject is not None else "") or state.settings.side
    side: HandSide = "left" if told == "left" else "right"
    device = setup.device if setup is not None else None
    return code, side, device.serial_number if device is not None else ""


def _now() -> datetime:
    return datetime.now(UTC)
