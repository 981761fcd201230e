"""What filters on Euler angles take from samples, ready for a loop over instants.

Components stand before sensors, as in `euler`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.fusion import euler
from handstudio.samples import ImuSamples


@dataclass(frozen=True, slots=True)
class Steps:
    """One step an instant; no NaN in it, whatever the samples have where they are not heeded."""

    turn: Float[Array, "n 3 s"]  # rotation of the step [rad], sensor frame, bias taken off
    duration_s: Float[Array, " n"]
    observed: Float[Array, "n 3 s"]  # attitude by accelerometer and compass, psi 0 without compass
    heeded: Bool[Array, "n s"]
    compass: Bool[Array, "n s"]  # psi was observed


def steps_of(
    samples: ImuSamples,
    stretch: Float[Array, " n"],
    heeded: Bool[Array, "n s"],
    period_s: float,
    gyr_bias: Float[Array, "s 3"],
) -> Steps:
    """Steps that lead to each sample. A step that is not heeded turns nothing."""
    duration = stretch * period_s
    compass = heeded & samples.fresh & np.isfinite(samples.mag).all(axis=-1)
    gyr = _where(heeded, samples.gyr - gyr_bias)
    observed = euler.observed(
        np.moveaxis(_where(heeded, samples.acc), 1, 0),
        np.moveaxis(_where(compass, samples.mag), 1, 0),
    )
    return Steps(
        turn=gyr * duration[:, None, None],
        duration_s=duration,
        observed=np.ascontiguousarray(np.moveaxis(observed, 0, 1)),
        heeded=heeded,
        compass=compass,
    )


def first(before: Bool[Array, " s"], now: Bool[Array, "n s"]) -> Bool[Array, "n s"]:
    """Where a sensor does something for the first time."""
    known = np.maximum.accumulate(np.concatenate([before[None], now]), axis=0)
    return np.asarray(now & ~known[:-1])


def _where(use: Array, signal: Array) -> Array:
    """A signal with its components before the sensors, 0 where it is not used."""
    return np.where(use[:, None, :], np.moveaxis(signal, -1, 1), 0.0)
