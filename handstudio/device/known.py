"""What is known of wearer and glove, and chosen, beside what the device says of itself."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.subject import SubjectCalibration
from handstudio.errors import CalibrationError
from handstudio.layout import divisible, glove
from handstudio.setup import AnyFilter, Setup, calibrated


@dataclass(frozen=True, slots=True)
class Known:
    """Calibrations, headings and the filter that the next setup is to have.

    Attributes:
        subject: Of the wearer; None: mean proportions.
        sensors: Of a device's sensors; None: as they were shipped.
        heading_rad: One a sensor; empty: as the sensors say.
        filter: The one that was chosen; None: the setup's own.
    """

    subject: SubjectCalibration | None = None
    sensors: DeviceCalibration | None = None
    heading_rad: tuple[float, ...] = ()
    filter: AnyFilter | None = None

    def on(self, setup: Setup) -> tuple[Setup, CalibrationError | None]:
        """A setup with all of it that fits, and why the wearer's calibration is not in it.

        Sensors of another device and headings of other sensors are left out, nothing is amiss.
        """
        serial = setup.device.serial_number if setup.device is not None else ""
        mine = self.sensors is not None and self.sensors.device == serial
        sensors = self.sensors if mine else None
        fits = len(self.heading_rad) == len(setup.layout.sensors)
        layout = setup.layout
        if self.subject is None and divisible(layout):  # as it comes, whoever wore it before
            layout = glove(layout.side, layout.names)
        setup = msgspec.structs.replace(
            setup,
            layout=layout,
            heading_rad=self.heading_rad if fits else (),
            filter=setup.filter if self.filter is None else self.filter,
        )
        try:
            return calibrated(setup, subject=self.subject, sensors=sensors), None
        except CalibrationError as error:
            return calibrated(setup, sensors=sensors), error
