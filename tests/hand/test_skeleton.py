"""The skeleton and the placed hand: lengths, mirror, chains."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handstudio.hand.pose import bone_ends, posed
from handstudio.hand.skeleton import (
    ADULT_HAND_LENGTH_M,
    DISTALS,
    FINGERS,
    JOINTS,
    PARENTS,
    SEGMENTS,
    nominal_skeleton,
)
from handstudio.maths import so3

sides = pytest.mark.parametrize("side", ["right", "left"])


def tossed(n: int) -> np.ndarray:
    rng = np.random.default_rng(6)
    return so3.normalize(rng.normal(size=(n, len(SEGMENTS), 4)))


def test_every_parent_comes_before_its_children():
    assert PARENTS[0] == -1
    assert all(parent < child for child, parent in enumerate(PARENTS))
    assert [SEGMENTS[parent] for parent in PARENTS[1:]] == [joint.parent for joint in JOINTS[1:]]


@sides
def test_bones_keep_their_lengths_in_any_pose(side):
    skeleton = nominal_skeleton(side)
    starts, ends = bone_ends(posed(skeleton, tossed(20)))
    lengths = np.linalg.norm(ends - starts, axis=-1)
    expected = [
        *np.linalg.norm(skeleton.t_parent_joint[1:], axis=-1),
        *np.linalg.norm(skeleton.t_distal_tip, axis=-1),
    ]
    np.testing.assert_allclose(lengths, np.broadcast_to(expected, lengths.shape), rtol=1e-12)


@sides
def test_a_fingertip_is_where_a_chain_of_matrices_puts_it(side):
    skeleton, q = nominal_skeleton(side), tossed(1)[0]
    pose = posed(skeleton, q)
    for finger, distal in enumerate(DISTALS):
        point, segment = skeleton.t_distal_tip[finger], SEGMENTS.index(distal)
        while segment >= 0:
            # out of this segment into the world's axes, seen from its joint
            attitude = Rotation.from_quat(q[segment], scalar_first=True).as_matrix()
            point = attitude @ point
            parent = PARENTS[segment]
            if parent >= 0:
                back = Rotation.from_quat(q[parent], scalar_first=True).as_matrix().T
                point = back @ point + skeleton.t_parent_joint[segment]
            segment = parent
        np.testing.assert_allclose(pose.t_world_tip[finger], point, atol=1e-14)


@sides
def test_poses_of_many_instants_are_those_of_each(side):
    skeleton, q = nominal_skeleton(side), tossed(3)
    many = posed(skeleton, q)
    for k in range(3):
        one = posed(skeleton, q[k])
        np.testing.assert_array_equal(many.t_world_joint[k], one.t_world_joint)
        np.testing.assert_array_equal(many.t_world_tip[k], one.t_world_tip)


def test_a_left_hand_mirrors_a_right_one():
    right, left = nominal_skeleton("right"), nominal_skeleton("left")
    q = tossed(5)
    mirrored = q * [1.0, 1.0, -1.0, -1.0]
    a, b = posed(right, q), posed(left, mirrored)
    np.testing.assert_allclose(b.t_world_joint, a.t_world_joint * [-1.0, 1.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(b.t_world_tip, a.t_world_tip * [-1.0, 1.0, 1.0], atol=1e-15)


def test_the_flat_hand_is_as_longas_it_is_said_to_be():
    skeleton = nominal_skeleton("right", 0.200)
    q = np.tile(so3.IDENTITY, (len(SEGMENTS), 1))
    pose = posed(skeleton, q)
    wrist = pose.t_world_joint[SEGMENTS.index("hand")]
    tip = pose.t_world_tip[FINGERS.index("middle")]
    # the source's shares of the middle finger add up to 99 percent
    assert np.linalg.norm(tip - wrist) == pytest.approx(0.200, rel=0.015)


def test_a_hand_of_another_length_is_the_same_hand_scaled():
    small, large = nominal_skeleton("right", 0.150), nominal_skeleton("right", 0.225)
    np.testing.assert_allclose(large.t_parent_joint, 1.5 * small.t_parent_joint, rtol=1e-14)
    np.testing.assert_allclose(large.t_distal_tip, 1.5 * small.t_distal_tip, rtol=1e-14)
    np.testing.assert_array_equal(large.q_parent_rest, small.q_parent_rest)


def test_lengths_of_segments_are_those_of_their_bones():
    lengths = dict(zip(SEGMENTS, nominal_skeleton("right", 1.0).length_m, strict=True))
    assert lengths["index_proximal"] == pytest.approx(0.245)
    assert lengths["thumb_distal"] == pytest.approx(0.158)
    assert lengths["thumb_metacarpal"] == pytest.approx(0.251)
    assert lengths["hand"] == pytest.approx(0.463, rel=1e-3)  # to the farthest knuckle it carries
    assert all(length > 0.05 for length in lengths.values())


def test_the_shared_skeleton_cannot_be_written_to():
    skeleton = nominal_skeleton("right", ADULT_HAND_LENGTH_M)
    assert skeleton is nominal_skeleton("right", ADULT_HAND_LENGTH_M)
    for array in (skeleton.t_parent_joint, skeleton.q_parent_rest, skeleton.t_distal_tip):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
