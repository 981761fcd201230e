"""Unbroken stretches of a signal: kernels that differ or filter never reach over a gap."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array

_JUMP = 1.5  # sample periods: a longer step means that instants are missing


def rate_of(time_s: Float[Array, " n"]) -> float:
    """Sampling rate [Hz]; NaN of fewer than two instants."""
    return float(1.0 / np.median(np.diff(time_s))) if len(time_s) > 1 else float("nan")


def unbroken(
    time_s: Float[Array, " n"], values: Float[Array, " n"], least_s: float = 0.0
) -> list[slice]:
    """Stretches in which every instant is there and known, in order of time.

    Args:
        time_s: Of every instant.
        values: NaN where unknown.
        least_s: Leave out what is shorter.
    """
    if len(time_s) < 2:
        return []
    period = 1.0 / rate_of(time_s)
    known = np.isfinite(values)
    linked = known[1:] & known[:-1] & (np.diff(time_s) < _JUMP * period)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], linked, [False]]).astype(np.int8)))
    found = [slice(int(a), int(b) + 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [one for one in found if time_s[one.stop - 1] - time_s[one.start] >= least_s - period]
