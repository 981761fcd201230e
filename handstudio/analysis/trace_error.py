"""How far a trace is from what was written, once moved, turned and scaled to fit it best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array


@dataclass(frozen=True, slots=True)
class TraceError:
    """After the similarity that fits best.

    Attributes:
        rmse_m: Root mean square distance.
        scale: True size per size of the trace.
        turn_rad: From the trace to what is true.
    """

    rmse_m: float
    scale: float
    turn_rad: float


def trace_error(trace: Float[Array, "n 2"], true: Float[Array, "n 2"]) -> TraceError:
    """Least squares over similarities of the plane, in closed form as complex numbers."""
    got, wanted = (_complex(points - points.mean(axis=0)) for points in (trace, true))
    factor = np.vdot(got, wanted) / np.vdot(got, got)
    left = np.abs(wanted - factor * got)
    return TraceError(
        float(np.sqrt(np.mean(left**2))), float(np.abs(factor)), float(np.angle(factor))
    )


def _complex(points: Array) -> Array:
    out: Array = points[:, 0] + 1j * points[:, 1]
    return out
