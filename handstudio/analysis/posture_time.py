"""Time in posture: the share of the known time that an angle lay within a band."""

from __future__ import annotations

import msgspec
import numpy as np

from handstudio.analysis.measure import Measure, missing
from handstudio.analysis.series import AngleSeries


class Band(msgspec.Struct, frozen=True):
    """A posture by name: an angle from and to [deg]; None: no end on that side.

    Attributes:
        name: What it is called.
        angle: Which angle.
        above_deg, below_deg: Where it begins and ends.
        source: Where the limits are from.
    """

    name: str
    angle: str
    above_deg: float | None = None
    below_deg: float | None = None
    source: str = ""


_RULA = "RULA: L. McAtamney, E. N. Corlett, Appl. Ergon. 24 (1993) 91"
_OCRA = "ISO 11228-3:2007"

DEFAULT_BANDS = (
    Band("wrist_flexed_15", "wrist_flexion", above_deg=15.0, source=_RULA),
    Band("wrist_extended_15", "wrist_flexion", below_deg=-15.0, source=_RULA),
    Band("wrist_flexed_45", "wrist_flexion", above_deg=45.0, source=_OCRA),
    Band("wrist_extended_45", "wrist_flexion", below_deg=-45.0, source=_OCRA),
    Band("wrist_ulnar_20", "wrist_deviation_ulnar", above_deg=20.0, source=_OCRA),
    Band("wrist_radial_15", "wrist_deviation_ulnar", below_deg=-15.0, source=_OCRA),
)
"""What ergonomists count unless they name their own."""


def posture_measures(series: AngleSeries, bands: tuple[Band, ...] = DEFAULT_BANDS) -> list[Measure]:
    """Share of time [%] in each band; its uncertainty is what a standard deviation would change."""
    return [_share(series, band) for band in bands]


def _share(series: AngleSeries, band: Band) -> Measure:
    if band.angle not in series:
        return missing("time_in_posture", band.name, "%", "no_sensor")
    values = series.of(band.angle)
    known = np.isfinite(values)
    if not known.any():
        return missing("time_in_posture", band.name, "%", "in_doubt")
    sd = float(np.median(series.sds(band.angle)[known]))
    degrees = np.rad2deg(values[known])

    def share(shift: float) -> float:
        inside = np.ones(len(degrees), dtype=bool)
        if band.above_deg is not None:
            inside &= degrees + shift > band.above_deg
        if band.below_deg is not None:
            inside &= degrees + shift < band.below_deg
        return 100.0 * float(inside.mean())

    shifted = share(np.rad2deg(sd)), share(-np.rad2deg(sd))
    return Measure(
        "time_in_posture",
        band.name,
        share(0.0),
        "%",
        sd=0.5 * abs(shifted[0] - shifted[1]),
        low=min(shifted),
        high=max(shifted),
    )
