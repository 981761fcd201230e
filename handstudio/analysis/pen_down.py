"""When a pen writes: it is on the paper, and it goes somewhere there.

Lifting from one stroke to the next takes 3 to 6 mm. A stretch counts as lifted where it rises well
above the paper, from where it leaves it to where it is back; slow drift of the height, which is
the filter's, is taken off first.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array

_DRIFT_S = 2.0
_ON_PAPER_M = 0.0006  # scale of what counts as on paper when drift is looked for
_LIFTED_M, _LEFT_M = 0.0014, 0.0005  # risen for sure; no more on paper
_NOISES = 4.0  # or so many times the noise of the height, where that is more
_SMOOTHED_S = 0.015
_LEAST_M = 0.0008  # a stroke is longer


def pen_down(
    height_m: Float[Array, " n"], along: Float[Array, "n 2"], step_s: float
) -> Bool[Array, " n"]:
    """Whether it writes.

    Args:
        height_m: Of the tip above the paper.
        along: Its place on the paper [m].
        step_s: Between instants.
    """
    from scipy.ndimage import gaussian_filter1d, label  # noqa: PLC0415

    steady = gaussian_filter1d(height_m - _drift(height_m, step_s), _SMOOTHED_S / step_s)
    near = np.abs(steady[np.abs(steady) < _LIFTED_M])
    noise = 1.4826 * float(np.median(near)) if len(near) else 0.0
    lifted_m = max(_LIFTED_M, _NOISES * noise)
    off = steady > lifted_m * _LEFT_M / _LIFTED_M
    parts, count = label(off)
    highest = np.zeros(count + 1)
    np.maximum.at(highest, parts, steady)
    up = off & (highest[parts] > lifted_m)
    return ~up & _goes(along, ~up)


def strokes(down: Bool[Array, " n"]) -> list[slice]:
    """The instants of every stroke."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], down, [False]]).astype(int)))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _drift(height: Array, step_s: float) -> Array:
    """Height of the paper as it wanders, from what is near it."""
    from scipy.ndimage import gaussian_filter1d  # noqa: PLC0415 - takes a second to load

    wide = _DRIFT_S / step_s
    near = 1.0 / (1.0 + (height / _ON_PAPER_M) ** 2) ** 2
    weight = gaussian_filter1d(near, wide)
    return np.asarray(gaussian_filter1d(near * height, wide) / np.maximum(weight, 1e-6))


def _goes(along: Array, on_paper: Array) -> Array:
    """Of each contact, whether the tip went anywhere in it."""
    out = np.zeros(len(on_paper), dtype=bool)
    for stroke in strokes(on_paper):
        out[stroke] = float(np.linalg.norm(np.ptp(along[stroke], axis=0))) > _LEAST_M
    return out
