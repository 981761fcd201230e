"""Grasps from made-up postures, and sizes of things from made-up fingers."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.analysis.grasp_prototypes import OPEN, PROTOTYPES, SD_DEG
from handstudio.analysis.grasps import grasp_segments, recognise
from handstudio.analysis.object_size import (
    TOUCHING,
    Bones,
    cylinder_held,
    object_size,
    sphere_held,
)
from handstudio.hand.pose import posed
from handstudio.hand.skeleton import SEGMENTS, nominal_skeleton
from handstudio.maths import so3

RATE_HZ = 100
BY_NAME = {prototype.name: np.deg2rad(prototype.degrees) for prototype in PROTOTYPES}


def test_every_mean_posture_is_its_own_class_and_near_it_still():
    rng = np.random.default_rng(0)
    for name, posture in BY_NAME.items():
        assert recognise(posture).name == name
        assert recognise(posture).distance < 0.01
        near = posture + np.deg2rad(2.0) * rng.standard_normal(len(posture))
        assert recognise(near).name == name


def test_between_two_classes_neither_is_sure():
    a, b = BY_NAME["thumb_2_finger"], BY_NAME["tripod"]
    between = recognise(0.5 * (a + b))
    assert {between.name, between.second} == {"thumb_2_finger", "tripod"}
    assert between.confidence == pytest.approx(0.5, abs=0.1)
    assert recognise(a).confidence > between.confidence


def test_a_posture_like_none_is_none_and_angles_that_are_missing_are_left_out():
    strange = BY_NAME["tripod"] + 4.0 * np.deg2rad(SD_DEG)
    assert recognise(strange).name == ""
    gappy = BY_NAME["power_sphere"].copy()
    gappy[-4:] = np.nan
    assert recognise(gappy).name == "power_sphere"
    assert recognise(np.full(len(gappy), np.nan)).name == ""


def motion(*stops: tuple[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """From the open hand through holds of so long, half a second of way between."""
    parts, before = [np.tile(BY_NAME[OPEN], (100, 1))], BY_NAME[OPEN]
    for name, seconds in (*stops, (OPEN, 1.0)):
        u = np.linspace(0.0, 1.0, 50)[:, None]
        parts.append(before + (BY_NAME[name] - before) * u**3 * (10 - 15 * u + 6 * u**2))
        parts.append(np.tile(BY_NAME[name], (round(seconds * RATE_HZ), 1)))
        before = BY_NAME[name]
    postures = np.concatenate(parts)
    noise = np.random.default_rng(0).standard_normal(postures.shape)
    return np.arange(len(postures)) / RATE_HZ, postures + np.deg2rad(0.05) * noise


def test_a_grasp_is_closed_held_and_let_go():
    time_s, postures = motion(("power_sphere", 2.0), ("tripod", 1.5))
    sphere, tripod = grasp_segments(time_s, postures)
    assert (sphere.found.name, tripod.found.name) == ("power_sphere", "tripod")
    assert sphere.found.feix == "Power Sphere"
    assert sphere.start_s == pytest.approx(1.0, abs=0.15)
    assert sphere.hold_s == pytest.approx(1.5, abs=0.1)
    assert sphere.release_s == pytest.approx(3.5, abs=0.1)
    assert tripod.hold_s == pytest.approx(4.0, abs=0.1)
    assert tripod.end_s == pytest.approx(6.0, abs=0.15)


def test_an_open_hand_and_a_short_stop_are_no_grasps():
    assert grasp_segments(*motion()) == ()
    assert grasp_segments(*motion(("power_sphere", 0.3))) == ()
    assert grasp_segments(np.zeros(0), np.zeros((0, len(SD_DEG)))) == ()


def around(radius_m: float, flesh_m: float, seed: int) -> Bones:
    """Five bones that touch a sphere from all sides but one, at (0.01, 0.09, -0.06)."""
    rng = np.random.default_rng(seed)
    out = rng.normal(size=(5, 3)) + np.array([0.0, 0.0, 0.5])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    along = np.cross(out, rng.normal(size=(5, 3)))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    middle = np.array([0.01, 0.09, -0.06]) + (radius_m + flesh_m) * out
    return Bones(middle - 0.012 * along, middle + 0.010 * along, np.full(5, flesh_m))


@pytest.mark.parametrize("radius_m", [0.02, 0.0375, 0.045])
def test_a_sphere_is_as_large_as_the_bones_around_it_say(radius_m):
    for seed in range(5):
        found = sphere_held(around(radius_m, 0.007, seed))
        assert found.radius_m == pytest.approx(radius_m, abs=1e-5)
        assert found.residual_m < 1e-5
        np.testing.assert_allclose(found.middle, [0.01, 0.09, -0.06], atol=1e-5)


def test_a_bar_across_the_palm_is_as_thick_as_the_fingers_around_it_say():
    radius, flesh = 0.025, 0.008
    angle, x = np.deg2rad([-60.0, 20.0, 90.0, 150.0, 200.0, 80.0]), np.linspace(-0.03, 0.03, 6)
    out = np.stack([np.zeros(6), np.cos(angle), np.sin(angle)], axis=-1)
    round_it = np.stack([np.zeros(6), -np.sin(angle), np.cos(angle)], axis=-1)
    middle = (radius + flesh) * out + np.stack([x, np.full(6, 0.08), np.full(6, -0.05)], axis=-1)
    bones = Bones(middle - 0.01 * round_it, middle + 0.01 * round_it, np.full(6, flesh))
    found = cylinder_held(bones)
    assert found.radius_m == pytest.approx(radius, abs=2e-4)
    assert found.residual_m < 2e-4
    np.testing.assert_allclose(found.middle[1:], [0.08, -0.05], atol=5e-4)
    assert found.axis[0] > 0.999
    again = cylinder_held(bones, found.solution)
    assert again.radius_m == pytest.approx(found.radius_m, abs=1e-6)


def test_a_size_is_told_only_where_enough_touches_and_not_of_a_flat_hand():
    skeleton = nominal_skeleton("right")
    flat = posed(skeleton, np.tile(so3.IDENTITY, (3, len(SEGMENTS), 1)))
    assert object_size("tripod", skeleton, 0.187, flat) is None
    size = object_size("power_sphere", skeleton, 0.187, flat)
    assert size is None or size.residual_m > 0.003
    for form, segments in TOUCHING.values():
        assert len(segments) >= (5 if form == "sphere" else 6)
