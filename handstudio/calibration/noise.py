"""Noise of sensors at rest: what static recordings must be, and what each sensor's axes show."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.allan import AxisNoise, Plan, axis_noise, plan_of
from handstudio.errors import CalibrationError

LEAST_S = 120.0
"""Shorter recordings are refused; a walk takes half an hour to be distinct."""

MISSING = 0.01
"""Share of instants that may be missing; they are closed up, which neither line notices."""

_REST = "Record the glove lying still: two minutes show its noise, half an hour also the walk."
_BLOCK_S = 0.5
# A warming sensor drifts by 0.6 deg/s and 0.04 m/s²; a hand that is not laid down does more. Means
# of blocks, off the median of all [rad/s], [m/s²]; scatter within one, of what is usual.
_LIMITS = (math.radians(1.0), 0.2, 3.0)


@dataclass(frozen=True, slots=True, eq=False)
class StaticRecording:
    """A recording in which nothing moves; NaN where a sensor did not answer."""

    time_s: Float[Array, " n"]
    gyr: Float[Array, "n s 3"]  # [rad/s]
    acc: Float[Array, "n s 3"]  # [m/s²]
    rate_hz: float


class SensorNoise(msgspec.Struct, frozen=True):
    """Noise of a sensor, axes x y z."""

    sensor: str
    gyr: tuple[AxisNoise, AxisNoise, AxisNoise]
    acc: tuple[AxisNoise, AxisNoise, AxisNoise]


class Noise(msgspec.Struct, frozen=True):
    """What static recordings tell of their sensors.

    Attributes:
        sensors: In the order given.
        left_out: Names of those that were silent too often, or read nothing but one number.
        rate_hz: Sampling rate.
        durations_s: Of the recordings.
    """

    sensors: tuple[SensorNoise, ...]
    left_out: tuple[str, ...]
    rate_hz: float
    durations_s: tuple[float, ...]


def noise_of(
    recordings: Sequence[StaticRecording],
    sensors: Sequence[str],
    progress: Callable[[float], None] = lambda _: None,
) -> Noise:
    """Characterise sensors from static recordings; several count as one long one.

    Args:
        recordings: Of the same sensors at the same rate.
        sensors: Their names.
        progress: Told the share that is done.

    Raises:
        CalibrationError: a recording is too short, has gaps or does not fit the others, a sensor
            moved, or none was left to look at.
    """
    _refuse_unfit(recordings, sensors)
    lengths = tuple(len(each.time_s) for each in recordings)
    plan = plan_of(lengths, recordings[0].rate_hz)
    found, left_out = list[SensorNoise](), list[str]()
    for index, name in enumerate(sensors):
        one = _sensor(recordings, index, name, plan)
        if one is None:
            left_out.append(name)
        else:
            found.append(one)
        progress((index + 1) / len(sensors))
    if not found:
        raise CalibrationError(
            "None of {count} sensors gave readings with noise in them.",
            "Check that they answer and that the recording is of real sensors.",
            count=len(sensors),
        )
    return Noise(
        tuple(found),
        tuple(left_out),
        recordings[0].rate_hz,
        tuple(length / recordings[0].rate_hz for length in lengths),
    )


def _sensor(
    recordings: Sequence[StaticRecording], index: int, name: str, plan: Plan
) -> SensorNoise | None:
    there = []
    for each in recordings:
        both = np.concatenate([each.gyr[:, index], each.acc[:, index]], axis=-1, dtype=float)
        kept = both[np.isfinite(both).all(axis=-1)]
        if len(kept) < (1.0 - MISSING) * len(both) or not np.ptp(kept, axis=0).all():
            return None
        _refuse_motion(kept, each.rate_hz, name)
        there.append(kept)
    axes = [axis_noise([each[:, axis] for each in there], plan) for axis in range(6)]
    return SensorNoise(name, (axes[0], axes[1], axes[2]), (axes[3], axes[4], axes[5]))


def _refuse_unfit(recordings: Sequence[StaticRecording], sensors: Sequence[str]) -> None:
    if not recordings:
        raise CalibrationError("There is no recording at rest.", _REST)
    rate_hz = recordings[0].rate_hz
    for each in recordings:
        count, seconds = each.gyr.shape[1], len(each.time_s) / each.rate_hz
        if each.rate_hz != rate_hz or count != len(sensors):
            raise CalibrationError(
                "A recording of {count} sensors at {rate:g} Hz is among those of {sensors} sensors "
                "at {first:g} Hz.",
                "Characterise each glove, at each rate, by itself.",
                count=count,
                rate=each.rate_hz,
                sensors=len(sensors),
                first=rate_hz,
            )
        if not seconds >= LEAST_S:
            raise CalibrationError(
                "A recording at rest is {seconds:.0f} s long, at least {least:.0f} s are needed.",
                _REST,
                seconds=seconds,
                least=LEAST_S,
            )
        made = float(each.time_s[-1] - each.time_s[0]) * rate_hz + 1.0
        if not abs(len(each.time_s) - made) <= MISSING * made:
            raise CalibrationError(
                "A recording has {count} instants where {rate:g} Hz make {made:.0f}; {limit:.0f} % "
                "may be missing.",
                "Give the rate it was recorded at; what lies before and after a long gap is two "
                "recordings.",
                count=len(each.time_s),
                rate=rate_hz,
                made=made,
                limit=100.0 * MISSING,
            )


def _refuse_motion(read: Float[Array, "n 6"], rate_hz: float, sensor: str) -> None:
    size = max(8, round(_BLOCK_S * rate_hz))
    blocks = read[: len(read) // size * size].reshape(-1, size, 6)
    means, spreads = blocks.mean(axis=1), blocks.var(axis=1)
    off = np.abs(means - np.median(means, axis=0)).reshape(-1, 2, 3).max(axis=-1)
    usual = np.maximum(np.median(spreads, axis=0), 0.1 * spreads.mean(axis=0))
    shaken = (spreads / usual).reshape(-1, 2, 3).mean(axis=-1).max(axis=-1)
    seen = np.column_stack([off, np.sqrt(shaken)])
    worst = int(np.argmax((seen / _LIMITS).max(axis=-1)))
    if (seen[worst] > _LIMITS).any():
        raise CalibrationError(
            "{sensor} did not rest {at:.0f} s after the start: turned by {turn:.1f} deg/s (limit "
            "{turns:.1f}), tilted or pushed by {push:.2f} m/s² (limit {pushes:.2f}), shaken to "
            "{shake:.1f} times its usual noise (limit {shakes:.1f}).",
            "Lay the glove where nobody touches it, or label the part in which it lies still.",
            sensor=sensor,
            at=worst * size / rate_hz,
            turn=float(np.rad2deg(seen[worst, 0])),
            turns=float(np.rad2deg(_LIMITS[0])),
            push=float(seen[worst, 1]),
            pushes=_LIMITS[1],
            shake=float(seen[worst, 2]),
            shakes=_LIMITS[2],
        )
