"""Tremor: the spectrum of an angle between 3 and 12 Hz, its amplitude and its peak.

Welch's method (P. D. Welch, IEEE Trans. Audio 15 (1967) 70): windows of four seconds, each without
its trend, half overlapping; those alone in which the joint was held, since the overtones of a
movement that is meant lie in the same band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.analysis.measure import Measure, WhyNot, missing
from handstudio.analysis.series import AngleSeries
from handstudio.analysis.unbroken import rate_of, unbroken
from handstudio.arrays import Array

WINDOW_S = 4.0
BAND_HZ = (3.0, 12.0)

HELD_RAD = float(np.deg2rad(10.0))
"""A joint that goes farther within a window, tremor averaged out, is moved and not held."""

NOISE_DEG = 0.003
"""What is left in the band of a hand at rest, mostly white noise of gyroscopes."""

CHANCE = 0.01
"""How often noise alone may be taken for a peak."""


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Power of an angle [rad²/Hz] over frequency, a mean over so many windows; empty of none."""

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
        """Where power rises highest above a power law through the band; None: nothing stands."""
        inside = np.flatnonzero(self._band)
        across, up = np.log(self.frequency_hz[inside]), np.log(self.power[inside])
        above = up - np.polyval(np.polyfit(across, up, 1), across)
        best = int(above.argmax())
        inner = 0 < best < len(above) - 1
        if not inner or above[best] - np.median(above) < np.log(self._stands_out(len(above))):
            return None
        left, top, right = up[best - 1 : best + 2]
        shift = 0.5 * (left - right) / (left - 2.0 * top + right)  # parabola through three
        step = self.frequency_hz[1] - self.frequency_hz[0]
        return float(self.frequency_hz[inside[best]] + shift * step)

    def _stands_out(self, bins: int) -> float:
        """How many times the median noise reaches in one of so many bins by `CHANCE` alone.

        Windows that overlap by half count for about 0.65 each.
        """
        from scipy.stats import chi2  # noqa: PLC0415 - takes a second to load

        freedom = 2.0 * max(1.0, 0.65 * self.windows)
        return float(chi2.ppf(1.0 - CHANCE / bins, freedom) / chi2.median(freedom))

    @property
    def _band(self) -> Array:
        low, high = BAND_HZ
        inside: Array = (self.frequency_hz >= low) & (self.frequency_hz <= high)
        return inside


def spectrum_of(time_s: Float[Array, " n"], values: Float[Array, " n"]) -> Spectrum | None:
    """Mean spectrum over the windows in which the joint was held; None where none is that long."""
    from scipy.signal import periodogram  # noqa: PLC0415 - takes a second to load

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
    held = [each for each in windows if _is_held(each, rate)]
    if not held:
        return Spectrum(np.empty(0), np.empty(0), 0)
    frequency, power = periodogram(np.array(held), rate, window="hann", detrend=_level, axis=-1)
    return Spectrum(frequency, power.mean(axis=0), len(held))


def _level(windows: Array) -> Array:
    """Windows without their trends."""
    from scipy.signal import detrend  # noqa: PLC0415 - takes a second to load

    out: Array = detrend(windows, axis=-1)
    return out


def _is_held(window: Array, rate: float) -> bool:
    """Whether nothing moved in it but what is faster than the band begins."""
    from scipy.ndimage import uniform_filter1d  # noqa: PLC0415 - takes a second to load

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
