"""All measures of a motion, or of a part of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.analysis.cycles import LEAST_CYCLES, cycle_measures, cycles_of
from handstudio.analysis.finger_scores import finger_scores
from handstudio.analysis.independence import independence_measures
from handstudio.analysis.kapandji import STAGES, clearances, kapandji_measures
from handstudio.analysis.measure import Measure, missing
from handstudio.analysis.posture_time import DEFAULT_BANDS, Band, posture_measures
from handstudio.analysis.range_of_motion import ranges_of_motion, unmeasured
from handstudio.analysis.series import AngleSeries, flexion_beside
from handstudio.analysis.smoothness import smoothness_measures
from handstudio.analysis.speed import speeds, velocity
from handstudio.analysis.tremor import spectrum_of, tremor_measures
from handstudio.analysis.unbroken import rate_of
from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS, HandSide
from handstudio.hand_fit import fit_of
from handstudio.kinematics import doubtful_segments, pose_of
from handstudio.pipeline import Motion
from handstudio.setup import Setup

_BLOCK = 8192

_OPPOSED = ("hand", "hand_ulnar", "thumb_distal", "index_distal", "little_distal")
"""Segments that opposition is read from; none may be in doubt."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What is to be measured beside the angles themselves.

    Attributes:
        labels: Named stretches: begin, end [s] and name. They tell which finger was meant to move.
        bands: Postures whose time is counted.
    """

    labels: tuple[tuple[float, float, str], ...] = ()
    bands: tuple[Band, ...] = DEFAULT_BANDS


def measures_of(
    setup: Setup,
    motion: Motion,
    series: AngleSeries,
    asked: Asked | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> list[Measure]:
    """Every measure of a hand, in the order in which they are told.

    Raises:
        LayoutError: the layout is not a hand's.
    """
    asked = asked or Asked()
    out = ranges_of_motion(series) + unmeasured(series.names) + finger_scores(series)
    out += _opposition(setup, motion, series)
    progress(0.3)
    moved = []
    fastest = dict[str, float]()
    for done, name in enumerate(
        sorted(series.names, key=lambda each: flexion_beside(each) != each)
    ):
        moved += _movement(series, name, fastest)
        progress(0.3 + 0.5 * (done + 1) / len(series.names))
    if not any(measure.kind == "cycles" for measure in moved):
        moved.append(missing("cycles", "", "", "no_movement"))
    places = {name: place for place, name in enumerate((*series.names, ""))}
    out += sorted(moved, key=lambda m: (_ORDER.index(m.kind), places[m.about]))
    for name in tremor_angles(series):
        out += tremor_measures(series, name, spectrum_of(series.time_s, series.of(name)))
    out += independence_measures(series, asked.labels)
    out += posture_measures(series, asked.bands)
    progress(1.0)
    return out


def tremor_angles(series: AngleSeries) -> Sequence[str]:
    """Angles in which tremor is looked for: those of the wrist and of the knuckles."""
    wanted = ("forearm_pronation", "wrist_flexion", "wrist_deviation_ulnar", "thumb_mcp_flexion")
    return [n for n in series.names if n in wanted or n.endswith("_mcp_flexion")]


_ORDER = (
    *("cycles", "cycle_amplitude", "cycle_amplitude_cv", "cycle_period", "cycle_period_cv"),
    *("peak_speed", "mean_speed", "sparc", "ldlj"),
)


def _movement(series: AngleSeries, name: str, fastest: dict[str, float]) -> list[Measure]:
    """Speed of every angle; repetitions and smoothness of those that were repeated.

    ``fastest`` keeps the peak speeds of flexions, which come first [rad/s].
    """
    values = series.of(name)
    rates = velocity(series.time_s, values)
    if np.isfinite(rates).any():
        fastest[name] = float(np.nanmax(np.abs(rates)))
    out = speeds(series, name, rates, fastest.get(flexion_beside(name), 0.0))
    cycles = cycles_of(series.time_s, values)
    if len(cycles) >= LEAST_CYCLES:
        out += cycle_measures(series, name, cycles)
        out += smoothness_measures(name, rates, cycles, rate_of(series.time_s))
    return out


def _opposition(setup: Setup, motion: Motion, series: AngleSeries) -> list[Measure]:
    if setup.subject is None:
        return [missing("kapandji", "thumb", "", "no_calibration")]
    if not set(_OPPOSED) <= setup.layout.drivers.keys() or "thumb_cmc_rotation" not in series:
        return [missing("kapandji", "thumb", "", "no_sensor")]
    if not len(motion):
        return [missing("kapandji", "thumb", "", "too_short")]
    return kapandji_measures(
        series.time_s,
        opposition(setup, motion),
        series.of("thumb_cmc_rotation"),
        series.sds("thumb_cmc_rotation"),
    )


def opposition(setup: Setup, motion: Motion) -> Float[Array, "n 10"]:
    """Clearances of the thumb's tip (`kapandji.clearances`); NaN where the pose is in doubt."""
    fit = fit_of(setup)
    side: HandSide = fit.skeleton.side
    hand_length = setup.subject.hand_length_m if setup.subject else setup.hand.hand_length_m
    needed = [SEGMENTS.index(name) for name in _OPPOSED]
    out = np.empty((len(motion), STAGES))
    for at in range(0, len(motion), _BLOCK):
        part = motion[at : at + _BLOCK]
        pose = pose_of(setup, np.asarray(part.q_world_sensor), fit)
        block = clearances(pose, fit.skeleton.length_m, hand_length, side)
        block[doubtful_segments(setup, np.asarray(part.doubt))[:, needed].any(axis=1)] = np.nan
        out[at : at + _BLOCK] = block
    return out
