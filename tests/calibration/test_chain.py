"""All joint centres at once, axes, frames and rocking boards, on people whose truth is known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.attitudes import attitudes_between_rests, unbiased
from handstudio.calibration.axes import principal_axis
from handstudio.calibration.rocking import leaning, rocking
from handstudio.calibration.solve import Found, found
from handstudio.calibration.swings import Swings, prepared
from handstudio.hand.skeleton import JOINTS, SEGMENTS
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.subject import subject, with_fixed_axes
from handstudio.simulation.worn import Worn, begin, sense, wear

RATE_HZ = 100
COURSE = "+".join(
    (
        "static",
        "elbow:flexion",
        "wrist:flexion",
        "wrist:deviation",
        "index_mcp:flexion",
        "index_mcp:abduction",
        "index_pip:flexion",
        "index_dip:flexion",
        "flat_hand",
    )
)
SWUNG = ("index_mcp", "index_pip", "index_dip")


@dataclass(frozen=True)
class Done:
    """A course done by a person, and what was true."""

    worn: Worn
    swings: Swings
    q_world_sensor: Array
    hand: Found


@cache
def done(imperfections: str, intermediate: float | None = None) -> Done:
    """The course of one finger by a person whose joints are hinges.

    ``intermediate`` is how the board between PIP and DIP rocks with the PIP [rad/rad].
    """
    someone = with_fixed_axes(subject(3))
    trajectory = perform(COURSE, Actor(someone, 5))
    worn = wear(someone, glove(), parse(imperfections), 5)
    if intermediate is not None:
        tilts = worn.skin.tilts.copy()
        tilts[0, glove().names.index("SN16"), 0] = intermediate
        worn = replace(worn, skin=replace(worn.skin, tilts=tilts))
    time_us = np.arange(round(trajectory.duration_s * RATE_HZ)) * (1_000_000 // RATE_HZ)
    sensed, _ = sense(worn, begin(worn), trajectory, time_us, RATE_HZ)
    truth = sensed.truth
    labels = sorted((span.start_s, span.end_s, span.name) for span in trajectory.spans)
    at_rest = attitude(sensed.samples.acc[50:150].mean(axis=0))
    heading = so3.heading(so3.multiply(truth.q_world_sensor[100], so3.conjugate(at_rest)))
    swings = prepared(
        glove(),
        float(RATE_HZ),
        sensed.samples.gyr,
        sensed.samples.acc,
        labels=labels,
        heading=heading,
        alive=range(20),
    )
    hand = found(swings, "right", someone.hand_length_m)
    return Done(worn, swings, truth.q_world_sensor, hand)


def test_attitudes_of_perfect_sensors_are_the_true_ones() -> None:
    it = done("ideal")
    off = so3.angle_between(it.swings.q_world_sensor, it.q_world_sensor)
    assert np.rad2deg(off.max()) < 0.1


def test_a_rest_in_which_a_sensor_slipped_tells_no_bias() -> None:
    rng = np.random.default_rng(2)
    gyr = 0.01 + 1e-4 * rng.standard_normal((900, 2, 3))
    rests = [slice(0, 200), slice(300, 500), slice(600, 800)]
    gyr[350:450, 1, 2] += 0.02
    free = unbiased(gyr, rests)
    assert np.abs(free[300:340]).max() < 1e-3
    assert free[400, 1, 2] > 0.015


def test_tilt_drift_between_rests_is_laid_out() -> None:
    n, time_s = 1000, np.arange(1000) / 100.0
    gyr = np.zeros((n, 1, 3))
    gyr[:, 0, 0] = np.deg2rad(0.3)  # a drift that is none: the sensor lies still
    acc = np.tile([0.0, 0.0, 9.80665], (n, 1, 1))
    q = attitudes_between_rests(time_s, gyr, acc, [slice(0, 50), slice(950, 1000)], np.zeros(1))
    assert np.rad2deg(so3.angle_between(q[:975, 0], so3.IDENTITY).max()) < 0.05


def test_a_principal_axis_is_that_of_the_whole_rotation() -> None:
    rng = np.random.default_rng(0)
    axis = so3.rotate(so3.exp(np.array([0.3, -0.2, 0.5])), np.array([1.0, 0.0, 0.0]))
    swing = np.sin(np.linspace(0.0, 50.0, 800))
    rates = swing[:, None] * axis + 0.02 * rng.standard_normal((800, 3))
    got, sd = principal_axis(rates)
    assert abs(got @ axis) > np.cos(np.deg2rad(0.2))
    assert 0.0 < sd < np.deg2rad(2.0)


def _off_centre_mm(it: Done, joint: str) -> Array:
    """Of the joint's centre in the sensor beyond it, along and beside the axis."""
    sensor = it.swings.drivers(joint)[1]
    assert sensor is not None
    mounting = it.worn.mounting
    seen = so3.conjugate(mounting.q_segment_sensor[sensor])
    true = so3.rotate(seen, mounting.t_segment_sensor[sensor])
    off = 1e3 * (it.hand.chain.sensor(sensor)[0] - true)
    n = so3.rotate(seen, np.array([1.0, 0.0, 0.0]))
    return np.array([off @ n, np.linalg.norm(off - n * (off @ n))])


@pytest.mark.parametrize("joint", SWUNG)
def test_centres_of_hinges_are_found_beside_their_axis(joint: str) -> None:
    assert _off_centre_mm(done("ideal"), joint)[1] < 1.0


def test_links_of_perfect_sensors_have_their_lengths() -> None:
    it = done("ideal")
    skeleton = it.worn.subject.skeleton
    for joint in ("index_pip", "index_dip"):
        k = [j.name for j in JOINTS].index(joint)
        true = np.linalg.norm(skeleton.t_parent_joint[k])
        got = np.linalg.norm(it.hand.chain.link(joint)[0])
        assert abs(got - true) < 0.001


def test_axes_of_perfect_sensors_are_the_frames_own() -> None:
    it = done("ideal")
    for joint in ("wrist", *SWUNG):
        sensor = it.swings.drivers(joint)[1]
        assert sensor is not None
        seen = so3.conjugate(it.worn.mounting.q_segment_sensor[sensor])
        true = so3.rotate(seen, np.array([1.0, 0.0, 0.0]))
        got = it.hand.axes[joint].seen_from(it.swings, sensor)
        assert np.rad2deg(np.arccos(got @ true)) < 1.0


def test_frames_are_the_persons_own_where_they_were_swung() -> None:
    it = done("ideal")
    for name in ("index_proximal", "index_intermediate", "index_distal"):
        k = SEGMENTS.index(name)
        sensor = it.hand.frames.driver[k]
        assert sensor is not None
        true = so3.conjugate(it.worn.mounting.q_segment_sensor[sensor])
        assert np.rad2deg(so3.angle_between(it.hand.frames.q_sensor_segment[k], true)) < 1.5


def test_a_board_that_rocks_is_noticed() -> None:
    it = done("rock=2")
    found_rocking = rocking(it.swings, it.hand.axes)
    proximal = it.swings.layout.names.index("SN15")
    true = it.worn.skin.tilts[0, proximal, 0]
    # flexion turns about minus x, and the axis found is the one of extension
    assert abs(found_rocking[proximal, "index_mcp"] - true) < 0.01
    kept = {(rock.sensor, rock.joint): rock.share for rock in it.hand.rocks()}
    assert abs(kept["SN15", "index_mcp"] - true) < 0.01


def test_a_board_between_two_joints_that_bend_together_is_told_by_accelerations() -> None:
    """Half of it at least: what nobody knew before pulls towards none."""
    got = []
    for true in (-0.06, 0.06):
        it = done("rock=1", true)
        kept = {(rock.sensor, rock.joint): rock.share for rock in it.hand.rocks()}
        got.append(kept["SN16", "index_pip"])
    assert 0.06 < got[1] - got[0] < 0.14
    intermediate = it.swings.layout.names.index("SN16")
    assert leaning(it.swings, it.hand.axes, it.hand.chain)[intermediate, "index_pip"] == got[1]


def test_what_was_not_swung_rests_on_proportions_and_says_so() -> None:
    segments = {segment.name: segment for segment in done("ideal").hand.segments()}
    assert segments["index_proximal"].length_source == "measured"
    assert segments["little_proximal"].length_source != "measured"
