"""Tremor: the spectrum of an angle between 3 and 12 Hz, its amplitude and its peak.

Welch's method (P. D. Welch, IEEE Trans. Audio 15 (1967) 70): windows of four seconds, each without
its trend, half overlapping; those alone in which the joint was held, since the overtones of a
movement that is meant lie in the same band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import uniform_filter1d
from scipy.signal import periodogram

from handstudio.analysis.measure import Measure, WhyNot, missing
from handstudio.analysis.series import AngleSeries
from handstudio.analysis.stretches import rate_of, unbroken
from handstudio.arrays import Array

WINDOW_S = 4.0
BAND_HZ = (3.0, 12.0)

HELD_RAD = float(np.deg2rad(10.0))
"""A joint that goes farther within a window, tremor averaged out, is moved and not held."""

NOISE_DEG = 0.003
"""What is left in the band of a hand at rest, mostly white noise of gyroscopes."""

STANDS_OUT = 4.0
"""Times the median of the band's spectrum of rates: less is no peak."""


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Power of an angle [rad²/Hz] over frequency, a mean over so many windows; NaN of none."""

    frequency_hz: Float[Array, " f"]
    power: Float[Array, " f"]
    windows: int

    @property
    def amplitude(self) -> float:
        """RMS of the angle within the band [rad]."""
        inside = self._band
        step = self.frequency_hz[1] - self.frequency_hz[0]
        return float(np.sqrt(self.power[inside].sum() * step))

    @property
    def peak_hz(self) -> float | None:
        """Where the spectrum of the angle's rate is highest in the band; None: nothing stands out.

        Of the rate: an angle's own falls off so steeply that any movement hides what is above.
        """
        inside = np.flatnonzero(self._band)
        rate = self.power[inside] * (2.0 * np.pi * self.frequency_hz[inside]) ** 2
        best = int(rate.argmax())
        inner = 0 < best < len(rate) - 1
        if not inner or rate[best] < STANDS_OUT * float(np.median(rate)):
            return None
        left, top, right = np.log(rate[best - 1 : best + 2])
        shift = 0.5 * (left - right) / (left - 2.0 * top + right)  # parabola through three
        step = self.frequency_hz[1] - self.frequency_hz[0]
        return float(self.frequency_hz[inside[best]] + shift * step)

    @property
    def _band(self) -> Array:
        low, high = BAND_HZ
        inside: Array = (self.frequency_hz >= low) & (self.frequency_hz <= high)
        return inside


def spectrum_of(time_s: Float[Array, " n"], values: Float[Array, " n"]) -> Spectrum | None:
    """Mean spectrum over the windows in which the joint was held; None where none is that long."""
    if len(time_s) < 2:
        return None
    rate = rate_of(time_s)
    size = round(WINDOW_S * rate)
    if rate < 2.0 * BAND_HZ[1]:
        return None
    windows = [
        values[at : at + size]
        for part in unbroken(time_s, values, WINDOW_S)
        for at in range(part.start, part.stop - size + 1, size // 2)
    ]
    if not windows:
        return None
    held = np.array([each for each in windows if _is_held(each, rate)]).reshape(-1, size)
    frequency, power = periodogram(held, rate, window="hann", detrend="linear", axis=-1)
    mean = power.mean(axis=0) if len(held) else np.full(len(frequency), np.nan)
    return Spectrum(frequency, mean, len(held))


def _is_held(window: Array, rate: float) -> bool:
    """Whether nothing moved in it but what is faster than the band begins."""
    slow = uniform_filter1d(window, max(1, round(rate / BAND_HZ[0])), mode="nearest")
    return bool(np.ptp(slow) <= HELD_RAD)


def tremor_measures(series: AngleSeries, name: str, spectrum: Spectrum | None) -> list[Measure]:
    """RMS amplitude in the band [deg] and frequency of its peak [Hz] of one angle."""
    if spectrum is None:
        return [missing("tremor_amplitude", name, "deg", _why(series, name))]
    if not spectrum.windows:
        return [missing("tremor_amplitude", name, "deg", "moving")]
    amplitude = float(np.rad2deg(spectrum.amplitude))
    # of a power by chi squared with two degrees of freedom a window and bin; half that of its root
    bins = int(
        ((spectrum.frequency_hz >= BAND_HZ[0]) & (spectrum.frequency_hz <= BAND_HZ[1])).sum()
    )
    share = 0.5 / np.sqrt(spectrum.windows * max(1.0, bins / 3.0))
    out = [
        Measure(
            "tremor_amplitude",
            name,
            amplitude,
            "deg",
            sd=float(np.hypot(amplitude * share, NOISE_DEG)),
            details={"windows": float(spectrum.windows)},
        )
    ]
    peak = spectrum.peak_hz
    if peak is None:
        return [*out, missing("tremor_frequency", name, "Hz", "no_peak")]
    resolution = 1.0 / WINDOW_S
    sd = resolution / np.sqrt(12.0)
    return [*out, Measure("tremor_frequency", name, peak, "Hz", sd=float(sd))]


def _why(series: AngleSeries, name: str) -> WhyNot:
    known = np.isfinite(series.of(name))
    if not known.any():
        return "in_doubt"
    return "gaps" if np.ptp(series.time_s[known]) >= WINDOW_S else "too_short"
