"""What is computed of a course that is over, in the job's process: by the course's name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from handstudio.calibrate import Calibrated, calibrate
from handstudio.calibrate_sensors import SensorsFound, calibrate_sensors
from handstudio.calibration.heading import HeadingAlignment
from handstudio.calibration.noise import Noise, noise_of
from handstudio.check import Checked, check
from handstudio.errors import CalibrationError
from handstudio.hand.skeleton import HandType
from handstudio.process import aligned_setup
from handstudio.recording.at_rest import static_recordings
from handstudio.recording.calibrations import save_calibration
from handstudio.recording.device_calibrations import save_device_calibration
from handstudio.recording.take import Take

SOLVED = ("hand", "check", "quick_start", "sensors", "noise")
"""Courses of which something is computed."""

Tell: TypeAlias = Callable[[float], None]


Answer: TypeAlias = Calibrated | Checked | HeadingAlignment | SensorsFound | Noise
"""What came of a course."""


def solve(
    name: str, takes: Sequence[Take], sessions: Path, hand_type: HandType | None, tell: Tell
) -> Answer:
    """Compute what a course is for, and keep what is to be used from now on.

    A hand's palm is divided as the takes' layout has it unless ``hand_type`` says otherwise.

    Raises:
        CalibrationError: it cannot be computed from these takes, or not be kept.
        TakeError: a take cannot be read.
    """
    match name:
        case "hand":
            calibrated = calibrate(takes, tell, hand_type)
            save_calibration(sessions, calibrated.calibration)
            return calibrated
        case "check":
            return check(takes)
        case "quick_start":
            return aligned_setup(takes[-1])[1]
        case "sensors":
            return _sensors(takes, sessions, tell)
        case "noise":
            return _noise(takes, tell)
    raise CalibrationError("Nothing is computed of {name}.", "Choose another course.", name=name)


def _sensors(takes: Sequence[Take], sessions: Path, tell: Tell) -> SensorsFound:
    found = calibrate_sensors(takes, progress=tell)
    if found.verdict.ok:
        save_device_calibration(sessions, found.calibration)
    return found


def _noise(takes: Sequence[Take], tell: Tell) -> Noise:
    recordings = [one for take in takes for one in static_recordings(take)]
    tell(0.4)
    names = takes[0].header.setup.layout.names
    return noise_of(recordings, names, lambda share: tell(0.4 + 0.6 * share))
