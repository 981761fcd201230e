import numpy as np
import pytest

from handstudio.hand.skeleton import JOINTS, SEGMENTS
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.simulation.mounting import donned, nominal_mounting
from handstudio.simulation.subject import (
    DEVELOPMENT,
    REPORTING,
    ideal_subject,
    mirrored,
    subject,
    with_fixed_axes,
)

POPULATION = [subject(number) for number in range(1, 121)]


def test_a_number_is_a_person():
    once, again, other = subject(7), subject(7), subject(8)
    np.testing.assert_array_equal(once.skeleton.t_parent_joint, again.skeleton.t_parent_joint)
    np.testing.assert_array_equal(once.mechanism.axes, again.mechanism.axes)
    assert once.hand_length_m == again.hand_length_m != other.hand_length_m


def test_development_and_reporting_share_nobody():
    assert not set(DEVELOPMENT) & set(REPORTING)


def test_the_population_has_the_size_it_was_drawn_from():
    lengths = np.array([someone.hand_length_m for someone in POPULATION])
    assert lengths.mean() == pytest.approx(0.187, abs=0.004)
    assert 0.008 < lengths.std() < 0.016
    assert 0.150 < lengths.min() < lengths.max() < 0.230


def test_frames_are_laid_by_the_flexion_axes():
    """x is the axis itself; the link lies in the plane x, y, a little off y."""
    for someone in POPULATION[:10]:
        np.testing.assert_array_equal(
            someone.mechanism.axes[:, 0], np.tile([1.0, 0.0, 0.0], (len(JOINTS), 1))
        )
        far = someone.skeleton.t_far_end
        direction = far / np.linalg.norm(far, axis=-1, keepdims=True)
        np.testing.assert_allclose(direction[:, 2], 0.0, atol=1e-12)
        off = np.rad2deg(np.arctan2(direction[:, 0], direction[:, 1]))
        phalanges = [i for i, name in enumerate(SEGMENTS) if not name.startswith("hand")]
        assert 0.5 < np.abs(off[phalanges]).mean() < 6.0


def test_bones_are_where_they_would_be_with_square_axes():
    """Oblique axes turn frames, not bones: a straight chain of the flat hand stays straight."""
    for someone in POPULATION[:10]:
        q = np.empty((len(JOINTS), 4))
        for child, joint in enumerate(JOINTS):
            parent = so3.IDENTITY if joint.parent is None else q[SEGMENTS.index(joint.parent)]
            q[child] = so3.multiply(parent, someone.skeleton.q_parent_rest[child])
        bone = so3.rotate(q, someone.skeleton.t_far_end)
        middle = [SEGMENTS.index(f"middle_{s}") for s in ("proximal", "intermediate", "distal")]
        straight = bone[middle] / np.linalg.norm(bone[middle], axis=-1, keepdims=True)
        np.testing.assert_allclose(straight @ straight[0], 1.0, atol=1e-9)


def test_the_other_hand_is_the_mirror_image():
    right, left = subject(4, "right"), subject(4, "left")
    assert (right.side, left.side) == ("right", "left")
    np.testing.assert_allclose(
        left.skeleton.t_parent_joint, right.skeleton.t_parent_joint * [-1.0, 1.0, 1.0]
    )
    back = mirrored(left)
    np.testing.assert_array_equal(back.mechanism.axes, right.mechanism.axes)
    np.testing.assert_array_equal(back.mechanism.points, right.mechanism.points)


def test_fixed_axes_are_fixed():
    assert not subject(4).mechanism.is_fixed
    assert with_fixed_axes(subject(4)).mechanism.is_fixed
    assert ideal_subject().mechanism.is_fixed


def test_gloves_are_put_on_otherwise_every_time():
    nominal = nominal_mounting(glove(), subject(1).skeleton)
    first, again, other = donned(nominal, 1, "right"), donned(nominal, 1, "right"), None
    other = donned(nominal, 2, "right")
    np.testing.assert_array_equal(first.q_segment_sensor, again.q_segment_sensor)
    tilt = np.rad2deg(so3.angle_between(first.q_segment_sensor, other.q_segment_sensor))
    assert 2.0 < tilt.mean() < 30.0
    as_meant = donned(nominal, 1, "right", strength=0.0)
    np.testing.assert_array_equal(as_meant.q_segment_sensor, nominal.q_segment_sensor)
    np.testing.assert_array_equal(as_meant.t_segment_sensor, nominal.t_segment_sensor)
