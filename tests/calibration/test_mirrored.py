"""The other hand by mirror: twice is nothing, and a nominal right hand makes the nominal left."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from handstudio.calibration.mirrored import mirrored
from handstudio.calibration.subject import (
    Axis,
    Centre,
    Rock,
    Segment,
    SubjectCalibration,
    Tip,
    decode,
    encode,
)
from handstudio.hand.angles import hand_angles, joint_angles
from handstudio.hand.skeleton import FINGERS, SEGMENTS, Skeleton, nominal_skeleton
from handstudio.hand_fit import fit_of_calibration
from handstudio.kinematics import segment_attitudes
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.setup import Setup, calibrated

NOW = "2026-03-04T12:30:05+00:00"


def calibration(side: str, seed: int | None = None) -> SubjectCalibration:
    """Of the nominal hand, or of a hand and sensors that lie about it by chance."""
    rng = np.random.default_rng(seed)
    nominal, layout = nominal_skeleton(side), glove(side)
    drivers = {place.segment: place.sensor for place in layout.sensors}

    def off(scale: float) -> np.ndarray:
        return np.zeros(3) if seed is None else scale * rng.standard_normal(3)

    def turned(q: np.ndarray) -> tuple[float, ...]:
        return tuple(so3.multiply(q, so3.exp(off(0.1))).tolist())

    segments = tuple(
        Segment(
            name=name,
            sensor=drivers.get(name, ""),
            q_sensor_segment=turned(so3.IDENTITY),
            q_parent_rest=turned(nominal.q_parent_rest[index]),
            t_parent_joint=tuple((nominal.t_parent_joint[index] + off(0.003)).tolist()),
            sd_m=(0.001, 0.002, 0.003),
            length_m=float(nominal.length_m[index]),
            length_sd_m=0.001,
            source="measured",
            length_source="with prior",
            plausible=-0.4,
        )
        for index, name in enumerate(SEGMENTS)
    )
    tips = tuple(
        Tip(finger, tuple((tip + off(0.002)).tolist()), 0.002, "proportions")
        for finger, tip in zip(FINGERS, nominal.t_distal_tip, strict=True)
    )
    centres = (
        Centre(
            "index_pip", "SN16", (0.01, 0.02, 0.03), (1e-3,) * 3, (0.6, 0.8, 0.0), 0.2, (60, 3), 9
        ),
    )
    axes = (Axis("index_pip", "SN16", (0.8, 0.0, 0.6), 0.01),)
    rocking = (Rock("SN15", "index_mcp", 0.05),)
    return SubjectCalibration(
        *("one", NOW, "handstudio", "S01", side, 0.187, 3, "VG-1", segments, tips, centres, axes),
        rocking=rocking,
    )


def skeleton(of: SubjectCalibration) -> Skeleton:
    return fit_of_calibration(of, glove(of.side)).skeleton


@pytest.mark.parametrize("side", ["left", "right"])
def test_twice_is_the_same_back(side):
    one = calibration(side, 3)
    other = mirrored(one, "two", NOW)
    assert other.side != side
    assert (other.id, other.mirrored_from) == ("two", "one")
    back = mirrored(other, "three", NOW)
    assert back.mirrored_from == "two"
    assert msgspec.structs.replace(back, id="one", mirrored_from="") == one


@pytest.mark.parametrize(("side", "other"), [("right", "left"), ("left", "right")])
def test_the_nominal_hand_is_the_nominal_other_one(side, other):
    made, expected = skeleton(mirrored(calibration(side), "two", NOW)), nominal_skeleton(other)
    assert made.side == other
    for name in ("t_parent_joint", "q_parent_rest", "t_distal_tip"):
        np.testing.assert_array_equal(getattr(made, name), getattr(expected, name))


def test_a_mirrored_movement_has_the_same_angles():
    """Sensors that turn in mirror image show the same flexions, deviations and rotations."""
    one = calibration("right", 5)
    other = mirrored(one, "two", NOW)
    rng = np.random.default_rng(1)
    image = np.array([1.0, 1.0, -1.0, -1.0])
    layouts = {each.side: glove(each.side) for each in (one, other)}
    q_world_sensor = so3.exp(0.4 * rng.standard_normal((20, len(layouts["right"].sensors), 3)))

    def angles(of: SubjectCalibration, q: np.ndarray) -> np.ndarray:
        layout = layouts[of.side]
        fit = fit_of_calibration(of, layout)
        drivers = layout.drivers
        q_world_segment = np.stack(
            [
                so3.multiply(q[:, drivers[name]], fit.q_sensor_segment[drivers[name]])
                if name in drivers
                else np.tile(so3.IDENTITY, (len(q), 1))
                for name in SEGMENTS
            ],
            axis=1,
        )
        start = np.tile(so3.IDENTITY, (len(q), 1))
        return joint_angles(fit.skeleton, q_world_segment, start, hand_angles())

    np.testing.assert_allclose(
        angles(other, q_world_sensor * image), angles(one, q_world_sensor), atol=1e-9
    )


def test_boards_rock_in_mirror_image():
    """Skin that is taken off a mirrored movement leaves the mirrored movement."""
    one = calibration("right", 5)
    other = mirrored(one, "two", NOW)
    image = np.array([1.0, 1.0, -1.0, -1.0])
    q = so3.exp(0.4 * np.random.default_rng(2).standard_normal((20, 20, 3)))
    right, left = (
        segment_attitudes(calibrated(Setup(glove(each.side), 100.0), subject=each), seen)
        for each, seen in ((one, q), (other, q * image))
    )
    np.testing.assert_allclose(right * image, left, atol=1e-12)


def test_a_calibration_from_before_boards_were_known_to_rock_reads():
    old = msgspec.structs.replace(calibration("right"), rocking=())
    text = encode(old).replace(b'"rocking": [],', b"")
    assert b"rocking" not in text
    assert decode(text, "x") == old


def test_places_and_axes_seen_from_a_sensor_are_mirrored():
    other = mirrored(calibration("right"), "two", NOW)
    (centre,), (axis,) = other.centres, other.axes
    assert centre.from_centre_m == (-0.01, 0.02, 0.03)
    assert axis.axis == (0.8, 0.0, -0.6)
    assert np.cross(centre.unseen, (-0.6, 0.8, 0.0)).tolist() == [0.0, 0.0, 0.0]  # the same line
    assert (centre.sd_m, centre.residual, axis.sd_rad) == ((1e-3,) * 3, 0.2, 0.01)


def test_a_mirrored_one_can_be_kept_and_has_no_minus_before_a_zero():
    other = mirrored(calibration("right"), "two", NOW)
    text = encode(other)
    assert decode(text, "x") == other
    assert b"-0.0," not in text
