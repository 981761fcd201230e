"""Hands whose palm is divided otherwise: one block, and two that both begin at the wrist."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from handstudio.calibration.checking import lying_off
from handstudio.calibration.opening import opened
from handstudio.calibration.recorded import even
from handstudio.calibration.solve import Found, found
from handstudio.calibration.subject import SubjectCalibration
from handstudio.calibration.swings import Swings
from handstudio.errors import CalibrationError
from handstudio.hand.angles import hand_angles
from handstudio.hand.skeleton import SEGMENTS, HandType
from handstudio.hand_fit import mechanism_of
from handstudio.kinematics import measured_angles, pose_of
from handstudio.layout import Layout, glove
from handstudio.maths import so3
from handstudio.samples import ImuSamples
from handstudio.setup import Setup, divided
from handstudio.setup import calibrated as with_calibration
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.rig import Truth
from handstudio.simulation.subject import subject
from handstudio.simulation.worn import begin, sense, wear

PERSON = 2
COURSE = (
    "quick_start+elbow:flexion+wrist:flexion+wrist:deviation+ulnar_cmc:flexion+ring_mcp:flexion"
    "+ring_mcp:abduction+ring_pip:flexion+flat_hand"
)
WHOLE = ("SN1", "SN4", "SN8", "SN9", "SN11")  # as far as these joints go
REDUCED = ("SN1", "SN8", "SN9", "SN11")
RING = SEGMENTS.index("ring_proximal")


@lru_cache
def recorded(sensors: tuple[str, ...]) -> tuple[ImuSamples, Truth, list[tuple[float, float, str]]]:
    someone = subject(PERSON)
    way = perform(COURSE, Actor(someone, 3))
    worn = wear(someone, glove("right", sensors), parse("plain"), 3)
    time_us = np.arange(round(way.duration_s * 100)) * 10_000
    sensed = sense(worn, begin(worn), way, time_us, 100)[0]
    labels = sorted((span.start_s, span.end_s, span.name) for span in way.spans)
    return sensed.samples, sensed.truth, labels


def prepared(layout: Layout) -> Swings:
    samples, _, labels = recorded(layout.names)
    known = even([samples], 100.0, None, layout.names)
    return opened(layout, 100.0, known, labels, calibrated=False)


@lru_cache
def calibrated(sensors: tuple[str, ...], hand_type: HandType | None) -> Found:
    someone = subject(PERSON)
    layout = glove("right", sensors, hand_type)
    return found(prepared(layout), someone.side, someone.hand_length_m)


def from_wrist(hand: Found) -> np.ndarray:
    """The ring finger's MCP in the hand block, seen from the wrist, the hand lying flat."""
    block, frames = SEGMENTS.index("hand_ulnar"), hand.frames
    there = so3.rotate(frames.q_parent_rest[block], frames.t_parent_joint[RING])
    return np.asarray(frames.t_parent_joint[block] + there)


def true_distance_m() -> float:
    truth, hand = recorded(WHOLE)[1], SEGMENTS.index("hand")
    apart = truth.t_world_joint[0, RING] - truth.t_world_joint[0, hand]
    return float(np.linalg.norm(apart))


def test_a_glove_without_a_sensor_on_the_ulnar_block_has_one_rigid_palm_and_finds_its_knuckles():
    hand = calibrated(REDUCED, None)
    segments = {segment.name: segment for segment in hand.segments()}
    assert hand.swings.layout.hand_type == 1
    assert segments["hand_ulnar"].sensor == ""
    assert segments["hand_ulnar"].t_parent_joint == (0.0, 0.0, 0.0)
    assert segments["ring_proximal"].source != "proportions"
    assert {"ring_mcp", "ring_pip"} <= hand.axes.keys()
    assert "ulnar_cmc" not in hand.axes
    seen_from = {c.sensor for c in hand.centres() if c.joint == "ring_mcp"}
    assert seen_from == {"SN8", "SN11"}
    assert float(np.linalg.norm(from_wrist(hand))) == pytest.approx(true_distance_m(), abs=0.006)


@pytest.mark.parametrize("hand_type", [1, 2, 3])
def test_every_type_places_the_knuckle_of_the_ring_finger_at_the_flat_hand(hand_type):
    hand = calibrated(WHOLE, hand_type)
    assert float(np.linalg.norm(from_wrist(hand))) == pytest.approx(true_distance_m(), abs=0.006)
    assert ("ulnar_cmc" in hand.axes) == (hand_type == 3)


def test_with_two_blocks_from_the_wrist_the_ulnar_one_turns_about_the_wrists_axis():
    hand = calibrated(WHOLE, 2)
    (block,) = [s for s in hand.segments() if s.name == "hand_ulnar"]
    assert block.sensor == "SN4"
    assert block.t_parent_joint == (0.0, 0.0, 0.0)
    sn4 = hand.swings.layout.names.index("SN4")
    x = so3.rotate(np.array(block.q_sensor_segment), np.array([1.0, 0.0, 0.0]))
    assert x == pytest.approx(hand.axes["wrist"].seen_from(hand.swings, sn4))


def test_a_second_sensor_of_a_rigid_palm_does_not_stand_for_it():
    hand = calibrated(WHOLE, 1)
    assert {s.name: s.sensor for s in hand.segments()}["hand"] == "SN11"


def test_a_check_holds_a_rigid_palms_fingers_against_the_hand_block():
    hand = calibrated(REDUCED, None)
    calibration = SubjectCalibration(
        "one", "", "", "S01", "right", subject(PERSON).hand_length_m, 1, "",
        hand.segments(), hand.tips(), hand.centres(), hand.functional_axes(),
    )  # fmt: skip
    off = lying_off(hand.swings, calibration)
    assert off.keys() == {"hand", "ring_proximal", "ring_intermediate"}
    # all but what was found of rocking is as it was
    assert max(off.values()) < np.deg2rad(1.0)


# --- what is shown of them ---------------------------------------------------------------------


def attitudes(layout: Layout, folded: float) -> np.ndarray:
    """All sensors level but that of the ulnar block, which is turned about x."""
    q = np.tile(so3.IDENTITY, (1, len(layout.names), 1))
    q[0, layout.names.index("SN4")] = so3.from_axis_angle(np.array([1.0, 0.0, 0.0]), folded)
    return q


@pytest.mark.parametrize("hand_type", [1, 2, 3])
def test_all_types_show_the_same_flat_hand(hand_type):
    layout = glove(hand_type=hand_type)
    flat, hinged = (pose_of(Setup(x, 100.0), attitudes(x, 0.0)) for x in (layout, glove()))
    assert flat.t_world_tip == pytest.approx(hinged.t_world_tip)
    ulnar = SEGMENTS.index("hand_ulnar")
    here = np.delete(flat.t_world_joint, ulnar, axis=1)
    assert here == pytest.approx(np.delete(hinged.t_world_joint, ulnar, axis=1))


def test_what_turns_the_ulnar_block_moves_its_knuckles_about_nothing_the_wrist_or_the_hinge():
    moved = {}
    for hand_type in (1, 2, 3):
        layout = glove(hand_type=hand_type)
        setup = Setup(layout, 100.0)
        poses = [pose_of(setup, attitudes(layout, angle)) for angle in (0.0, -0.3)]
        before, after = (pose.t_world_joint[0, RING] for pose in poses)
        wrist = poses[0].t_world_joint[0, SEGMENTS.index("hand")]
        moved[hand_type] = float(np.linalg.norm(after - before))
        if hand_type == 2:
            assert np.linalg.norm(after - wrist) == pytest.approx(np.linalg.norm(before - wrist))
    assert moved[1] == 0.0
    assert moved[2] > 1.3 * moved[3] > 0.0


@pytest.mark.parametrize(("hand_type", "absent"), [(1, True), (2, True), (3, False)])
def test_a_palm_without_a_hinge_has_no_angle_of_it_and_all_others(hand_type, absent):
    names = {angle.name for angle in measured_angles(glove(hand_type=hand_type))}
    every = {angle.name for angle in hand_angles()}
    assert every - names == ({"ulnar_cmc_flexion"} if absent else set())


def test_filters_see_the_joints_of_each_type():
    at = {name: k for k, name in enumerate(glove().names)}
    found = {t: mechanism_of(Setup(glove(hand_type=t), 100.0)) for t in (1, 2, 3)}
    for hand_type, above_block, above_finger in (
        (1, -1, "SN11"),
        (2, "SN1", "SN4"),
        (3, "SN11", "SN4"),
    ):
        mechanism = found[hand_type]
        assert mechanism.parent[at["SN4"]] == at.get(above_block, -1)
        assert mechanism.parent[at["SN8"]] == at[above_finger]
    # from SN11 to the knuckle, whatever lies between: at the flat hand it is one place
    seen = found[1].t_parent_joint[at["SN8"]]
    block = found[3].t_parent_joint[at["SN4"]] - found[3].t_sensor_joint[at["SN4"]]
    assert seen == pytest.approx(block + found[3].t_parent_joint[at["SN8"]])


def test_a_calibration_divides_the_palm_of_the_glove_it_is_used_on():
    hand = calibrated(WHOLE, 2)
    calibration = SubjectCalibration(
        "one", "", "", "S01", "right", subject(PERSON).hand_length_m, 2, "",
        hand.segments(), hand.tips(), hand.centres(), hand.functional_axes(),
    )  # fmt: skip
    assert with_calibration(Setup(glove(), 100.0), subject=calibration).layout == glove(hand_type=2)
    # nothing is there that could tell two blocks apart
    few = Setup(glove("right", REDUCED), 100.0)
    assert with_calibration(few, subject=calibration).layout == few.layout
    with pytest.raises(CalibrationError, match="type 2, not 1"):
        divided(with_calibration(Setup(glove(), 100.0), subject=calibration), 1)
