"""The largest and the smallest value of a signal that were held, not those of a spike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.analysis.unbroken import rate_of, unbroken
from handstudio.arrays import Array

HELD_S = 0.05
"""Of a running median this long: spikes of less than half of it are gone, and the turning point of
a swing at 2 Hz loses 2 % of its amplitude."""


@dataclass(frozen=True, slots=True)
class Extremes:
    """Smallest and largest value, and at which instants."""

    least: float
    most: float
    least_at: int
    most_at: int


def extremes(time_s: Float[Array, " n"], values: Float[Array, " n"]) -> Extremes | None:
    """Extremes of the running median over `HELD_S`; None where no stretch is that long."""
    smooth = running_median(time_s, values)
    if not np.isfinite(smooth).any():
        return None
    least_at, most_at = int(np.nanargmin(smooth)), int(np.nanargmax(smooth))
    return Extremes(float(smooth[least_at]), float(smooth[most_at]), least_at, most_at)


def running_median(time_s: Float[Array, " n"], values: Float[Array, " n"]) -> Float[Array, " n"]:
    """Median over `HELD_S` around every instant of an unbroken stretch; NaN elsewhere."""
    from scipy.ndimage import median_filter  # noqa: PLC0415 - takes a second to load

    out = np.full(len(values), np.nan)
    if len(time_s) < 2:
        return out
    size = max(3, round(HELD_S * rate_of(time_s)) | 1)
    for part in unbroken(time_s, values):
        if part.stop - part.start >= size:
            out[part] = median_filter(np.asarray(values[part], dtype=float), size, mode="nearest")
    return out
