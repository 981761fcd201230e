"""Angular speed of joints: the peak that was held, and the mean while it moved."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.signal import savgol_filter

from handstudio.analysis.extremes import extremes
from handstudio.analysis.measure import Measure, missing
from handstudio.analysis.series import AngleSeries
from handstudio.analysis.stretches import rate_of, unbroken
from handstudio.arrays import Array

WINDOW_S = 0.09
"""Of the local cubic that is differentiated (A. Savitzky, M. J. E. Golay, Anal. Chem. 36 (1964)
1627): slopes of movements of 5 Hz are whole within 1 %."""

MOVING_RAD_S = float(np.deg2rad(10.0))
"""From this speed on a joint moves."""

NOISE_SD = float(np.deg2rad(2.0))
"""Of a speed where nothing moves [rad/s]."""


def velocity(time_s: Float[Array, " n"], values: Float[Array, " n"]) -> Float[Array, " n"]:
    """Slope of a local cubic [1/s]; NaN outside unbroken stretches as long as its window."""
    out = np.full(len(values), np.nan)
    if len(time_s) < 2:
        return out
    rate = rate_of(time_s)
    window = max(5, round(WINDOW_S * rate) | 1)
    for part in unbroken(time_s, values):
        if part.stop - part.start >= window:
            out[part] = savgol_filter(values[part], window, 3, deriv=1, delta=1.0 / rate)
    return out


def speeds(series: AngleSeries, name: str, rates: Float[Array, " n"]) -> list[Measure]:
    """Peak and mean speed [deg/s] of one angle, from its `velocity`."""
    found = extremes(series.time_s, np.abs(rates))
    if found is None:
        why = "too_short" if np.isfinite(series.of(name)).any() else "in_doubt"
        return [missing("peak_speed", name, "deg/s", why)]
    peak = float(np.rad2deg(found.most))
    out = [
        Measure(
            "peak_speed",
            name,
            peak,
            "deg/s",
            sd=_sd(series, name, peak),
            at_s=float(series.time_s[found.most_at]),
        )
    ]
    moving: Array = np.abs(rates[np.abs(rates) > MOVING_RAD_S])
    if not len(moving):
        return [*out, missing("mean_speed", name, "deg/s", "no_movement")]
    mean = float(np.rad2deg(moving.mean()))
    return [*out, Measure("mean_speed", name, mean, "deg/s", sd=_sd(series, name, mean))]


def _sd(series: AngleSeries, name: str, speed: float) -> float:
    """What skin and noise leave in doubt of a speed [deg/s]."""
    share = float(series.share_sd[series.names.index(name)])
    return float(np.hypot(share * speed, np.rad2deg(NOISE_SD)))
