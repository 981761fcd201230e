"""How smooth a movement is: spectral arc length and log dimensionless jerk.

Both blind to how large and how long it was; 0 would be smoothest, more negative is jerkier.
S. Balasubramanian, A. Melendez-Calderon, E. Burdet, IEEE Trans. Biomed. Eng. 59 (2012) 2126; with
A. Roby-Brami, J. NeuroEng. Rehabil. 12 (2015) 112.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.analysis.cycles import Cycles
from handstudio.analysis.measure import Measure, missing
from handstudio.arrays import Array

CUT_HZ = 10.0
"""Highest frequency that counts."""

THRESHOLD = 0.05
"""Up to the last frequency at which the normalised spectrum reaches this."""

_PADDING = 4  # the spectrum is 2**4 times as fine as the signal gives by itself

LEAST_S = 0.15
"""A movement that is shorter has too few instants to be judged."""


def sparc(speed: Float[Array, " n"], rate_hz: float) -> float:
    """Spectral arc length of a speed profile (2015, equation 8); NaN of no movement."""
    points = 2 ** (int(np.ceil(np.log2(len(speed)))) + _PADDING)
    spectrum = np.abs(np.fft.rfft(speed, points))
    if not spectrum[0] > 0.0:
        return float("nan")
    spectrum = spectrum / spectrum[0]
    frequency = np.fft.rfftfreq(points, 1.0 / rate_hz)
    below = frequency <= CUT_HZ
    spectrum, frequency = spectrum[below], frequency[below]
    last = int(np.flatnonzero(spectrum >= THRESHOLD)[-1])
    spectrum, frequency = spectrum[: last + 1], frequency[: last + 1]
    if last == 0:
        return float("nan")
    along = np.diff(frequency) / frequency[-1]
    return -float(np.sum(np.hypot(along, np.diff(spectrum))))


def ldlj(speed: Float[Array, " n"], rate_hz: float) -> float:
    """Log dimensionless jerk of a speed profile (2015, equation 5); NaN of no movement.

    ``-ln(T³ / v_peak² · ∫ |d²v/dt²|² dt)``.
    """
    peak = float(np.abs(speed).max())
    if not peak > 0.0:
        return float("nan")
    duration = (len(speed) - 1) / rate_hz
    jerk = np.gradient(np.gradient(speed, 1.0 / rate_hz), 1.0 / rate_hz)
    total = float(np.trapezoid(jerk**2, dx=1.0 / rate_hz))
    return -float(np.log(duration**3 / peak**2 * total)) if total > 0.0 else float("nan")


def smoothness_measures(
    name: str, rates: Float[Array, " n"], cycles: Cycles, rate_hz: float
) -> list[Measure]:
    """Means over the ways to and fro of an angle, from its velocity, with their standard errors."""
    moves = [
        np.abs(rates[a : b + 1])
        for a, b in cycles.ways
        if (b - a) / rate_hz >= LEAST_S and np.isfinite(rates[a : b + 1]).all()
    ]
    if len(moves) < 2:
        return [missing(kind, name, "", "no_movement") for kind in ("sparc", "ldlj")]
    out = []
    for kind, of in (("sparc", sparc), ("ldlj", ldlj)):
        values = np.array([of(move, rate_hz) for move in moves])
        values = values[np.isfinite(values)]
        spread = float(values.std(ddof=1))
        out.append(
            Measure(
                kind,  # type: ignore[arg-type]
                name,
                float(values.mean()),
                "",
                sd=spread / np.sqrt(len(values)),
                details={"movements": float(len(values)), "sd_of_movements": spread},
            )
        )
    return out
