"""What is measured of virtual people against what they truly did, within the uncertainty told.

People 101 and 102: nothing was chosen on them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.trials import Calibration, Trial, follow
from handstudio.analysis.measure import Measure
from handstudio.analysis.series import AngleSeries, series_of
from handstudio.analysis.whole import measures_of
from handstudio.hand.angles import hand_angles
from handstudio.simulation.imperfections.strengths import parse

MOTION = "quick_start+joint_by_joint+open_close"

Pairs = dict[str, list[tuple[float, float]]]


def measured_and_true(person: int, imperfections: str, calibration: Calibration) -> Pairs:
    """Errors and standard uncertainties of every measure that both have, by kind."""
    aligned = calibration == "truth"
    trial = Trial(
        person, MOTION, parse(imperfections), person, calibration=calibration, align=aligned
    )
    followed = follow(trial)
    begin = int(np.flatnonzero(followed.compared)[0])
    motion = followed.motion[begin:]
    got = series_of(followed.setup, motion)
    names = [angle.name for angle in hand_angles()]
    columns = [names.index(name) for name in got.names]
    angles = np.asarray(followed.truth.angles[begin:][:, columns], dtype=float)
    true = replace(got, angles=angles, sd=np.zeros_like(got.sd))
    assert isinstance(true, AngleSeries)
    known = {
        (m.kind, m.about): m
        for m in measures_of(followed.setup, motion, true)
        if m.value is not None
    }
    return _paired(measures_of(followed.setup, motion, got), known)


def _paired(got: list[Measure], known: dict[tuple[str, str], Measure]) -> Pairs:
    pairs: Pairs = {}
    for measure in got:
        true = known.get((measure.kind, measure.about))
        if measure.value is not None and measure.sd and true is not None:
            error = float(measure.value) - float(true.value)  # type: ignore[arg-type]
            pairs.setdefault(measure.kind, []).append((error, measure.sd))
    return pairs


def held(pairs: Pairs, kind: str) -> tuple[float, float, float]:
    """RMS error, share within two standard uncertainties, RMS of error over uncertainty."""
    error, sd = np.array(pairs[kind]).T
    return (
        float(np.sqrt(np.mean(error**2))),
        float(np.mean(np.abs(error) <= 2.0 * sd)),
        float(np.sqrt(np.mean((error / sd) ** 2))),
    )


@pytest.mark.parametrize("person", [101, 102])
def test_ranges_and_scores_hold_within_their_uncertainty_where_skin_is_still(person):
    pairs = measured_and_true(person, "typical,-soft_tissue", "truth")
    for kind in ("least", "most", "range"):
        rms, within, ratio = held(pairs, kind)
        assert rms < 3.0, kind
        assert within >= 0.9, kind
        assert ratio < 1.3, kind
    rms, within, _ratio = held(pairs, "tam")
    assert rms < 6.0
    assert within == 1.0
    assert held(pairs, "cycle_amplitude")[1] >= 0.9


@pytest.mark.long
@pytest.mark.parametrize("person", [101, 102])
def test_and_with_skin_sensors_and_a_calibration_of_their_own(person):
    pairs = measured_and_true(person, "typical", "own")
    for kind in ("least", "most", "range", "tam", "strickland", "cycle_amplitude", "mean_speed"):
        rms, within, ratio = held(pairs, kind)
        print(f"{person} {kind}: RMS {rms:.2f}, within two sd {within:.2f}, ratio {ratio:.2f}")
        # of 18 values two are outside one time in five even where 95 % hold
        assert (1.0 - within) * len(pairs[kind]) < 0.1 * len(pairs[kind]) + 1.0, kind
        assert 0.15 < ratio < 1.2, kind
    assert held(pairs, "most")[0] < 4.0


@pytest.mark.long
def test_what_was_never_seen_is_told_as_wide():
    pairs = measured_and_true(101, "typical", "nominal")
    error, within, ratio = held(pairs, "most")
    assert error > 4.0  # the mounting's tilt
    assert within >= 0.85
    assert ratio < 1.5
