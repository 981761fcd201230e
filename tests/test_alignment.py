"""Headings: a flat hand shows flat after a reset; a recording's own quick start aligns it."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from handstudio import alignment, pipeline
from handstudio.arrays import Array
from handstudio.errors import CalibrationError, LayoutError
from handstudio.hand.skeleton import SEGMENTS
from handstudio.hand_fit import fit_of
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.pipeline import Motion, unsure
from handstudio.samples import ImuSamples
from handstudio.setup import Setup
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.subject import subject
from handstudio.simulation.worn import begin, sense, wear

LAYOUT = glove("right")
SETUP = Setup(LAYOUT, 100.0)
RNG = np.random.default_rng(5)


def flat(yaw: float = 0.7) -> Array:
    """Sensors of a hand that truly lies flat, pointing anywhere."""
    rest = alignment._at_flat_hand(fit_of(SETUP).skeleton)
    own = [SEGMENTS.index(place.segment) for place in LAYOUT.sensors]
    return so3.multiply(so3.about_z(yaw), rest[own])


def shown(setup: Setup, q_world_sensor: Array) -> Array:
    """What the pipeline makes of attitudes before their headings are turned."""
    return so3.multiply(so3.about_z(np.array(setup.heading_rad)), q_world_sensor)


def test_after_a_reset_a_hand_that_lies_flat_is_shown_flat_where_its_own_sensor_points():
    truth, off = flat(), RNG.normal(0.0, 0.4, len(LAYOUT.sensors))
    seen = so3.multiply(so3.about_z(off), truth)
    after = shown(alignment.reset(SETUP, seen), seen)
    hand = LAYOUT.drivers["hand"]
    expected = so3.multiply(so3.about_z(off[hand]), truth)
    assert so3.angle_between(after, expected).max() < 1e-9
    assert alignment.reset(SETUP, seen).heading_rad[hand] == pytest.approx(0.0, abs=1e-12)


def test_a_tilt_stays_as_it_is_and_a_second_reset_changes_nothing():
    off = RNG.normal(0.0, 0.2, (len(LAYOUT.sensors), 3))
    seen = so3.multiply(so3.exp(off), flat())
    once = alignment.reset(SETUP, seen)
    up = so3.rotate(so3.conjugate(seen), np.array([0.0, 0.0, 1.0]))
    still_up = so3.rotate(so3.conjugate(shown(once, seen)), np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(still_up, up, atol=1e-12)
    twice = alignment.reset(once, shown(once, seen))
    np.testing.assert_allclose(twice.heading_rad, once.heading_rad, atol=1e-12)


def test_the_reset_of_one_sensor_turns_that_one_alone():
    seen = so3.multiply(so3.about_z(RNG.normal(0.0, 0.3, len(LAYOUT.sensors))), flat())
    before = alignment.reset(SETUP, seen)
    moved = shown(before, seen)
    moved[5] = so3.multiply(so3.about_z(0.25), moved[5])
    after = alignment.reset(before, moved, LAYOUT.names[5])
    change = np.array(after.heading_rad) - np.array(before.heading_rad)
    assert change[5] == pytest.approx(-0.25)
    assert np.delete(change, 5) == pytest.approx(0.0)


def test_the_hands_own_sensor_is_held_against_the_forearm():
    hand = LAYOUT.drivers["hand"]
    seen = flat()
    seen[hand] = so3.multiply(so3.about_z(0.3), seen[hand])
    after = alignment.reset(SETUP, seen, LAYOUT.names[hand])
    assert after.heading_rad[hand] == pytest.approx(-0.3)


def test_a_sensor_that_does_not_know_its_attitude_stays():
    placed = np.ones(len(LAYOUT.sensors), dtype=bool)
    placed[4] = False
    seen = so3.multiply(so3.about_z(np.full(len(LAYOUT.sensors), 0.2)), flat())
    seen[4] = so3.IDENTITY
    assert alignment.reset(SETUP, seen, None, placed).heading_rad[4] == 0.0
    with pytest.raises(CalibrationError, match="how it lies"):
        alignment.reset(SETUP, seen, None, ~placed & placed)


def test_what_cannot_be_reset_is_said():
    with pytest.raises(CalibrationError, match="no sensor SN99"):
        alignment.reset(SETUP, flat(), "SN99")
    nobody = msgspec.structs.replace(SETUP, layout=glove("unknown"))
    with pytest.raises(LayoutError):
        alignment.reset(nobody, flat())


def test_what_lies_between_two_setups_takes_motion_from_one_to_the_other():
    n = len(LAYOUT.sensors)
    one, other = (
        msgspec.structs.replace(SETUP, heading_rad=tuple(RNG.normal(size=n))) for _ in range(2)
    )
    doubt = np.zeros((1, n), dtype=np.uint8)
    raw = Motion(np.zeros(1, dtype=np.int64), flat()[None], flat()[:1], doubt, unsure(doubt))
    carried = pipeline.turned(alignment.between(one, other), pipeline.turned(one, raw))
    direct = pipeline.turned(other, raw)
    assert so3.angle_between(carried.q_world_sensor, direct.q_world_sensor).max() < 1e-9
    assert so3.angle_between(carried.q_world_start, direct.q_world_start).max() < 1e-9


@pytest.fixture(scope="module")
def quick() -> tuple[Setup, ImuSamples, Array]:
    """A virtual person's quick start, and how every sensor truly lies at its first instant."""
    someone = subject(2)
    way = perform("quick_start", Actor(someone, 2))
    worn = wear(someone, LAYOUT, parse("typical"), 2)
    time_us = np.arange(round(way.duration_s * 100)) * 10_000
    sensed, _ = sense(worn, begin(worn), way, time_us, 100)
    return SETUP, sensed.samples, sensed.truth.q_world_sensor


def test_headings_of_a_take_agree_better_by_its_own_quick_start(quick):
    setup, samples, q_true = quick
    after, found = alignment.aligned(setup, [samples])
    assert found.verdict.ok
    assert after.heading_rad == found.psi_cor
    at = 100
    spread = []
    for one in (setup, after):
        motion, _ = pipeline.run(one, pipeline.begin(one), [samples])
        off = so3.heading(so3.multiply(motion.q_world_sensor[at], so3.conjugate(q_true[at])))
        spread.append(float(np.rad2deg(np.std(off))))
    assert spread[1] < 0.5 * spread[0]
    assert spread[1] < 1.5


def test_a_take_without_a_quick_start_is_refused(quick):
    setup, samples, _ = quick
    with pytest.raises(CalibrationError, match="No quick start"):
        alignment.aligned(setup, [samples[:150]])
