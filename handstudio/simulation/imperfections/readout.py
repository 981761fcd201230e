"""What a real sensor makes of what it feels: noise, bias, stale readings, limits, counts.

Every random number has its place, given by the seed and the index of the instant, so a stream
reads the same however it is cut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int16

from handstudio.arrays import Array
from handstudio.samples import FULL_SCALE, STANDARD_GRAVITY, ImuSamples, Ranges


@dataclass(frozen=True, slots=True)
class SensorKind:
    """The kind of sensor. Densities are one-sided; rms are over sensors and axes.

    Attributes:
        ranges: What a count of 32768 stands for [m/s², rad/s, µT].
        gyr_density: White noise [rad/s/sqrt(Hz)].
        acc_density: White noise [m/s²/sqrt(Hz)].
        mag_noise_ut: Of one reading [µT].
        mag_rate_hz: How often the magnetometer reads anew.
        gyr_bias_rms: [rad/s].
        acc_bias_rms: [m/s²].
    """

    ranges: Ranges
    gyr_density: float
    acc_density: float
    mag_noise_ut: float
    mag_rate_hz: int
    gyr_bias_rms: float
    acc_bias_rms: float


MPU9250 = SensorKind(
    ranges=Ranges(acc=8.0 * STANDARD_GRAVITY, gyr=float(np.deg2rad(2000.0)), mag=4912.0),
    # measured on 12 units of this kind at rest; the thesis's table 4.1 has 20 more: gyroscope
    # 6.2e-3 to 6.9e-3 deg/sqrt(s), a quarter above this, accelerometer less than half of this
    gyr_density=float(np.deg2rad(0.0071)),
    acc_density=355e-6 * STANDARD_GRAVITY,
    gyr_bias_rms=float(np.deg2rad(1.18)),
    # not measured there: ours, after one calibration by hand, inside the data sheet's 60 mg
    acc_bias_rms=0.010 * STANDARD_GRAVITY,
    # the AK8963 inside: its step at 16 bit is 0.15 µT, the noise of four steps is ours
    mag_noise_ut=0.6,
    mag_rate_hz=100,
)
"""The glove's sensor. Sources: static recordings of 12 real MPU-9250 (gyroscope, accelerometer
noise, gyroscope bias), InvenSense PS-MPU-9250A-01 (ranges, rates)."""


@dataclass(frozen=True, slots=True, eq=False)
class Biases:
    """Constant errors of every sensor: [rad/s] and [m/s²]."""

    gyr: Float[Array, "s 3"]
    acc: Float[Array, "s 3"]


@dataclass(frozen=True, slots=True, eq=False)
class ReadoutState:
    """Where a stream stands: instants read so far, and the magnetometer's last reading."""

    index: int
    mag_reading: int  # number of the last reading since time 0; -1 before the first
    mag_counts: Int16[Array, "s 3"]


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Counts as a device sends them: accelerometer, gyroscope, magnetometer; x y z each."""

    counts: Int16[Array, "n s 9"]
    fresh: Bool[Array, "n s"]  # the magnetometer reading is new


def draw_biases(kind: SensorKind, sensors: int, seed: int) -> Biases:
    """The constant errors of a set of sensors; a seed is one set."""
    normal = _generator(seed, _BIASES).standard_normal((sensors, 6))
    return Biases(gyr=kind.gyr_bias_rms * normal[:, :3], acc=kind.acc_bias_rms * normal[:, 3:])


def switched_on(sensors: int) -> ReadoutState:
    """The state before the first instant."""
    return ReadoutState(0, -1, np.zeros((sensors, 3), dtype=np.int16))


def read(
    kind: SensorKind,
    seed: int,
    rate_hz: int,
    state: ReadoutState,
    exact: ImuSamples,
) -> tuple[Readings, ReadoutState]:
    """Read consecutive instants, at least one, that follow those already read.

    White noise is limited to half the sampling rate, as a chip's own filter would:
    ``sigma = density sqrt(rate/2)``. The magnetometer reads anew at its own rate; in between its
    last reading, noise and all, is repeated. One call or many gives the same counts.
    """
    n, sensors = exact.gyr.shape[:2]
    noise = _white(seed, state.index, n, sensors)
    biases = draw_biases(kind, sensors, seed)
    band = np.sqrt(0.5 * rate_hz)
    acc = exact.acc + biases.acc + kind.acc_density * band * noise[..., 0:3]
    gyr = exact.gyr + biases.gyr + kind.gyr_density * band * noise[..., 3:6]
    mag = _counts(exact.mag + kind.mag_noise_ut * noise[..., 6:9], kind.ranges.mag)
    reading = exact.time_us * kind.mag_rate_hz // 1_000_000
    new = np.diff(reading, prepend=state.mag_reading) != 0
    mag = _held(mag, new, state.mag_counts)
    counts = np.concatenate(
        [_counts(acc, kind.ranges.acc), _counts(gyr, kind.ranges.gyr), mag], axis=-1
    )
    fresh = np.repeat(new[:, None], sensors, axis=1)
    return Readings(counts, fresh), ReadoutState(state.index + n, int(reading[-1]), mag[-1])


_BIASES, _WHITE = 0, 1  # which of a seed's streams
_BLOCK = 64  # instants whose noise is drawn together; changing it changes every stream


def _generator(seed: int, *stream: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=stream))


def _white(seed: int, first: int, n: int, sensors: int) -> Array:
    """Standard normals of the instants from ``first`` on, (n, sensors, 9)."""
    start, stop = first // _BLOCK, -(-(first + n) // _BLOCK)
    blocks = [
        _generator(seed, _WHITE, block).standard_normal((_BLOCK, sensors, 9))
        for block in range(start, stop)
    ]
    skip = first - start * _BLOCK
    return np.concatenate(blocks)[skip : skip + n]


def _held(mag: Array, new: Array, before: Array) -> Array:
    """Repeat each new reading until the next; ``before`` until the first."""
    held: Array = np.concatenate([before[None], mag[new]])[np.cumsum(new)]
    return held


def _counts(value: Array, limit: float) -> Array:
    steps = np.rint(value * (FULL_SCALE / limit))
    return np.clip(steps, -FULL_SCALE, FULL_SCALE - 1).astype(np.int16)
