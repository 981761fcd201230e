"""From a tumble to the errors of all sensors, and a verdict on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from handstudio.arrays import Array
from handstudio.calibration.course import TUMBLE
from handstudio.calibration.device import (
    Deviations,
    DeviceCalibration,
    Residuals,
    SensorErrors,
    Source,
    matrix,
    vector,
)
from handstudio.calibration.inertial import Inertial, inertial
from handstudio.calibration.magnetic import Magnetic, magnetic, readings_of
from handstudio.calibration.still import (
    Poses,
    Still,
    poses_of,
    still_intervals,
    turns_of,
    working,
)
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.errors import CalibrationError
from handstudio.samples import STANDARD_GRAVITY, ImuSamples

LEAST_DIRECTIONS = 9
"""Nine numbers of an accelerometer, one length a direction."""

_APART = np.deg2rad(20.0)  # between directions that count as two
_ACC_LIMIT = 0.5  # RMS of the length of gravity [%]: a scale that is half of that off
_GYR_LIMIT_DEG = 0.5  # RMS after a turn: 0.5 % of a quarter turn
_BOARD_LIMIT_DEG = 1.0
_HOPELESS = 4.0  # times a limit: what is found is worth less than what was shipped


def calibrate_sensors(
    samples: ImuSamples,
    names: Sequence[str],
    *,
    device: str = "",
    made_utc: str = "",
    software: str = "",
    source: Sequence[Source] = (),
    gravity: float = STANDARD_GRAVITY,
    field_ut: float | None = None,
    scale_sd: float = 0.03,
) -> tuple[DeviceCalibration, Verdict]:
    """Find the errors of all sensors from a board that lay still in many directions.

    Sensors that answer badly, saw too few directions or do not agree with themselves have no
    entry, and a failing reading with their name. A magnetometer that is missing has no entry
    either; a reading counts those that have one.

    Args:
        samples: The tumble, without gaps; what came before and after may be there.
        names: Of the sensors.
        device: Serial number.
        made_utc: Now, ISO 8601.
        software: Name and version.
        source: Takes that the samples are from.
        gravity: Where it was recorded [m/s²].
        field_ut: Length of the magnetic field there [µT], if known.
        scale_sd: How far scales may be off as shipped.

    Raises:
        CalibrationError: the board rested too seldom, in too few directions, or no sensor answers.
    """
    use = np.flatnonzero(working(samples))
    if not len(use):
        raise CalibrationError(
            "None of the {count} sensors answered through the tumble.",
            "Check the cable, then tumble again.",
            count=len(names),
        )
    part = _only(samples, use)
    stills, poses = _rests(part)
    directions = _directions(poses)
    _refuse_too_few(directions)
    turns = turns_of(part, stills)
    found = inertial(poses, turns, gravity=gravity, scale_sd=scale_sd)
    field = magnetic(readings_of(part, stills, turns, found), field_ut)
    seen = _Seen(
        tuple(names[int(i)] for i in use), directions, poses, found, field, _good(found, directions)
    )
    calibration = DeviceCalibration(
        device=device,
        made_utc=made_utc,
        software=software,
        source=tuple(source),
        sensors=tuple(_entry(seen, int(i)) for i in np.flatnonzero(seen.good)),
        field_ut=field.field_ut if (field.known & seen.good).any() else None,
    )
    seconds = float(samples.time_us[-1] - samples.time_us[0]) * 1e-6
    return calibration, _verdict(seen, names, seconds, gravity)


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """What was found of the sensors that answered."""

    names: tuple[str, ...]
    directions: Array
    poses: Poses
    found: Inertial
    field: Magnetic
    good: Bool[Array, " s"]


def _only(samples: ImuSamples, use: Array) -> ImuSamples:
    signals = (getattr(samples, name)[:, use] for name in ImuSamples.__slots__[1:])
    return ImuSamples(samples.time_us, *signals)


def _rests(samples: ImuSamples) -> tuple[tuple[Still, ...], Poses]:
    """Rests in which most sensors did not creep: the board was not moved.

    Raises:
        CalibrationError: there are too few.
    """
    all_of_them = still_intervals(samples)
    poses = poses_of(samples, all_of_them)
    held = poses.usable.mean(axis=0) > 0.5
    stills = tuple(still for still, ok in zip(all_of_them, held, strict=True) if ok)
    if len(stills) < LEAST_DIRECTIONS:
        raise CalibrationError(
            "The board lay still {count} times, at least {least} are needed; in {moved} more it "
            "moved.",
            "Lay it down in another direction each time, take the hand off and wait two seconds.",
            count=len(stills),
            least=LEAST_DIRECTIONS,
            moved=len(all_of_them) - len(stills),
        )
    return stills, poses_of(samples, stills)


def _directions(poses: Poses) -> Array:
    """How many directions every sensor lay still in, (s,)."""
    counts = []
    for acc, usable in zip(poses.acc, poses.usable, strict=True):
        kept: list[Array] = []
        for up in acc[usable] / np.linalg.norm(acc[usable], axis=-1, keepdims=True):
            if all(float(up @ other) < np.cos(_APART) for other in kept):
                kept.append(up)
        counts.append(len(kept))
    return np.array(counts)


def _refuse_too_few(directions: Array) -> None:
    if (most := int(directions.max())) < LEAST_DIRECTIONS:
        raise CalibrationError(
            "The board lay still in {count} directions, at least {least} are needed.",
            "Lay it on every side and on every edge, also tilted, and tumble again.",
            count=most,
            least=LEAST_DIRECTIONS,
        )


def _good(found: Inertial, directions: Array) -> Bool[Array, " s"]:
    acc, gyr = _residuals(found)
    return np.asarray(
        (directions >= LEAST_DIRECTIONS)
        & (acc <= _HOPELESS * _ACC_LIMIT)
        & (gyr <= _HOPELESS * _GYR_LIMIT_DEG)
    )


def _residuals(found: Inertial, gravity: float = STANDARD_GRAVITY) -> tuple[Array, Array]:
    """Of accelerometers [%] and gyroscopes [deg]."""
    return 100.0 * found.acc_residual / gravity, np.rad2deg(found.gyr_residual)


def _entry(seen: _Seen, i: int) -> SensorErrors:
    found, field = seen.found, seen.field
    has_field = bool(field.known[i])
    return SensorErrors(
        name=seen.names[i],
        acc_matrix=matrix(found.acc_matrix[i]),
        acc_bias=vector(found.acc_bias[i]),
        gyr_matrix=matrix(found.gyr_matrix[i]),
        gyr_bias=vector(found.gyr_bias[i]),
        gyr_per_acc=matrix(found.gyr_per_acc[i]),
        mag_matrix=matrix(field.matrix[i]) if has_field else None,
        mag_bias=vector(field.bias[i]) if has_field else None,
        residuals=Residuals(
            acc=float(found.acc_residual[i]),
            gyr=float(found.gyr_residual[i]),
            mag=float(field.residual[i]) if np.isfinite(field.residual[i]) else None,
        ),
        poses=int(seen.poses.usable[i].sum()),
        sds=Deviations(
            acc_scale=vector(found.acc_scale_sd[i]),
            acc_bias=vector(found.acc_bias_sd[i]),
            gyr_scale=vector(found.gyr_scale_sd[i]),
            gyr_bias=vector(found.gyr_bias_sd[i]),
            mag_scale=vector(field.scale_sd[i]) if has_field else None,
            mag_bias=vector(field.bias_sd[i]) if has_field else None,
        ),
    )


def _verdict(seen: _Seen, names: Sequence[str], seconds: float, gravity: float) -> Verdict:
    kept = int(seen.good.sum())
    fields = int((seen.field.known & seen.good).sum())
    readings = [
        Reading("directions", float(seen.directions.max()), LEAST_DIRECTIONS, ""),
        Reading("time", seconds, TUMBLE.least_s, "s"),
        Reading("answering", float(kept), float(len(names)), ""),
        # no magnetometer at all is another kind of device; some are missing is a fault
        Reading("answering", float(fields), float(kept if fields else 0), "", about="magnetometer"),
    ]
    if len(seen.names) > 2:
        stiff = float(np.rad2deg(seen.found.board_sd))
        readings.append(Reading("together", stiff, _BOARD_LIMIT_DEG, "deg", at_least=False))
    acc, gyr = (
        dict(zip(seen.names, each.tolist(), strict=True))
        for each in _residuals(seen.found, gravity)
    )
    counts = dict(zip(seen.names, seen.directions.tolist(), strict=True))
    for name in names:
        if counts.get(name, 0) < LEAST_DIRECTIONS:
            readings.append(
                Reading("directions", float(counts.get(name, 0)), LEAST_DIRECTIONS, "", about=name)
            )
            continue
        readings.append(Reading("residual", acc[name], _ACC_LIMIT, "%", False, name))
        readings.append(Reading("residual", gyr[name], _GYR_LIMIT_DEG, "deg", False, name))
    return Verdict(TUMBLE.name, tuple(readings))
