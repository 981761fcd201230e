"""Angular speed of joints: the peak that was held, and the mean while it moved."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.analysis.extremes import extremes
from handstudio.analysis.measure import Measure, WhyNot, missing
from handstudio.analysis.series import AngleSeries, flexion_beside
from handstudio.analysis.unbroken import rate_of, unbroken
from handstudio.arrays import Array

WINDOW_S = 0.09
"""Of the local cubic that is differentiated (A. Savitzky, M. J. E. Golay, Anal. Chem. 36 (1964)
1627): slopes of movements of 5 Hz are whole within 1 %."""

MOVING_RAD_S = float(np.deg2rad(10.0))
"""From this speed on a joint moves."""

NOISE_DEG_S = 2.0
"""Of a speed where nothing moves."""


def velocity(time_s: Float[Array, " n"], values: Float[Array, " n"]) -> Float[Array, " n"]:
    """Slope of a local cubic [1/s]; NaN where its window would reach over the end of a stretch."""
    from scipy.signal import savgol_filter  # noqa: PLC0415 - takes a second to load

    out = np.full(len(values), np.nan)
    if len(time_s) < 2:
        return out
    rate = rate_of(time_s)
    window = max(5, round(WINDOW_S * rate) | 1)
    for part in unbroken(time_s, values):
        if part.stop - part.start >= window:
            inner = slice(part.start + window // 2, part.stop - window // 2)
            slope = savgol_filter(values[part], window, 3, deriv=1, delta=1.0 / rate)
            out[inner] = slope[window // 2 : len(slope) - window // 2]
    return out


def speeds(
    series: AngleSeries, name: str, rates: Float[Array, " n"], flexion_rad_s: float
) -> list[Measure]:
    """Peak and mean speed [deg/s] of one angle.

    Args:
        series: The angles.
        name: Which one.
        rates: Its `velocity`.
        flexion_rad_s: Peak speed of its joint's flexion: an axis that is off lets a share of it
            into the turns beside.
    """
    found = extremes(series.time_s, np.abs(rates))
    if found is None:
        why: WhyNot = "too_short" if np.isfinite(series.of(name)).any() else "in_doubt"
        return [missing("peak_speed", name, "deg/s", why)]

    def sd(speed: float) -> float:
        column = series.names.index(name)
        share = 1.0 if flexion_beside(name) != name else 0.5
        leaked = share * float(series.level_sd[column]) * np.rad2deg(flexion_rad_s)
        dragged = float(series.share_sd[column]) * speed
        return float(np.linalg.norm([dragged, leaked, NOISE_DEG_S]))

    peak, at_s = float(np.rad2deg(found.most)), float(series.time_s[found.most_at])
    out = [Measure("peak_speed", name, peak, "deg/s", sd=sd(peak), at_s=at_s)]
    moving: Array = np.abs(rates[np.abs(rates) > MOVING_RAD_S])
    if not len(moving):
        return [*out, missing("mean_speed", name, "deg/s", "no_movement")]
    mean = float(np.rad2deg(moving.mean()))
    return [*out, Measure("mean_speed", name, mean, "deg/s", sd=sd(mean) * mean / peak)]
