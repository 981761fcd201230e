"""Takes of a tumble → what a device's sensors err by: for page, shell and notebooks alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from handstudio import __version__
from handstudio.calibration.agreement import Agreement, agreement_of
from handstudio.calibration.device import DeviceCalibration, Source, corrected
from handstudio.calibration.sensors import calibrate_sensors as computed
from handstudio.calibration.verdict import Verdict
from handstudio.recording.device_calibrations import device_of, tumbled
from handstudio.recording.take import Take


@dataclass(frozen=True, slots=True)
class SensorsFound:
    """Errors of a device's sensors.

    Attributes:
        calibration: What was found.
        verdict: Whether it was done well.
        names: Of the sensors.
        before: What did not agree with gravity as they were shipped.
        after: And with their errors taken off.
    """

    calibration: DeviceCalibration
    verdict: Verdict
    names: tuple[str, ...]
    before: tuple[Agreement, ...]
    after: tuple[Agreement, ...]


def calibrate_sensors(
    takes: Sequence[Take],
    device: str = "",
    progress: Callable[[float], None] = lambda _: None,
) -> SensorsFound:
    """Compute what the sensors of a device err by.

    Args:
        takes: Stretches labelled tumble where there are any, else the whole of each.
        device: Serial number, where the takes do not know it.
        progress: Told the share that is done.

    Raises:
        CalibrationError: it cannot be computed from these takes.
        TakeError: a take cannot be read.
    """
    serial, names = device_of(takes, device)
    samples = tumbled(takes, lambda share: progress(0.3 * share))
    found, verdict = computed(
        samples,
        names,
        device=serial,
        made_utc=datetime.now(UTC).isoformat(timespec="milliseconds"),
        software=f"handstudio {__version__}",
        source=[Source(take.header.name, take.sha256()) for take in takes],
    )
    progress(0.8)
    before, after = (agreement_of(each) for each in (samples, corrected(samples, found, names)))
    progress(1.0)
    return SensorsFound(found, verdict, tuple(names), tuple(before), tuple(after))
