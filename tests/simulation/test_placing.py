"""Placing against the rig, and its slopes against differences."""

import numpy as np
import pytest

from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.mechanism import hand_moving
from handstudio.simulation.placing import TURNS, limits, outwards, placer, skin
from handstudio.simulation.postures import channels
from handstudio.simulation.subject import subject
from handstudio.simulation.trajectory import CHANNELS, through_stops

people = pytest.mark.parametrize(("number", "side"), [(0, "right"), (3, "right"), (8, "left")])


def postures() -> np.ndarray:
    return np.random.default_rng(4).uniform(-1.0, 1.0, size=(5, CHANNELS))


@people
def test_a_hand_is_placed_where_the_rig_has_it(number, side):
    someone, some = subject(number, side), postures()
    some[:, TURNS:] = 0.0
    joints = through_stops(np.arange(5.0), some).at(np.arange(5.0))
    expected = hand_moving(someone.skeleton, someone.mechanism, joints, so3.IDENTITY)
    placed = placer(someone).placed(some)
    np.testing.assert_allclose(placed.place, expected.t, atol=1e-14)
    np.testing.assert_allclose(placed.attitude, so3.to_matrix(expected.q), atol=1e-13)


@people
def test_points_move_with_channels_as_differences_say(number, side):
    place, some, h = placer(subject(number, side)), postures(), 1e-5
    segments = [SEGMENTS.index(name) for name in ("thumb_distal", "ring_intermediate", "hand")]
    offsets = np.array([[0.0, 0.01, -0.01], [0.01, 0.0, 0.0], [0.0, 0.05, 0.0]])
    here = place.placed(some)
    slopes = here.slopes(here.points(segments, offsets), segments, list(range(TURNS)))
    for channel in range(TURNS):
        step = np.zeros(CHANNELS)
        step[channel] = h
        ahead, behind = (place.placed(some + s).points(segments, offsets) for s in (step, -step))
        np.testing.assert_allclose(slopes[..., channel], (ahead - behind) / (2 * h), atol=1e-9)


def test_skin_lies_on_the_palm_side_and_turns_to_the_thumb():
    right, left = subject(0, "right"), subject(0, "left")
    half = right.half_depth_m[SEGMENTS.index("index_distal")]
    far = right.skeleton.length_m[SEGMENTS.index("index_distal")]
    np.testing.assert_allclose(skin(right, "index_distal", 0.5), [0.0, 0.5 * far, -half])
    np.testing.assert_allclose(outwards(right, 90.0), [-1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(outwards(left, 90.0), [1.0, 0.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("side", ["right", "left"])
def test_limits_have_clinical_signs(side):
    least, most = limits(subject(0, side))
    able = {"index_pip_flexion": 100.0, "thumb_cmc_abduction": 50.0, "forearm_pronation": -150.0}
    able |= {"wrist_deviation_ulnar": 29.0, "elbow_flexion": 100.0, "wrist_flexion": -60.0}
    unable = {"index_pip_flexion": -20.0, "thumb_cmc_abduction": -30.0, "forearm_pronation": 40.0}
    unable |= {"wrist_deviation_ulnar": -25.0, "elbow_flexion": -30.0, "wrist_flexion": 90.0}
    for posture, allowed in ((able, True), (unable, False)):
        for name, value in posture.items():
            posed = channels({name: value}, side)
            assert bool(np.all((least <= posed) & (posed <= most))) is allowed, name
