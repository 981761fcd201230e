"""What the magnetic field of a place is, as every compass knows it, and how far it is from it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.health.limits import (
    FIELD_PEERS,
    FIELD_TAU_DISTURBED_S,
    FIELD_TAU_S,
)


class FieldReference:
    """Size [µT] and dip [rad] every compass expects, followed slowly.

    The first idea is the median of all compasses, so that one beside a magnet from the start is
    seen; from there every compass goes its own way, as it has errors of its own.
    """

    def __init__(self, sensors: int) -> None:
        self._size = np.full(sensors, np.nan)
        self._dip = np.full(sensors, np.nan)

    def deviation(
        self,
        size: Float[Array, " s"],
        dip: Float[Array, " s"],
        still: Bool[Array, " s"],
        seconds: float,
        disturbed: Bool[Array, " s"],
    ) -> Float[Array, " s"]:
        """Length of the field's change, as a share of what is expected [%]; NaN unknown.

        Size and dip are polar coordinates of the field in its vertical plane. The dip is heeded
        where a sensor is still: only there does the accelerometer show what is down.
        """
        dip = np.where(still, dip, np.nan)
        self._size = np.where(np.isnan(self._size), _first(size), self._size)
        self._dip = np.where(np.isnan(self._dip), _first(dip), self._dip)
        turn = np.where(np.isnan(dip), 0.0, dip - self._dip)
        turn = np.where(np.isnan(turn), 0.0, turn)
        across = 4.0 * size * self._size * np.sin(0.5 * turn) ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            change: Array = 100.0 * np.sqrt((size - self._size) ** 2 + across) / self._size
        rate = seconds / np.where(disturbed, FIELD_TAU_DISTURBED_S, FIELD_TAU_S)
        self._size = _followed(self._size, size, rate)
        self._dip = _followed(self._dip, dip, rate)
        return np.where(np.isfinite(change), change, np.nan)


def _first(values: Array) -> Array:
    """The median where enough know, else each its own."""
    known = values[~np.isnan(values)]
    if len(known) < FIELD_PEERS:
        return values
    return np.where(np.isnan(values), np.nan, np.median(known))


def _followed(reference: Array, value: Array, rate: Array) -> Array:
    return np.where(
        np.isnan(value), reference, reference + np.minimum(rate, 1.0) * (value - reference)
    )
