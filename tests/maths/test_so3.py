"""Rotations: a group, the same one as scipy's, exact where angles vanish."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from handstudio.maths import so3

EPS = np.finfo(float).eps
unit = st.floats(-1.0, 1.0, allow_subnormal=False)


@st.composite
def rotations(draw: st.DrawFn) -> np.ndarray:
    """Any unit quaternion; half turns and identities among them."""
    q = draw(arrays(float, 4, elements=unit).filter(lambda q: np.linalg.norm(q) > 1e-3))
    return q / np.linalg.norm(q)


vectors = arrays(float, 3, elements=st.floats(-1e3, 1e3))
angles = st.floats(-3.0, 3.0)


def of_scipy(rotation: Rotation) -> np.ndarray:
    return rotation.as_quat(scalar_first=True)


def to_scipy(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


def same(p: np.ndarray, q: np.ndarray, atol: float = 1e-14) -> None:
    """One rotation has two quaternions."""
    np.testing.assert_allclose(p if p @ q > 0.0 else -p, q, atol=atol)


# --- the group --------------------------------------------------------------------------------


@given(rotations(), rotations(), rotations())
def test_composition_is_associative(p, q, r):
    left = so3.multiply(so3.multiply(p, q), r)
    np.testing.assert_allclose(left, so3.multiply(p, so3.multiply(q, r)), atol=8 * EPS)


@given(rotations())
def test_the_identity_changes_nothing_and_the_conjugate_takes_it_back(q):
    np.testing.assert_array_equal(so3.multiply(q, so3.IDENTITY), q)
    np.testing.assert_array_equal(so3.multiply(so3.IDENTITY, q), q)
    for turned_back in (
        so3.multiply(q, so3.conjugate(q)),
        so3.multiply(so3.conjugate(q), q),
    ):
        np.testing.assert_allclose(turned_back, so3.IDENTITY, atol=8 * EPS)


@given(rotations(), rotations())
def test_a_composition_of_rotations_is_a_rotation(p, q):
    assert np.linalg.norm(so3.multiply(p, q)) == pytest.approx(1.0, abs=8 * EPS)


@given(rotations(), rotations(), vectors)
def test_turning_twice_is_turning_by_the_composition(p, q, v):
    twice = so3.rotate(p, so3.rotate(q, v))
    np.testing.assert_allclose(so3.rotate(so3.multiply(p, q), v), twice, atol=1e-11)


@given(rotations(), vectors, vectors)
def test_turning_keeps_lengths_angles_and_handedness(q, u, v):
    turned_u, turned_v = so3.rotate(q, u), so3.rotate(q, v)
    scale = 1.0 + np.linalg.norm(u) * np.linalg.norm(v)
    assert turned_u @ turned_v == pytest.approx(u @ v, abs=1e-13 * scale)
    np.testing.assert_allclose(
        np.cross(turned_u, turned_v), so3.rotate(q, np.cross(u, v)), atol=1e-13 * scale
    )


# --- the same rotations as scipy's ------------------------------------------------------------


@given(rotations())
def test_a_matrix_has_the_turned_axes_for_columns_to_the_last_bit(q):
    turned = [so3.rotate(q, axis) for axis in np.eye(3)]
    np.testing.assert_array_equal(so3.to_matrix(q), np.stack(turned, axis=-1))


@given(rotations(), rotations(), vectors)
def test_scipy_composes_turns_and_inverts_the_same(p, q, v):
    same(so3.multiply(p, q), of_scipy(to_scipy(p) * to_scipy(q)))
    same(so3.conjugate(q), of_scipy(to_scipy(q).inv()))
    np.testing.assert_allclose(so3.rotate(q, v), to_scipy(q).apply(v), atol=1e-11)


@given(rotations())
@example(np.array([0.0, 1.0, 0.0, 0.0]))
@example(np.array([0.0, 0.0, -1.0, 0.0]))
@example(np.array([0.0, 0.0, 0.0, 1.0]))
@example(so3.IDENTITY)
def test_scipy_has_the_same_matrices_both_ways(q):
    matrix = so3.to_matrix(q)
    np.testing.assert_allclose(matrix, to_scipy(q).as_matrix(), atol=1e-14)
    back = so3.from_matrix(matrix)
    same(back, q)
    assert back[0] >= 0.0


@given(rotations(), rotations())
def test_scipy_measures_the_same_angle_between(p, q):
    angle = (to_scipy(p).inv() * to_scipy(q)).magnitude()
    assert so3.angle_between(p, q) == pytest.approx(angle, abs=1e-7)


@given(arrays(float, 3, elements=st.floats(-10.0, 10.0)))
def test_scipy_has_the_same_exponential(v):
    same(so3.exp(v), of_scipy(Rotation.from_rotvec(v)))


@given(rotations(), st.floats(-10.0, 10.0))
def test_an_axis_and_an_angle_are_a_rotation_vector(q, angle):
    axis = so3.rotate(q, np.array([0.0, 0.0, 1.0]))
    same(so3.from_axis_angle(axis, angle), so3.exp(axis * angle), atol=1e-13)


# --- logarithm --------------------------------------------------------------------------------


@given(arrays(float, 3, elements=unit), st.floats(0.0, np.pi - 1e-6))
def test_the_logarithm_inverts_the_exponential_up_to_a_half_turn(axis, angle):
    length = np.linalg.norm(axis)
    v = axis / length * angle if length > 1e-3 else axis
    np.testing.assert_allclose(so3.log(so3.exp(v)), v, atol=1e-13)


@given(rotations())
def test_the_logarithm_is_the_shorter_turn_whatever_the_quaternions_sign(q):
    v = so3.log(q)
    assert np.linalg.norm(v) <= np.pi + 4 * EPS
    same(so3.exp(v), q)
    if q[0] != 0.0:  # of a half turn, both directions are as short
        np.testing.assert_array_equal(so3.log(-q), v)


@pytest.mark.parametrize("size", [0.0, 1e-150, 1e-16, 1e-12, 1e-9, 1e-5])
def test_small_turns_keep_every_digit(size):
    v = size * np.array([0.6, -0.48, 0.64])
    np.testing.assert_allclose(so3.exp(v)[1:], 0.5 * v, rtol=1e-10, atol=0.0)
    np.testing.assert_allclose(so3.log(so3.exp(v)), v, rtol=1e-10, atol=0.0)
    angle = so3.angle_between(so3.IDENTITY, so3.exp(v))
    assert angle == pytest.approx(size, rel=1e-10, abs=0.0)


# --- heading ----------------------------------------------------------------------------------


@given(rotations(), angles)
def test_turning_the_world_about_the_vertical_adds_to_the_heading(q, angle):
    turned = so3.heading(so3.multiply(so3.about_z(angle), q)) - so3.heading(q) - angle
    if np.hypot(q[0], q[3]) > 1e-6:  # upside down there is no heading
        assert np.cos(turned) == pytest.approx(1.0, abs=1e-9)


@given(rotations())
def test_without_its_heading_a_rotation_does_not_turn_about_the_vertical(q):
    inclination = so3.multiply(so3.about_z(-so3.heading(q)), q)
    assert inclination[3] == pytest.approx(0.0, abs=4 * EPS)


@given(rotations(), st.floats(-np.pi, np.pi))
def test_no_turn_about_the_vertical_comes_nearer_than_the_heading(q, angle):
    nearest = so3.angle_between(so3.about_z(so3.heading(q)), q)
    assert nearest <= so3.angle_between(so3.about_z(angle), q) + 1e-7


# --- arrays -----------------------------------------------------------------------------------


def test_leading_axes_broadcast_and_no_number_depends_on_its_neighbours():
    rng = np.random.default_rng(1)
    p = so3.normalize(rng.normal(size=(5, 1, 4)))
    q = so3.normalize(rng.normal(size=(3, 4)))
    v = rng.normal(size=(5, 3, 3))
    product, turned = so3.multiply(p, q), so3.rotate(q, v)
    assert product.shape == (5, 3, 4)
    for i, j in np.ndindex(5, 3):
        np.testing.assert_array_equal(product[i, j], so3.multiply(p[i, 0], q[j]))
        np.testing.assert_array_equal(turned[i, j], so3.rotate(q[j], v[i, j]))
        np.testing.assert_array_equal(so3.log(product)[i, j], so3.log(product[i, j]))
        np.testing.assert_array_equal(
            so3.from_matrix(so3.to_matrix(product))[i, j],
            so3.from_matrix(so3.to_matrix(product[i, j])),
        )


def test_the_shared_identity_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        so3.IDENTITY[0] = 0.0
