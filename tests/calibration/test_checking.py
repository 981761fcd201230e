"""A check tells a glove that stayed on from one that was put on again."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from benchmarks.checked import checks, figures, turned
from handstudio.calibration.checking import LIMIT_UNCALIBRATED_DEG, check
from handstudio.calibration.heading import CALIBRATED
from handstudio.calibration.quick_start import quick_start
from handstudio.calibration.solve import found
from handstudio.calibration.subject import SubjectCalibration
from handstudio.calibration.swings import Swings, prepared
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.subject import subject
from handstudio.simulation.worn import begin, sense, wear

PERSON = 103
LIMIT = LIMIT_UNCALIBRATED_DEG  # nobody calibrated these sensors
LAYOUT = glove("right")


@lru_cache
def recorded(motion: str, occasion: int, seed: int) -> tuple[Swings, slice]:
    """A performance, prepared, and where in it something else than rests and swings was done."""
    someone = subject(PERSON)
    way = perform(motion, Actor(someone, seed))
    worn = wear(someone, LAYOUT, parse("typical"), PERSON, occasion=occasion)
    time_us = np.arange(round(way.duration_s * 100)) * 10_000
    samples = sense(worn, begin(worn), way, time_us, 100)[0].samples
    labels = sorted((span.start_s, span.end_s, span.name) for span in way.spans)
    aligned, _ = quick_start(
        samples, LAYOUT.names, labels=labels, compass=False, tolerances=CALIBRATED
    )
    swings = prepared(
        LAYOUT,
        100.0,
        samples.gyr,
        samples.acc,
        labels=labels,
        heading=np.array(aligned.psi_wg),
        alive=range(len(LAYOUT.names)),
    )
    start, end, _ = next((x for x in labels if x[2] == "work"), (0.0, 0.0, ""))
    return swings, slice(round(start * 100), round(end * 100))


@pytest.fixture(scope="module")
def calibration() -> SubjectCalibration:
    someone = subject(PERSON)
    hand = found(recorded("calibration", 0, PERSON)[0], someone.side, someone.hand_length_m)
    return SubjectCalibration(
        id="one",
        made_utc="2026-01-01T00:00:00+00:00",
        software="handstudio",
        subject="S01",
        side="right",
        hand_length_m=someone.hand_length_m,
        hand_type=3,
        device="VG-1",
        segments=hand.segments(),
        tips=hand.tips(),
        axes=hand.functional_axes(),
    )


def checked(calibration: SubjectCalibration, occasion: int) -> dict[str, float]:
    swings, grasp = recorded("quick_start+flat_hand+open_close", occasion, 7)
    verdict = check(swings, swings, grasp, calibration, LIMIT)
    assert verdict.ok == all(reading.value <= LIMIT for reading in verdict.readings)
    return {reading.about: reading.value for reading in verdict.readings}


def test_the_same_glove_left_on_passes(calibration):
    off = checked(calibration, 0)
    assert len(off) == 17  # all but the forearm, which has nothing before it
    assert max(off.values()) <= LIMIT


@pytest.mark.parametrize("occasion", [1, 2])
def test_a_glove_put_on_again_is_told_and_where(calibration, occasion):
    off = checked(calibration, occasion)
    assert max(off.values()) > 2.0 * LIMIT
    assert sum(value > LIMIT for value in off.values()) > 6


def test_a_board_that_slipped_is_told_and_where(calibration):
    swings, grasp = recorded("quick_start+flat_hand+open_close", 0, 7)
    by = so3.from_axis_angle(np.array([0.0, 0.6, 0.8]), np.deg2rad(15.0))
    slipped = turned(swings, LAYOUT.names.index("SN16"), by)
    verdict = check(slipped, slipped, grasp, calibration, LIMIT)
    assert {reading.about for reading in verdict.failing} == {"index_intermediate", "index_distal"}
    found = figures([checks(calibration, [(swings, grasp)])], LIMIT)
    most = [found[f"slipped_{deg}_deg"]["noticed_pct"] for deg in (5, 10)]
    assert most[0] + 30.0 < most[1]


def test_a_sensor_that_does_not_answer_is_no_pass(calibration):
    swings, grasp = recorded("quick_start+flat_hand+open_close", 0, 7)
    sensor = next(s.sensor for s in calibration.segments if s.name == "ring_distal")
    dead = LAYOUT.names.index(sensor)
    without = replace(swings, alive=tuple(i for i in swings.alive if i != dead))
    verdict = check(without, without, grasp, calibration)
    (silent,) = [reading for reading in verdict.readings if np.isnan(reading.value)]
    assert silent.about == "ring_distal"
    assert not verdict.ok
