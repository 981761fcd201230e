"""Rotations as unit quaternions, scalar first.

``q_a_b`` takes vectors written in frame b to frame a: ``v_a = rotate(q_a_b, v_b)``, and
``q_a_c = multiply(q_a_b, q_b_c)``. The last axis is the quaternion or vector, leading axes
broadcast.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array

IDENTITY: Array = np.array([1.0, 0.0, 0.0, 0.0])
IDENTITY.setflags(write=False)


def multiply(p: Float[Array, "*#b 4"], q: Float[Array, "*#b 4"]) -> Float[Array, "*b 4"]:
    """Compose rotations: ``q_a_c = multiply(q_a_b, q_b_c)``."""
    pw, px, py, pz = np.moveaxis(p, -1, 0)
    qw, qx, qy, qz = np.moveaxis(q, -1, 0)
    return np.stack(
        [
            pw * qw - px * qx - py * qy - pz * qz,
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
        ],
        axis=-1,
    )


def conjugate(q: Float[Array, "*b 4"]) -> Float[Array, "*b 4"]:
    """Invert rotations: ``q_b_a = conjugate(q_a_b)``."""
    inverse: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return inverse


def rotate(q: Float[Array, "*#b 4"], v: Float[Array, "*#b 3"]) -> Float[Array, "*b 3"]:
    """Rotate vectors: ``v_a = rotate(q_a_b, v_b)``."""
    # in components: numpy's cross product costs more than all the rest on small arrays
    w, x, y, z = np.moveaxis(q, -1, 0)
    a, b, c = np.moveaxis(v, -1, 0)
    ta, tb, tc = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return np.stack(
        [
            a + w * ta + y * tc - z * tb,
            b + w * tb + z * ta - x * tc,
            c + w * tc + x * tb - y * ta,
        ],
        axis=-1,
    )


def normalize(q: Float[Array, "*b 4"]) -> Float[Array, "*b 4"]:
    """Scale to unit length."""
    unit: Array = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return unit


def from_axis_angle(
    axis: Float[Array, "*#b 3"], angle: Float[Array, "*#b"] | float
) -> Float[Array, "*b 4"]:
    """Rotation by ``angle`` [rad] about a unit ``axis``, right-handed."""
    half = 0.5 * np.asarray(angle, dtype=float)[..., None]
    sine = np.sin(half) * axis
    return np.concatenate([np.broadcast_to(np.cos(half), (*sine.shape[:-1], 1)), sine], axis=-1)


def exp(v: Float[Array, "*b 3"]) -> Float[Array, "*b 4"]:
    """Rotation of a rotation vector [rad]."""
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    # sinc keeps the small-angle limit exact: sin(a/2)/a -> 1/2
    return np.concatenate([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * v], axis=-1)


def log(q: Float[Array, "*b 4"]) -> Float[Array, "*b 3"]:
    """Rotation vector [rad] of the shorter turn, length in [0, pi]."""
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., :1])
    scale = np.where(sine > 1e-12, angle / np.where(sine > 1e-12, sine, 1.0), 2.0)
    vector: Array = scale * q[..., 1:]
    return vector


def angle_between(p: Float[Array, "*#b 4"], q: Float[Array, "*#b 4"]) -> Float[Array, "*b"]:
    """Angle [rad] of the rotation that takes one orientation to the other, in [0, pi]."""
    return np.asarray(np.linalg.norm(log(multiply(conjugate(p), q)), axis=-1))


def to_matrix(q: Float[Array, "*b 4"]) -> Float[Array, "*b 3 3"]:
    """Rotation matrices: columns are the axes of b written in a."""
    # the products of `rotate` of each axis, in its order, so that both give the same digits
    w, x, y, z = np.moveaxis(q, -1, 0)
    x2, y2, z2 = 2.0 * x, 2.0 * y, 2.0 * z
    rows = [
        *(1.0 - y * y2 - z * z2, y * x2 - w * z2, w * y2 + z * x2),
        *(w * z2 + x * y2, 1.0 - z * z2 - x * x2, z * y2 - w * x2),
        *(x * z2 - w * y2, w * x2 + y * z2, 1.0 - x * x2 - y * y2),
    ]
    return np.stack(rows, axis=-1).reshape(*q.shape[:-1], 3, 3)


def from_matrix(m: Float[Array, "*b 3 3"]) -> Float[Array, "*b 4"]:
    """Unit quaternions (w >= 0) of rotation matrices."""
    t = np.stack(
        [
            1.0 + m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2],
            1.0 + m[..., 0, 0] - m[..., 1, 1] - m[..., 2, 2],
            1.0 - m[..., 0, 0] + m[..., 1, 1] - m[..., 2, 2],
            1.0 - m[..., 0, 0] - m[..., 1, 1] + m[..., 2, 2],
        ],
        axis=-1,
    )
    wx, wy, wz = (
        m[..., 2, 1] - m[..., 1, 2],
        m[..., 0, 2] - m[..., 2, 0],
        m[..., 1, 0] - m[..., 0, 1],
    )
    xy, xz, yz = (
        m[..., 0, 1] + m[..., 1, 0],
        m[..., 0, 2] + m[..., 2, 0],
        m[..., 1, 2] + m[..., 2, 1],
    )
    # four candidate rows, each well conditioned where its own diagonal term is the largest
    rows = np.stack(
        [
            np.stack([t[..., 0], wx, wy, wz], axis=-1),
            np.stack([wx, t[..., 1], xy, xz], axis=-1),
            np.stack([wy, xy, t[..., 2], yz], axis=-1),
            np.stack([wz, xz, yz, t[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(t, axis=-1)[..., None, None]
    q = normalize(np.take_along_axis(rows, best, axis=-2)[..., 0, :])
    return np.where(q[..., :1] < 0.0, -q, q)


def heading(q: Float[Array, "*b 4"]) -> Float[Array, "*b"]:
    """Angle [rad] of the turn about the vertical nearest to the whole rotation.

    Removing it (``multiply(about_z(-heading(q)), q)``) leaves the inclination part, whose own
    z component is zero.
    """
    return np.asarray(2.0 * np.arctan2(q[..., 3], q[..., 0]))


def about_z(angle: Float[Array, "*b"] | float) -> Float[Array, "*b 4"]:
    """Rotation by ``angle`` [rad] about z."""
    half = 0.5 * np.asarray(angle, dtype=float)
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)
