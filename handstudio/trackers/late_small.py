"""One rotation at a time, in plain floats: for a loop that goes from sample to sample.

As `maths.so3`, scalar first, but for single quaternions and vectors as tuples: the way through
numpy costs ten times what is done there.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np

Quaternion: TypeAlias = tuple[float, float, float, float]
Vector: TypeAlias = tuple[float, float, float]

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)


def multiply(p: Quaternion, q: Quaternion) -> Quaternion:
    """``q_a_c = multiply(q_a_b, q_b_c)``, of unit length where both are but for rounding."""
    pw, px, py, pz = p
    qw, qx, qy, qz = q
    return (
        pw * qw - px * qx - py * qy - pz * qz,
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """``q_b_a``."""
    return (q[0], -q[1], -q[2], -q[3])


def normalize(q: Quaternion) -> Quaternion:
    """Of unit length."""
    w, x, y, z = q
    scale = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    return (w * scale, x * scale, y * scale, z * scale)


def exp(x: float, y: float, z: float) -> Quaternion:
    """Rotation of a rotation vector [rad]."""
    angle = math.sqrt(x * x + y * y + z * z)
    scale = math.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return (math.cos(0.5 * angle), scale * x, scale * y, scale * z)


def log(q: Quaternion) -> Vector:
    """Rotation vector [rad] of the shorter turn."""
    w, x, y, z = q if q[0] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 * math.atan2(sine, w) / sine if sine > 1e-12 else 2.0
    return (scale * x, scale * y, scale * z)


def between(p: Quaternion, q: Quaternion, share: float) -> Quaternion:
    """On the way from one to a near other: the chord's, not the arc's."""
    rest = 1.0 - share if sum(a * b for a, b in zip(p, q, strict=True)) >= 0.0 else share - 1.0
    pw, px, py, pz = p
    qw, qx, qy, qz = q
    return normalize(
        (
            rest * pw + share * qw,
            rest * px + share * qx,
            rest * py + share * qy,
            rest * pz + share * qz,
        )
    )


def to_matrix(q: Quaternion) -> Any:
    """Rotation matrix, (3, 3)."""
    w, x, y, z = q
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )
