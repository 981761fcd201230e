"""Angles: split and put together again, and what each does to a hand of flesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from handstudio.hand.angles import (
    ROOT_ANGLES,
    Angle,
    compose,
    decompose,
    hand_angles,
    joint_angles,
    joint_index,
    sign_of,
)
from handstudio.hand.pose import Pose, posed
from handstudio.hand.skeleton import FINGERS, JOINTS, PARENTS, SEGMENTS, nominal_skeleton
from handstudio.maths import so3

ANGLES = {angle.name: angle for angle in hand_angles()}
AMOUNT = np.deg2rad(20.0)

sides = pytest.mark.parametrize("side", ["right", "left"])
turn = st.floats(-np.pi, np.pi)
deviation = st.floats(-0.5 * np.pi + 1e-3, 0.5 * np.pi - 1e-3)


# --- three turns, one rotation ----------------------------------------------------------------


@given(turn, deviation, turn)
def test_composing_what_was_split_gives_the_rotation(a, b, c):
    turns = np.array([a, b, c])
    again = decompose(compose(turns))
    np.testing.assert_allclose(np.cos(again - turns), 1.0, atol=1e-12)
    assert abs(again[1] - b) < 1e-9


@given(arrays(float, 3, elements=st.floats(-10.0, 10.0)))
def test_splitting_and_composing_gives_the_same_rotation_even_at_the_singularity(v):
    for q in (so3.exp(v), compose(np.array([v[0], 0.5 * np.pi, v[2]]))):
        assert so3.angle_between(compose(decompose(q)), q) < 1e-6


@given(turn, st.floats(-0.5 * np.pi, 0.5 * np.pi), turn)
def test_scipy_turns_about_x_z_and_y_the_same(a, b, c):
    q = Rotation.from_euler("XZY", [a, b, c]).as_quat(scalar_first=True)
    assert so3.angle_between(compose(np.array([a, b, c])), q) < 1e-7


# --- what is measured on a hand ---------------------------------------------------------------


def flat(side: str, **degrees: float) -> np.ndarray:
    """Attitudes (1, k, 4) of a hand whose named angles are these, all others 0; palm down."""
    skeleton = nominal_skeleton(side)
    turns = np.zeros((len(SEGMENTS), 3))
    for name, value in degrees.items():
        angle = ANGLES[name]
        turns[joint_index(angle.joint), angle.turn] = np.deg2rad(value) * sign_of(angle, side)
    return chained(so3.multiply(skeleton.q_parent_rest, compose(turns)))


def chained(q_parent_child: np.ndarray) -> np.ndarray:
    q = np.empty((1, len(SEGMENTS), 4))
    for child, parent in enumerate(PARENTS):
        own = q_parent_child[child]
        q[0, child] = own if parent < 0 else so3.multiply(q[0, parent], own)
    return q


def measured(side: str, q_world_segment: np.ndarray, start: np.ndarray | None = None) -> dict:
    start = np.tile(so3.IDENTITY if start is None else start, (len(q_world_segment), 1))
    values = joint_angles(nominal_skeleton(side), q_world_segment, start)
    return dict(zip(ANGLES, np.rad2deg(values[0]), strict=True))


@sides
def test_a_flat_hand_has_zero_everywhere_wherever_it_points(side):
    for start in (so3.IDENTITY, so3.exp(np.array([0.3, -1.0, 2.0]))):
        q = so3.multiply(start, flat(side))
        for name, value in measured(side, q, start).items():
            assert value == pytest.approx(0.0, abs=1e-9), name


@sides
@pytest.mark.parametrize("name", ANGLES)
def test_one_angle_moves_no_other(side, name):
    # the same turn, named by radial or ulnar side, or from the middle finger
    twins = [
        n for n, a in ANGLES.items() if (a.joint, a.turn) == (ANGLES[name].joint, ANGLES[name].turn)
    ]
    for other, value in measured(side, flat(side, **{name: 20.0})).items():
        expected = 20.0 if other in twins else 0.0
        assert abs(value) == pytest.approx(expected, abs=1e-9), other
        assert other != name or value > 0.0


def test_a_left_hand_that_mirrors_a_right_one_has_its_angles():
    rng = np.random.default_rng(4)
    own = so3.exp(rng.uniform(-0.8, 0.8, size=(len(SEGMENTS), 3)))
    own = so3.multiply(nominal_skeleton("right").q_parent_rest, own)
    right = chained(own)
    mirror = np.array([1.0, 1.0, -1.0, -1.0])  # of a rotation, in the plane x = 0
    of_right, of_left = measured("right", right), measured("left", right * mirror)
    assert np.abs(list(of_right.values())).max() > 20.0
    assert of_left == pytest.approx(of_right, abs=1e-9)


def test_where_there_is_no_start_only_the_angles_from_it_are_missing():
    values = measured("right", flat("right", wrist_flexion=10.0), np.full(4, np.nan))
    assert {name for name, value in values.items() if np.isnan(value)} == set(ROOT_ANGLES)


def test_angles_come_in_the_order_they_are_asked_for():
    skeleton, q = nominal_skeleton("right"), flat("right", wrist_flexion=10.0)
    start = so3.IDENTITY[None]
    wanted = [ANGLES["index_pip_flexion"], ANGLES["wrist_flexion"]]
    np.testing.assert_allclose(
        np.rad2deg(joint_angles(skeleton, q, start, wanted)), [[0.0, 10.0]], atol=1e-9
    )


def test_names_of_angles_are_unique_and_their_joints_exist():
    assert len(ANGLES) == len(hand_angles())
    assert {angle.joint for angle in hand_angles()} <= {joint.name for joint in JOINTS}


# --- the signs, seen from outside -------------------------------------------------------------
# A hand lies palm down before us, fingers pointing away. Which way is radial is read off the row of
# knuckles; nothing here looks at frames or at the table of signs.

UP, DISTAL = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Seen:
    """The hand before and after one of its angles grew by 20 degrees."""

    side: str
    angle: Angle
    before: Pose
    after: Pose

    @property
    def radial(self) -> np.ndarray:
        across = self.knuckle("index") - self.knuckle("little")
        across[1:] = 0.0
        return across / np.linalg.norm(across)

    def knuckle(self, finger: str) -> np.ndarray:
        return self.before.t_world_joint[0, SEGMENTS.index(f"{finger}_proximal")].copy()

    def moved(self, finger: str) -> np.ndarray:
        tip = FINGERS.index(finger)
        return self.after.t_world_tip[0, tip] - self.before.t_world_tip[0, tip]

    def apart(self, finger: str, other: str) -> float:
        """How much farther apart two fingertips are now."""
        i, j = FINGERS.index(finger), FINGERS.index(other)
        now, then = (
            np.linalg.norm(pose.t_world_tip[0, i] - pose.t_world_tip[0, j])
            for pose in (self.after, self.before)
        )
        return float(now - then)


def grown(side: str, name: str) -> Seen:
    skeleton = nominal_skeleton(side)
    before, after = (posed(skeleton, flat(side, **{name: deg})) for deg in (0.0, 20.0))
    return Seen(side, ANGLES[name], before, after)


@sides
def test_the_thumb_is_on_the_radial_side(side):
    seen = grown(side, "wrist_flexion")
    thumb = seen.before.t_world_joint[0, SEGMENTS.index("thumb_proximal")]
    assert thumb @ seen.radial > seen.knuckle("index") @ seen.radial


@sides
@pytest.mark.parametrize("finger", FINGERS[1:])
@pytest.mark.parametrize("joint", ["mcp", "pip", "dip"])
def test_flexion_of_a_finger_bends_it_to_the_palm(side, finger, joint):
    moved = grown(side, f"{finger}_{joint}_flexion").moved(finger)
    assert moved @ UP < 0.0
    assert moved @ DISTAL < 0.0
    assert abs(moved[0]) < 1e-9


@sides
@pytest.mark.parametrize("finger", ["index", "ring", "little"])
def test_abduction_leads_a_finger_away_from_the_middle_finger(side, finger):
    seen = grown(side, f"{finger}_mcp_abduction")
    assert seen.apart(finger, "middle") > 0.01
    assert abs(seen.moved(finger) @ UP) < 1e-9


@sides
def test_abduction_of_the_middle_finger_is_radial(side):
    seen = grown(side, "middle_mcp_abduction")
    assert seen.moved("middle") @ seen.radial > 0.01


@sides
@pytest.mark.parametrize("finger", FINGERS[1:])
def test_ulnar_deviation_leads_every_finger_to_the_little_fingers_side(side, finger):
    seen = grown(side, f"{finger}_mcp_deviation_ulnar")
    assert seen.moved(finger) @ seen.radial < -0.01


@sides
def test_the_wrist_flexes_to_the_palm_and_deviates_to_the_ulnar_side(side):
    for finger in FINGERS:
        assert grown(side, "wrist_flexion").moved(finger) @ UP < -0.01
        deviated = grown(side, "wrist_deviation_ulnar")
        assert deviated.moved(finger) @ deviated.radial < -0.01


@sides
def test_the_ulnar_block_folds_to_the_palm_and_takes_two_fingers_along(side):
    folded = grown(side, "ulnar_cmc_flexion")
    assert folded.moved("ring") @ UP < -0.01
    assert folded.moved("little") @ UP < -0.01
    for finger in ("thumb", "index", "middle"):
        np.testing.assert_array_equal(folded.moved(finger), 0.0)


@sides
def test_the_thumb_abducts_out_of_the_plane_of_the_palm(side):
    moved = grown(side, "thumb_cmc_abduction").moved("thumb")
    assert moved @ UP < -0.7 * np.linalg.norm(moved)


@sides
@pytest.mark.parametrize("joint", ["cmc", "mcp", "ip"])
def test_the_thumb_flexes_across_the_palm(side, joint):
    seen = grown(side, f"thumb_{joint}_flexion")
    assert seen.moved("thumb") @ seen.radial < 0.0
    tip = seen.before.t_world_tip[0, 0]
    nearer = np.linalg.norm(tip - seen.knuckle("little")) - np.linalg.norm(
        tip + seen.moved("thumb") - seen.knuckle("little")
    )
    assert nearer > 0.0


@sides
def test_the_thumb_pronates_until_its_pad_faces_those_of_the_fingers(side):
    seen = grown(side, "thumb_cmc_rotation")
    distal = SEGMENTS.index("thumb_distal")
    pads = [so3.rotate(pose.q_world_segment[0, distal], -UP) for pose in (seen.before, seen.after)]
    assert pads[0] @ seen.radial < -0.5  # across the palm at first
    # the fingers' pads face the floor, so what faces them looks up
    assert (pads[1] - pads[0]) @ UP > 0.2


@sides
def test_the_elbow_flexes_as_the_forearm_is_raised(side):
    seen = grown(side, "elbow_flexion")
    wrist = seen.after.t_world_joint[0, 1] - seen.before.t_world_joint[0, 1]
    assert wrist @ UP > 0.05
    assert abs(wrist[0]) < 1e-9


@sides
def test_pronation_turns_the_palm_from_up_over_thumb_up_to_down(side):
    """From the palm facing up there are two ways to turn it down; an arm can go only one."""
    radial = grown(side, "wrist_flexion").radial
    palm_down = flat(side)
    rolled = {
        degrees: so3.multiply(so3.from_axis_angle(DISTAL, np.deg2rad(degrees)), palm_down)
        for degrees in (-90.0, 90.0)
    }
    (thumb_up,) = (q for q in rolled.values() if so3.rotate(q[0, 0], radial) @ UP > 0.99)
    palm_up = so3.multiply(so3.from_axis_angle(DISTAL, np.pi), palm_down)
    start = palm_up[0, 0]
    assert measured(side, thumb_up, start)["forearm_pronation"] == pytest.approx(90.0)
    assert measured(side, palm_down, thumb_up[0, 0])["forearm_pronation"] == pytest.approx(90.0)
    assert measured(side, palm_up, thumb_up[0, 0])["forearm_pronation"] == pytest.approx(-90.0)
