"""Finger independence: how still the other fingers are while one moves.

C. Häger-Ross and M. H. Schieber, J. Neurosci. 20 (2000) 8542. ``S_ij``: the slope of finger j's
flexion on finger i's while i is the one that moves. Individuation of i: ``1 - mean over j of
|S_ij|``; stationarity of j: ``1 - mean over i of |S_ij|``; 1 is perfect. A finger's flexion is the
sum of its joints'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.analysis.cycles import Cycles, cycles_of
from handstudio.analysis.measure import Measure, missing
from handstudio.analysis.series import AngleSeries
from handstudio.arrays import Array
from handstudio.hand.skeleton import FINGERS

APART = 1.5
"""Where no label says which finger is meant: one moves alone if it goes this many times as far as
every other. What was meant so and failed is then not seen: labels are better."""


@dataclass(frozen=True, slots=True)
class Meant:
    """A stretch in which one finger was to move, seconds from the take's first instant."""

    start_s: float
    end_s: float
    finger: str


def meant_by(labels: Sequence[tuple[float, float, str]]) -> list[Meant]:
    """Stretches whose labels begin with a finger's name, such as ``index_mcp:flexion``."""
    out = []
    for start, end, label in labels:
        finger = label.lower().replace(":", "_").replace(" ", "_").split("_")[0]
        if finger in FINGERS[1:]:
            out.append(Meant(start, end, finger))
    return out


def finger_flexions(series: AngleSeries) -> dict[str, Float[Array, " n"]]:
    """Sum of the flexions of each finger's joints [rad], where all of them are measured."""
    out = {}
    for finger in FINGERS[1:]:
        names = [f"{finger}_{joint}_flexion" for joint in ("mcp", "pip", "dip")]
        if all(name in series for name in names):
            out[finger] = np.sum([series.of(name) for name in names], axis=0)
    return out


def independence_measures(
    series: AngleSeries, labels: Sequence[tuple[float, float, str]] = ()
) -> list[Measure]:
    """Individuation and stationarity indices of the four fingers."""
    flexions = finger_flexions(series)
    if len(flexions) < 2:
        return [missing("individuation", finger, "", "no_sensor") for finger in FINGERS[1:]]
    meant = meant_by(labels)
    slopes = {
        finger: _slopes(series.time_s, flexions, finger, meant) for finger in flexions
    }  # finger → (movement, other)
    out: list[Measure] = []
    for finger in flexions:
        each = 1.0 - np.abs(slopes[finger]).mean(axis=1)
        out.append(_index("individuation", finger, each, labelled=bool(meant)))
    for finger in flexions:
        others = [other for other in flexions if other != finger and len(slopes[other])]
        if len(others) < len(flexions) - 1:
            out.append(missing("stationarity", finger, "", "no_movement"))
            continue
        columns = [slopes[other][:, _place(flexions, other, finger)] for other in others]
        value = 1.0 - float(np.mean([np.abs(column).mean() for column in columns]))
        errors = [
            float(np.abs(c).std(ddof=1) / np.sqrt(len(c))) if len(c) > 1 else np.nan
            for c in columns
        ]
        sd = float(np.linalg.norm(errors) / len(errors))
        out.append(Measure("stationarity", finger, value, "", sd=sd if np.isfinite(sd) else None))
    return out


def _index(kind: str, finger: str, each: Array, *, labelled: bool) -> Measure:
    if not len(each):
        return missing("individuation", finger, "", "no_movement")
    sd = float(each.std(ddof=1) / np.sqrt(len(each))) if len(each) > 1 else None
    details = {"movements": float(len(each)), "labelled": float(labelled)}
    return Measure("individuation", finger, float(each.mean()), "", sd=sd, details=details)


def _place(flexions: dict[str, Array], moving: str, other: str) -> int:
    return [name for name in flexions if name != moving].index(other)


def _slopes(
    time_s: Array, flexions: dict[str, Array], finger: str, meant: Sequence[Meant]
) -> Float[Array, "m o"]:
    """Slopes of the other fingers on this one, for each way to or fro in which it is meant."""
    others = [name for name in flexions if name != finger]
    cycles: Cycles = cycles_of(time_s, flexions[finger])
    rows = []
    for a, b in cycles.ways:
        own = flexions[finger][a : b + 1]
        rest = np.stack([flexions[name][a : b + 1] for name in others], axis=1)
        if not np.isfinite(rest).all():
            continue
        if meant:
            middle = 0.5 * (time_s[a] + time_s[b])
            if not any(m.finger == finger and m.start_s <= middle <= m.end_s for m in meant):
                continue
        elif np.ptp(own) < APART * np.ptp(rest, axis=0).max():
            continue
        centred = own - own.mean()
        rows.append(centred @ (rest - rest.mean(axis=0)) / float(centred @ centred))
    return np.array(rows, dtype=float).reshape(-1, len(others))
