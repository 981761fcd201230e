"""Scores of a finger: total active motion, and Strickland's of its two distal joints.

Both add the flexions of one instant, hyperextension counting as nothing, and take the largest sum
less the smallest: what the finger bends at its best fist, less what it lacks at its best stretch.

Sources: total active motion, American Society for Surgery of the Hand, graded as a share of 260 deg
(100 % excellent, above 75 good, above 50 fair); J. W. Strickland and S. V. Glogovac, J. Hand Surg.
5 (1980) 537: PIP and DIP as a share of 175 deg (85, 70, 50).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from jaxtyping import Float

from handstudio.analysis.extremes import extremes
from handstudio.analysis.measure import Measure, missing
from handstudio.analysis.series import AngleSeries
from handstudio.analysis.uncertainty import LEAST_SEM, detectable
from handstudio.arrays import Array
from handstudio.hand.skeleton import FINGERS

TAM_DEG, STRICKLAND_DEG = 260.0, 175.0

_TAM, _STRICKLAND = ("mcp", "pip", "dip"), ("pip", "dip")


def finger_scores(series: AngleSeries) -> list[Measure]:
    """TAM [deg] and Strickland [%] of the four fingers."""
    return [
        score for finger in FINGERS[1:] for score in (_tam(series, finger), _two(series, finger))
    ]


def summed_flexion(angles: Float[Array, "n j"]) -> Float[Array, " n"]:
    """Sum of flexions of each instant, hyperextension as nothing; NaN where one is unknown."""
    total: Array = np.maximum(angles, 0.0).sum(axis=1)
    return total


def tam_grade(share: float) -> Literal["excellent", "good", "fair", "poor"]:
    """Of total active motion as a share of what is full, 1 the whole."""
    if share >= 1.0:
        return "excellent"
    return "good" if share > 0.75 else "fair" if share > 0.5 else "poor"


def strickland_grade(share: float) -> Literal["excellent", "good", "fair", "poor"]:
    """Of the original classification."""
    if share >= 0.85:
        return "excellent"
    return "good" if share >= 0.70 else "fair" if share >= 0.50 else "poor"


def _tam(series: AngleSeries, finger: str) -> Measure:
    found = _score(series, finger, _TAM)
    if found is None:
        return missing("tam", finger, "deg", _why(series, finger, _TAM))
    value, sd, details = found
    floor = LEAST_SEM * np.sqrt(len(_TAM))
    return Measure(
        "tam",
        finger,
        value,
        "deg",
        sd=sd,
        norm=TAM_DEG,
        detectable=float(np.rad2deg(detectable(float(np.deg2rad(sd)), floor))),
        grade=tam_grade(value / TAM_DEG),
        details=details,
    )


def _two(series: AngleSeries, finger: str) -> Measure:
    found = _score(series, finger, _STRICKLAND)
    if found is None:
        return missing("strickland", finger, "%", _why(series, finger, _STRICKLAND))
    percent = 100.0 / STRICKLAND_DEG
    value, sd, details = found
    floor = float(np.rad2deg(LEAST_SEM)) * np.sqrt(len(_STRICKLAND)) * percent
    return Measure(
        "strickland",
        finger,
        value * percent,
        "%",
        sd=sd * percent,
        norm=100.0,
        detectable=detectable(sd * percent, floor),
        grade=strickland_grade(value / STRICKLAND_DEG),
        details=details,
    )


def _score(
    series: AngleSeries, finger: str, joints: Sequence[str]
) -> tuple[float, float, dict[str, float]] | None:
    names = [f"{finger}_{joint}_flexion" for joint in joints]
    if any(name not in series for name in names):
        return None
    angles = np.stack([series.of(name) for name in names], axis=1)
    found = extremes(series.time_s, summed_flexion(angles))
    if found is None:
        return None
    fist, open_ = found.most_at, found.least_at
    # a sum of joints is the turn of the last bone in the first: what a board between errs adds to
    # one joint and is missing at the next, so that of each end joint one of two boards is left
    ends = [(name, at) for name in (names[0], names[-1]) for at in (fist, open_)]
    # a joint that is straight or beyond counts as straight, whatever its zero
    lacking = [series.sd_at(n, at) for n, at in ends if at == fist or series.of(n)[at] > 0.0]
    details = {
        "flexion_deg": float(np.rad2deg(found.most)),
        "deficit_deg": float(np.rad2deg(found.least)),
        "flexion_at_s": float(series.time_s[fist]),
        "extension_at_s": float(series.time_s[open_]),
    }
    value, sd = found.most - found.least, float(np.linalg.norm(lacking) / np.sqrt(2.0))
    return float(np.rad2deg(value)), float(np.rad2deg(sd)), details


def _why(
    series: AngleSeries, finger: str, joints: Sequence[str]
) -> Literal["no_sensor", "in_doubt"]:
    there = all(f"{finger}_{joint}_flexion" in series for joint in joints)
    return "in_doubt" if there else "no_sensor"
