"""Which sensor is being shaken: how a person finds out which is which. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.pipeline import Motion

SPAN_US = 800_000
_STEP_US = 10_000  # what is faster than this is thinned
_JUDGE_US = 150_000  # between two judgements

ENOUGH_RAD_S = 2.5
"""Root mean square of a turn to and fro that nobody makes by chance."""

APART = 2.5
"""So many times more than the middle sensor: a hand that moves as a whole points nothing out."""

REVERSALS = 4
"""To and fro twice within the span; opening and closing a hand is slower."""

LIT_US = 1_500_000
"""How long a sensor stays lit after it was last shaken."""


@dataclass(frozen=True, slots=True, eq=False)
class Shaking:
    """The last moments of all sensors, and the one that was shaken."""

    time_us: Int[Array, " n"]
    q_world_sensor: Float[Array, "n s 4"]
    judge_at_us: int = 0
    sensor: int | None = None
    until_us: int = 0


def begin(sensors: int) -> Shaking:
    """Nothing seen yet."""
    return Shaking(np.empty(0, dtype=np.int64), np.empty((0, sensors, 4)))


def heeded(shaking: Shaking, motions: Sequence[Motion]) -> Shaking:
    """Take in what came since; judges some times a second."""
    if not motions:
        return shaking
    time_us = np.concatenate([shaking.time_us, *(motion.time_us for motion in motions)])
    q = np.concatenate([shaking.q_world_sensor, *(motion.q_world_sensor for motion in motions)])
    now = int(time_us[-1])
    if (np.diff(time_us) <= 0).any():  # the device began anew
        return begin(q.shape[1])
    kept = (time_us > now - SPAN_US) & _thinned(time_us)
    shaking = replace(shaking, time_us=time_us[kept], q_world_sensor=q[kept])
    if now < shaking.judge_at_us:
        return shaking
    found = shaken(shaking.time_us, shaking.q_world_sensor)
    if found is not None:
        shaking = replace(shaking, sensor=found, until_us=now + LIT_US)
    elif now > shaking.until_us:
        shaking = replace(shaking, sensor=None)
    return replace(shaking, judge_at_us=now + _JUDGE_US)


def shaken(time_us: Int[Array, " n"], q_world_sensor: Float[Array, "n s 4"]) -> int | None:
    """The sensor that is turned to and fro far more than the others; None: there is none.

    Args:
        time_us: Device clock [µs], increasing.
        q_world_sensor: Attitudes.
    """
    if len(time_us) < 10 or time_us[-1] - time_us[0] < 0.6 * SPAN_US:
        return None
    turns = so3.log(so3.multiply(so3.conjugate(q_world_sensor[:-1]), q_world_sensor[1:]))
    rates = turns / (np.diff(time_us) * 1e-6)[:, None, None]
    rates = rates - rates.mean(axis=0)  # going somewhere is no shaking
    strength = np.sqrt((rates**2).sum(axis=-1).mean(axis=0))
    most = int(np.argmax(strength))
    if strength[most] < max(ENOUGH_RAD_S, APART * float(np.median(strength))):
        return None
    _values, axes = np.linalg.eigh(rates[:, most].T @ rates[:, most])
    along = rates[:, most] @ axes[:, -1]
    clear = np.abs(along) > 0.3 * strength[most]
    reversals = int((np.diff(np.sign(along[clear])) != 0).sum())
    return most if reversals >= REVERSALS else None


def _thinned(time_us: Array) -> Array:
    raster = time_us // _STEP_US
    first: Array = np.concatenate([[True], np.diff(raster) > 0])
    return first
