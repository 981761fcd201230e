"""What the sensors of a device err by, as found once and kept; and readings freed of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias

import msgspec
import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import CalibrationError
from handstudio.samples import ImuSamples

FORMAT = 1
"""Of the text; a newer one is refused."""

Vector: TypeAlias = tuple[float, float, float]
Matrix: TypeAlias = tuple[Vector, Vector, Vector]

UNITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NOTHING: Matrix = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class Residuals(msgspec.Struct, frozen=True):
    """What is left after correction, RMS.

    Attributes:
        acc: Of the length of gravity over the poses [m/s²].
        gyr: Angle between gravity turned by the gyroscope and gravity felt, over the turns [rad].
        mag: Of the length of the field over the poses, as a share of it; None without one.
    """

    acc: float
    gyr: float
    mag: float | None = None


class Deviations(msgspec.Struct, frozen=True):
    """Standard deviations of what was found, as the fit itself has them.

    Attributes:
        acc_scale, gyr_scale: Of the diagonals.
        acc_bias: [m/s²].
        gyr_bias: [rad/s].
        mag_scale, mag_bias: Of the magnetometer's diagonal, and [µT]; None without one.
    """

    acc_scale: Vector
    acc_bias: Vector
    gyr_scale: Vector
    gyr_bias: Vector
    mag_scale: Vector | None = None
    mag_bias: Vector | None = None


class SensorErrors(msgspec.Struct, frozen=True):
    """Errors of one sensor; ``corrected = matrix (reading - bias)``.

    All three are corrected into one frame, that of the accelerometer: the axes by which its own
    matrix is symmetric.

    Attributes:
        name: Of the sensor in the layout.
        acc_matrix, acc_bias: Of the accelerometer; [m/s²].
        gyr_matrix, gyr_bias: Of the gyroscope; [rad/s].
        gyr_per_acc: What the gyroscope reads of the corrected specific force [rad/s per m/s²]; it
            is taken off with the bias.
        mag_matrix, mag_bias: Of the magnetometer; [µT]. None: it has not been calibrated.
        residuals: What is left.
        poses: In how many still poses it was seen.
        sds: How sure all that is, where it is known.
    """

    name: str
    acc_matrix: Matrix
    acc_bias: Vector
    gyr_matrix: Matrix
    gyr_bias: Vector
    residuals: Residuals
    poses: int
    gyr_per_acc: Matrix = NOTHING
    mag_matrix: Matrix | None = None
    mag_bias: Vector | None = None
    sds: Deviations | None = None


class Source(msgspec.Struct, frozen=True):
    """A take that a calibration was computed from.

    Attributes:
        take: Its name.
        sha256: Of the file, in hexadecimal digits.
    """

    take: str
    sha256: str


class DeviceCalibration(msgspec.Struct, frozen=True):
    """Errors of a device's sensors.

    Attributes:
        device: Its serial number.
        made_utc: When, ISO 8601.
        software: What computed it.
        source: What from.
        sensors: One entry for every sensor that could be calibrated.
        field_ut: Length of the field that magnetometers are corrected to; None: there is none.
        format: Of this text.
    """

    device: str
    made_utc: str
    software: str
    source: tuple[Source, ...]
    sensors: tuple[SensorErrors, ...]
    field_ut: float | None = None
    format: int = FORMAT

    @property
    def by_name(self) -> dict[str, SensorErrors]:
        """Errors by the sensor's name."""
        return {sensor.name: sensor for sensor in self.sensors}


def corrected(
    samples: ImuSamples, calibration: DeviceCalibration, names: Sequence[str]
) -> ImuSamples:
    """Readings freed of the sensors' errors; cutting the samples anywhere changes no digit.

    Args:
        samples: As read.
        calibration: Of the device.
        names: Of the sensors of the samples, in order. Those without an entry stay as they are,
            and so do magnetometers that have none.
    """
    errors = _stacked(calibration, tuple(names))
    if not errors.at:
        return samples
    acc = _times(errors.acc[0], samples.acc[:, errors.at] - errors.acc[1])
    felt = samples.gyr[:, errors.at] - _times(errors.gyr_per_acc, acc)
    gyr = _times(errors.gyr[0], felt - errors.gyr[1])
    result = replace(
        samples,
        acc=_put(samples.acc, errors.at, acc),
        gyr=_put(samples.gyr, errors.at, gyr),
    )
    if not errors.mag_at:
        return result
    mag = _times(errors.mag[0], samples.mag[:, errors.mag_at] - errors.mag[1])
    return replace(result, mag=_put(samples.mag, errors.mag_at, mag))


def encode(calibration: DeviceCalibration) -> str:
    """Text that people can read, in JSON."""
    return msgspec.json.format(msgspec.json.encode(calibration), indent=2).decode() + "\n"


def decode(text: str | bytes) -> DeviceCalibration:
    """Understand a text of `encode`.

    Raises:
        CalibrationError: it is none, or of a newer version of the software.
    """
    try:
        version = msgspec.json.decode(text, type=_Version)
        if version.format > FORMAT:
            raise CalibrationError(
                "The calibration has format {format}, and this version knows {known} at most.",
                "Update the software, or calibrate the sensors again.",
                format=version.format,
                known=FORMAT,
            )
        calibration = msgspec.json.decode(text, type=DeviceCalibration)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise CalibrationError(
            "This is no calibration of sensors: {reason}.",
            "Choose a file that was saved as one, or calibrate the sensors again.",
            reason=str(error),
        ) from error
    if len(calibration.by_name) < len(calibration.sensors):
        raise CalibrationError(
            "The calibration names one of its {count} sensors twice.",
            "Choose another file, or calibrate the sensors again.",
            count=len(calibration.sensors),
        )
    return calibration


def vector(values: Float[Array, " 3"]) -> Vector:
    """Plain numbers of an array."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def matrix(values: Float[Array, "3 3"]) -> Matrix:
    """Plain numbers of an array, row by row."""
    x, y, z = (vector(row) for row in values)
    return x, y, z


class _Version(msgspec.Struct):
    format: int


@dataclass(frozen=True, slots=True, eq=False)
class _Stacked:
    """Matrices and biases of the sensors that are known, and which those are."""

    at: list[int]
    acc: tuple[Array, Array]
    gyr: tuple[Array, Array]
    gyr_per_acc: Array
    mag_at: list[int]
    mag: tuple[Array, Array]


@lru_cache(maxsize=4)  # asked for with every chunk of a stream
def _stacked(calibration: DeviceCalibration, names: tuple[str, ...]) -> _Stacked:
    by_name = calibration.by_name
    known = [(i, by_name[name]) for i, name in enumerate(names) if name in by_name]
    entries = [entry for _, entry in known]
    magnetic = [(i, e.mag_matrix, e.mag_bias) for i, e in known if e.mag_matrix and e.mag_bias]
    return _Stacked(
        at=[i for i, _ in known],
        acc=(np.array([e.acc_matrix for e in entries]), np.array([e.acc_bias for e in entries])),
        gyr=(np.array([e.gyr_matrix for e in entries]), np.array([e.gyr_bias for e in entries])),
        gyr_per_acc=np.array([e.gyr_per_acc for e in entries]),
        mag_at=[i for i, _, _ in magnetic],
        mag=(np.array([m for _, m, _ in magnetic]), np.array([b for _, _, b in magnetic])),
    )


def _times(matrices: Array, vectors: Array) -> Array:
    # not ``@``: its digits depend on how many instants there are
    x, y, z = (vectors[..., i] for i in range(3))
    rows = (m[:, 0] * x + m[:, 1] * y + m[:, 2] * z for m in np.moveaxis(matrices, 1, 0))
    return np.stack(list(rows), axis=-1)


def _put(all_of_them: Array, at: list[int], those: Array) -> Array:
    result = all_of_them.copy()
    result[:, at] = those
    return result
