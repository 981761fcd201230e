"""From the orientations of sensors to a hand: against the truth of a simulated one."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from handstudio import pipeline
from handstudio.calibration.subject import Axis, Rock, Segment, SubjectCalibration
from handstudio.errors import LayoutError
from handstudio.hand.angles import ROOT_ANGLES, hand_angles
from handstudio.hand.skeleton import PARENTS, SEGMENTS, nominal_skeleton
from handstudio.hand_fit import fit_of, skin_of_calibration
from handstudio.kinematics import (
    angles_of,
    doubtful_segments,
    exported_angles,
    has_start,
    measured_angles,
    pose_of,
    relative_rotations,
    segment_attitudes,
)
from handstudio.layout import JointPlace, Layout, SensorPlace, glove
from handstudio.maths import so3
from handstudio.pipeline import Doubt, Motion, unsure
from handstudio.setup import HandModel, Setup, calibrated
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import Truth, signals
from handstudio.simulation.subject import ideal_subject
from handstudio.simulation.world import World

RATE_HZ = 100.0
sides = pytest.mark.parametrize("side", ["right", "left"])


def true(layout: Layout, every_us: int = 100_000, until_us: int = 40_000_000) -> Truth:
    time_us = np.arange(0, until_us, every_us)
    return signals(ideal_subject(layout.side), layout, showcase(layout.side), time_us)[1]


def perfect(truth: Truth) -> Motion:
    """What the pipeline would say if it erred nowhere."""
    n, sensors = truth.q_world_sensor.shape[:2]
    start = np.tile(World().q_world_start, (n, 1))
    doubt = np.zeros((n, sensors), dtype=np.uint8)
    return Motion(truth.time_us, truth.q_world_sensor, start, doubt, unsure(doubt))


def setup_of(layout: Layout) -> Setup:
    return Setup(layout, RATE_HZ)


@sides
def test_true_orientations_give_the_true_angles_and_places(side):
    truth, setup = true(glove(side)), setup_of(glove(side))
    np.testing.assert_allclose(angles_of(setup, perfect(truth)), truth.angles, atol=1e-12)
    pose = pose_of(setup, truth.q_world_sensor)
    np.testing.assert_allclose(pose.t_world_tip, truth.t_world_tip, atol=1e-14)


def test_the_hands_length_scales_its_places_and_no_angle():
    truth, setup = true(glove(), every_us=1_000_000), setup_of(glove())
    large = msgspec.structs.replace(setup, hand=HandModel(hand_length_m=0.2))
    tips = [pose_of(one, truth.q_world_sensor).t_world_tip for one in (setup, large)]
    np.testing.assert_allclose(tips[1], tips[0] * (0.2 / setup.hand.hand_length_m), rtol=1e-12)
    angles = [angles_of(one, perfect(truth)) for one in (setup, large)]
    np.testing.assert_array_equal(*angles)


@sides
def test_a_glove_of_fewer_fingers_measures_the_same_angles_of_those_it_has(side):
    few = glove(side, ["SN1", "SN11", "SN15", "SN16", "SN18"])
    names = [angle.name for angle in measured_angles(few)]
    assert names == [
        *ROOT_ANGLES,
        "wrist_flexion",
        "wrist_deviation_ulnar",
        "thumb_cmc_flexion",
        "thumb_cmc_abduction",
        "thumb_cmc_rotation",
        "index_mcp_flexion",
        "index_mcp_abduction",
        "index_mcp_deviation_ulnar",
        "index_pip_flexion",
    ]
    truth = true(few)
    wanted = [[angle.name for angle in hand_angles()].index(name) for name in names]
    measured = angles_of(setup_of(few), perfect(truth))
    np.testing.assert_allclose(measured, truth.angles[:, wanted], atol=1e-12)


def test_segments_without_a_sensor_are_carried_along_straight():
    few = glove("right", ["SN1", "SN11"])
    truth, setup = true(few), setup_of(few)
    attitudes = segment_attitudes(setup, truth.q_world_sensor)
    rest = fit_of(setup).skeleton.q_parent_rest
    for index, name in enumerate(SEGMENTS):
        if name not in few.drivers:
            carried = so3.multiply(attitudes[:, PARENTS[index]], rest[index])
            np.testing.assert_array_equal(attitudes[:, index], carried)


@sides
def test_the_order_of_the_sensors_in_a_layout_does_not_matter(side):
    """Of all sensors the forearm's is the one the start is taken from, wherever it is listed."""
    thumb_first = [f"SN{n}" for n in (18, 20, 19, *range(17, 0, -1))]
    columns = []
    for layout in (glove(side), glove(side, thumb_first)):
        setup, time_us = setup_of(layout), np.arange(0, 8_000_000, 10_000)
        samples, _ = signals(ideal_subject(side), layout, showcase(side), time_us)
        motion, _ = pipeline.run(setup, pipeline.begin(setup), [samples])
        columns.append(angles_of(setup, motion, hand_angles()))
    assert np.isfinite(columns[0][-1]).all()
    # SN3 defines the forearm then, whose sensors agree as far as the filter's own error goes
    np.testing.assert_allclose(columns[1], columns[0], atol=np.deg2rad(0.3))


def test_angles_from_the_start_are_exported_only_where_there_is_one():
    motion = perfect(true(glove(), every_us=1_000_000))
    setup = setup_of(glove())
    never = replace(motion, q_world_start=np.full((len(motion), 4), np.nan))
    assert has_start(motion)
    assert not has_start(never)
    names = {angle.name for angle in exported_angles(setup, motion)}
    assert {angle.name for angle in exported_angles(setup, never)} == names - set(ROOT_ANGLES)
    late = replace(motion, q_world_start=motion.q_world_start.copy())
    late.q_world_start[:10] = np.nan
    assert {angle.name for angle in exported_angles(setup, late)} == names
    missing = np.isnan(angles_of(setup, late))
    assert missing[:10, :2].all()
    assert missing.sum() == 20


def test_angles_of_an_instant_do_not_depend_on_the_others():
    motion, setup = perfect(true(glove(), every_us=1_000_000)), setup_of(glove())
    whole = angles_of(setup, motion)
    for k in (0, 17, len(motion) - 1):
        np.testing.assert_array_equal(angles_of(setup, motion[k : k + 1])[0], whole[k])


NO_HAND = {
    "which hand": glove("unknown"),
    "No sensor on forearm": glove("right", ["SN11", "SN15"]),
    "No sensor on hand": glove("left", ["SN1", "SN15"]),
    "not a hand's": Layout(
        "right",
        tuple(SensorPlace(name, name) for name in ("forearm", "hand", "upper_arm")),
        (),
    ),
}


@pytest.mark.parametrize("why", NO_HAND)
def test_without_a_hand_there_is_no_pose_and_it_says_why(why):
    layout = NO_HAND[why]
    q = np.tile(so3.IDENTITY, (3, len(layout.sensors), 1))
    doubt = np.zeros(q.shape[:2], dtype=np.uint8)
    motion = Motion(np.arange(3), q, q[:, 0], doubt, unsure(doubt))
    assert measured_angles(layout) == ()
    for ask in (
        lambda: pose_of(setup_of(layout), q),
        lambda: angles_of(setup_of(layout), motion),
    ):
        with pytest.raises(LayoutError, match=rf"(?s)no hand.*{why}.*orientations"):
            ask()


def test_across_a_joint_is_the_child_as_its_parent_sees_it():
    joints = (JointPlace("hinge", "frame", "door", 1), JointPlace("knob", "door", "handle", 1))
    places = (SensorPlace("B", "door"), SensorPlace("A", "frame"), SensorPlace("A2", "frame"))
    layout = Layout("unknown", places, joints)
    rng = np.random.default_rng(5)
    q = so3.normalize(rng.normal(size=(10, 3, 4)))
    across = relative_rotations(layout, q)
    assert list(across) == ["hinge"]  # nothing sits on the handle
    v = rng.normal(size=(10, 3))
    seen = so3.rotate(so3.conjugate(q[:, 1]), so3.rotate(q[:, 0], v))
    np.testing.assert_allclose(so3.rotate(across["hinge"], v), seen, atol=1e-14)


def test_doubt_of_a_sensor_is_that_of_its_segment_and_of_those_it_carries():
    few = glove("right", ["SN1", "SN2", "SN11", "SN15"])
    doubt = np.zeros((4, 4), dtype=np.uint8)
    doubt[1, 0] = Doubt.SILENT  # the forearm's
    doubt[2, 1] = Doubt.SILENT  # one that defines nothing
    doubt[3, 3] = Doubt.SATURATED  # the index finger's first
    found = doubtful_segments(setup_of(few), doubt)
    names = [{SEGMENTS[k] for k in np.flatnonzero(row)} for row in found]
    assert names == [
        set(),
        {"forearm"},
        set(),
        {"index_proximal", "index_intermediate", "index_distal"},
    ]


def known(layout: Layout) -> SubjectCalibration:
    """The nominal hand, whose boards were seen to rock, and whose wrist was swung."""
    skeleton = nominal_skeleton("right")
    segments = tuple(
        Segment(
            name=name,
            sensor=layout.names[sensor],
            q_sensor_segment=(1.0, 0.0, 0.0, 0.0),
            q_parent_rest=tuple(skeleton.q_parent_rest[SEGMENTS.index(name)].tolist()),
            t_parent_joint=tuple(skeleton.t_parent_joint[SEGMENTS.index(name)].tolist()),
            sd_m=(0.001,) * 3,
            length_m=0.05,
            length_sd_m=0.001,
            source="measured",
            length_source="measured",
            plausible=0.0,
        )
        for name, sensor in layout.drivers.items()
    )
    return SubjectCalibration(
        *("one", "2026-03-04T12:30:05+00:00", "handstudio", "S01", "right", 0.187, 3, "VG-1"),
        segments,
        (),
        axes=(Axis("wrist", "SN11", (1.0, 0.0, 0.0), 0.01),),
        rocking=(Rock("SN15", "index_mcp", 0.1), Rock("SN16", "index_pip", 0.1)),
    )


def test_a_board_that_rocks_by_a_tenth_of_its_joint_is_taken_back_by_it():
    layout, bend = glove(), np.deg2rad(-60.0)
    q = np.tile(so3.IDENTITY, (1, len(layout.sensors), 1))
    for name in ("SN15", "SN16", "SN17"):
        q[0, layout.names.index(name)] = so3.exp(np.array([1.1 * bend, 0.0, 0.0]))
    setup = calibrated(setup_of(layout), subject=known(layout))
    proximal, hand = (SEGMENTS.index(name) for name in ("index_proximal", "hand"))
    before = segment_attitudes(setup_of(layout), q)
    after = segment_attitudes(setup, q)
    assert so3.log(before)[0, proximal, 0] == pytest.approx(1.1 * bend)
    assert so3.log(after)[0, proximal, 0] == pytest.approx(bend, rel=0.02)
    np.testing.assert_allclose(after[:, hand], before[:, hand], atol=1e-15)


def test_of_skin_only_what_this_layouts_sensors_know_is_taken_off():
    whole = skin_of_calibration(known(glove()), glove())
    assert (len(whole.segment), whole.by_hand) == (2, True)
    few = glove("right", ["SN1", "SN11", "SN15"])
    skin = skin_of_calibration(known(glove()), few)
    assert [SEGMENTS[k] for k in skin.segment] == ["index_proximal"]
    other = glove("right", ["SN2", "SN11", "SN15"])  # another sensor has to tell the forearm
    assert not skin_of_calibration(known(glove()), other).by_hand
    assert fit_of(setup_of(glove())).skin is None


def test_where_the_hand_turns_the_forearm_its_doubt_is_the_forearms():
    layout = glove()
    doubt = np.zeros((1, len(layout.sensors)), dtype=np.uint8)
    doubt[0, layout.names.index("SN11")] = Doubt.SILENT
    setup = calibrated(setup_of(layout), subject=known(layout))
    for one, doubtful in ((setup_of(layout), {"hand"}), (setup, {"hand", "forearm"})):
        found = doubtful_segments(one, doubt)[0]
        assert {SEGMENTS[k] for k in np.flatnonzero(found)} == doubtful


def test_a_hand_is_made_once_for_a_setup_and_anew_for_another():
    setup = setup_of(glove())
    assert fit_of(setup) is fit_of(setup)
    other = msgspec.structs.replace(setup, hand=HandModel(hand_length_m=0.25))
    assert not np.allclose(
        fit_of(other).skeleton.t_parent_joint, fit_of(setup).skeleton.t_parent_joint
    )
