"""Active range of motion: the extremes of every joint angle, against what is usual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from handstudio.analysis.extremes import extremes
from handstudio.analysis.measure import Kind, Measure, WhyNot, missing
from handstudio.analysis.norms import norms_of
from handstudio.analysis.series import AngleSeries, flexion_beside
from handstudio.analysis.uncertainty import detectable
from handstudio.hand.angles import ROOT_ANGLES, hand_angles

_KINDS: tuple[Kind, ...] = ("least", "most", "range")


def ranges_of_motion(series: AngleSeries) -> list[Measure]:
    """Least, most and range [deg] of every angle that is measured, with norms.

    The level of an angle (its zero) falls out of the range; the extremes carry it.
    """
    return [measure for name in series.names for measure in _of(series, name)]


def unmeasured(names: Sequence[str]) -> list[Measure]:
    """Angles of a hand that this layout has no sensors for."""
    there = set(names)
    return [
        missing("range", angle.name, "deg", "no_sensor")
        for angle in hand_angles()
        if angle.name not in there and not angle.name.endswith("_deviation_ulnar")
    ]


def _of(series: AngleSeries, name: str) -> list[Measure]:
    values = series.of(name)
    found = extremes(series.time_s, values)
    if found is None:
        return [missing("range", name, "deg", _why(series, name))]
    low_sd, high_sd = (series.sd_at(name, at) for at in (found.least_at, found.most_at))
    column = series.names.index(name)
    level = float(series.level_sd[column])
    span = found.most - found.least
    moments = series.moment_sds(name)
    dragged = float(series.share_sd[column]) * span
    leaked = level * _leaking(series, name)
    span_sd = float(
        np.linalg.norm([moments[found.least_at], moments[found.most_at], dragged, leaked])
    )
    norm = norms_of(name)
    values_sds = (
        (found.least, low_sd, found.least_at),
        (found.most, high_sd, found.most_at),
        (span, span_sd, None),
    )
    return [
        Measure(
            kind,
            name,
            float(np.rad2deg(value)),
            "deg",
            sd=float(np.rad2deg(sd)),
            norm=usual,
            detectable=float(np.rad2deg(detectable(sd))),
            at_s=None if at is None else float(series.time_s[at]),
        )
        for kind, (value, sd, at), usual in zip(_KINDS, values_sds, norm, strict=True)
    ]


def _leaking(series: AngleSeries, name: str) -> float:
    """By how much of its level a range is off: the zero itself falls out of it.

    An axis that is off lets so much of the joint's flexion, per radian, into the turns beside it;
    of flexion itself half is taken for what bends its scale.
    """
    flexion = flexion_beside(name)
    if flexion == name or flexion not in series:
        return 0.5
    found = extremes(series.time_s, series.of(flexion))
    return 0.5 if found is None else max(0.5, found.most - found.least)


def _why(series: AngleSeries, name: str) -> WhyNot:
    if np.isfinite(series.of(name)).any():
        return "gaps"
    return "no_start" if name in ROOT_ANGLES else "in_doubt"
