"""What one window says of every sensor: a kernel over arrays, without memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.health.limits import FIELD_LEAST, LEAST_INSTANTS
from handstudio.health.windows import Window
from handstudio.samples import ImuSamples


@dataclass(frozen=True, slots=True, eq=False)
class Measures:
    """Figures of a window. NaN: the sensor did not answer throughout, or nothing was read.

    Attributes:
        instants: How many.
        missing: How many are missing before or between them.
        restarts: Of the device, before them.
        start_us: First instant, on an axis that goes on over restarts.
        end_us: Last instant.
        steps: Sampling steps that nothing is missing in, and
        steps_us: how long they took together.
        step_us: Their median; NaN without any.
        answered: Instants the sensor answered.
        saturated: Instants with an axis at its limit.
        spread_gyr: Peak to peak of the axis that moves most [rad/s].
        spread_acc: The same [m/s²].
        noise_gyr: Standard deviation of the white part of the noisiest axis [rad/s].
        noise_acc: The same [m/s²].
        field: Mean size of the magnetic field [µT].
        dip: Angle of the field below the horizontal [rad]; true of a sensor at rest alone.
    """

    instants: int
    missing: int
    restarts: int
    start_us: int
    end_us: int
    steps: int
    steps_us: int
    step_us: float
    answered: Int64[Array, " s"]
    saturated: Int64[Array, " s"]
    spread_gyr: Float[Array, " s"]
    spread_acc: Float[Array, " s"]
    noise_gyr: Float[Array, " s"]
    noise_acc: Float[Array, " s"]
    field: Float[Array, " s"]
    dip: Float[Array, " s"]

    @property
    def telling(self) -> bool:
        """Whether there are enough instants for shares and noise."""
        return self.instants >= LEAST_INSTANTS


def measure(window: Window) -> Measures:
    """Measure a window."""
    samples = window.samples
    answered = samples.valid.sum(axis=0)
    unknown = answered < len(samples)
    steps, steps_us, step_us, unbroken = _steps(window)
    noise_gyr, noise_acc = (_noise(signal, unbroken) for signal in (samples.gyr, samples.acc))
    spread_gyr, spread_acc = (np.ptp(s, axis=0).max(axis=-1) for s in (samples.gyr, samples.acc))
    for figure in (noise_gyr, noise_acc, spread_gyr, spread_acc):
        figure[unknown] = np.nan
    field, dip = _field(samples)
    return Measures(
        len(samples),
        window.missing,
        window.restarts,
        window.start_us,
        window.end_us,
        steps,
        steps_us,
        step_us,
        answered,
        (samples.saturated & samples.valid).sum(axis=0),
        spread_gyr,
        spread_acc,
        noise_gyr,
        noise_acc,
        field,
        dip,
    )


def _steps(window: Window) -> tuple[int, int, float, Array]:
    """Count, sum and median of the steps nothing is missing in, and which steps these are.

    A clock that jumps is not a slow one: steps far from the median do not count.
    """
    all_us = np.diff(window.samples.time_us)
    unbroken = np.ones(len(all_us), dtype=bool)
    unbroken[[at - 1 for at in window.breaks if at > 0]] = False
    known = all_us[unbroken]
    if len(known) == 0:
        return 0, 0, float("nan"), unbroken
    median = float(np.median(known))
    usual = known[np.abs(known - median) < 0.5 * median]
    return len(usual), int(usual.sum()), median, unbroken


def _noise(signal: Array, unbroken: Array) -> Array:
    """White noise from second differences, which motion of a hand hardly enters.

    The second difference of white noise has six times its variance.
    """
    bent = signal[2:] - 2.0 * signal[1:-1] + signal[:-2]
    if not unbroken.all():
        bent = bent[unbroken[1:] & unbroken[:-1]]
    if len(bent) == 0:
        return np.full(signal.shape[1], np.nan)
    power: Array = np.einsum("nsk,nsk->sk", bent, bent).max(axis=-1)
    return np.sqrt(power / (6.0 * len(bent)))


def _field(samples: ImuSamples) -> tuple[Array, Array]:
    """Size and dip of the field by its new readings, NaN where too few."""
    rows = samples.fresh.any(axis=1)
    mag, acc = samples.mag[rows], samples.acc[rows]
    use = samples.fresh[rows] & samples.valid[rows] & np.isfinite(mag).all(axis=-1)
    count = use.sum(axis=0)
    enough = count >= FIELD_LEAST
    share = np.where(enough, 1.0 / np.maximum(count, 1), np.nan)
    mag = np.where(use[..., None], mag, 0.0)
    field = np.sqrt(np.einsum("nsk,nsk->ns", mag, mag)).sum(axis=0) * share
    up = np.where(use[..., None], acc, 0.0).sum(axis=0)
    mean = mag.sum(axis=0)
    sizes = np.linalg.norm(up, axis=-1) * np.linalg.norm(mean, axis=-1)
    down = -(up * mean).sum(axis=-1) / np.where(sizes > 0.0, sizes, np.nan)
    return field, np.where(enough, np.arcsin(np.clip(down, -1.0, 1.0)), np.nan)
