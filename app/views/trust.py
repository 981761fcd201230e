"""What of the hand can be trusted at this moment, sensor by sensor. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.views.steps import joint_name
from app.words import _
from handstudio.pipeline import Doubt, Motion
from handstudio.setup import Setup

UNSURE_DEG = 3.0
"""A standard deviation beyond this is seen in the picture, and as a wide band in the plots."""


@dataclass(frozen=True, slots=True)
class Distrust:
    """A sensor that is not trusted, the segment that it stands for, and why, in words."""

    sensor: str
    segment: str
    why: str


def distrusted(setup: Setup, motion: Motion) -> list[Distrust]:
    """The sensors that are not trusted at the last instant of a motion, in their order."""
    relative = np.rad2deg(motion.sd_rad[-1, :, 1])
    found = []
    for place, doubt, sd in zip(setup.layout.sensors, motion.doubt[-1], relative, strict=True):
        why = _why(int(doubt), float(sd))
        if why:
            found.append(Distrust(place.sensor, joint_name(place.segment), why))
    return found


def surest_words(motion: Motion) -> str:
    """How sure the filter is where all is trusted."""
    worst = float(np.rad2deg(motion.sd_rad[-1, :, 1]).max())
    if not np.isfinite(worst):
        return _("Nothing is in doubt; this filter does not tell how sure it is.")
    return _("Every segment is trusted: standard deviations up to {sd:.1f}°.").format(sd=worst)


def _why(doubt: int, sd_deg: float) -> str:
    if doubt & Doubt.SILENT:
        return _("not answering")
    if doubt & Doubt.UNPLACED:
        return _("waits for half a second of rest")
    if doubt & Doubt.SATURATED:
        return _("at its limit")
    if UNSURE_DEG < round(sd_deg, 1) < np.inf:
        return _("standard deviation {sd:.1f}°").format(sd=sd_deg)
    return ""
