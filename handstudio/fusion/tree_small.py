"""Vectors and 3 x 3 matrices, compiled; results go into arrays that are given."""

from __future__ import annotations

from typing import no_type_check

import numpy as np

from handstudio.fusion.tree_compiled import compiled


@compiled
@no_type_check
def inverse3(a, b):
    """Inverse of a symmetric positive definite 3 x 3, into b."""
    c00 = a[1, 1] * a[2, 2] - a[1, 2] * a[1, 2]
    c01 = a[0, 2] * a[1, 2] - a[0, 1] * a[2, 2]
    c02 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    d = 1.0 / (a[0, 0] * c00 + a[0, 1] * c01 + a[0, 2] * c02)
    b[0, 0] = c00 * d
    b[0, 1] = b[1, 0] = c01 * d
    b[0, 2] = b[2, 0] = c02 * d
    b[1, 1] = (a[0, 0] * a[2, 2] - a[0, 2] * a[0, 2]) * d
    b[1, 2] = b[2, 1] = (a[0, 1] * a[0, 2] - a[0, 0] * a[1, 2]) * d
    b[2, 2] = (a[0, 0] * a[1, 1] - a[0, 1] * a[0, 1]) * d


@compiled
@no_type_check
def matrix(q, m):
    """Rotation matrix of a quaternion, into m."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    m[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    m[0, 1] = 2.0 * (x * y - w * z)
    m[0, 2] = 2.0 * (x * z + w * y)
    m[1, 0] = 2.0 * (x * y + w * z)
    m[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    m[1, 2] = 2.0 * (y * z - w * x)
    m[2, 0] = 2.0 * (x * z - w * y)
    m[2, 1] = 2.0 * (y * z + w * x)
    m[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@compiled
@no_type_check
def _exp(x, y, z):
    """Quaternion of a rotation vector, in parts."""
    angle2 = x * x + y * y + z * z
    if angle2 < 1e-8:
        c, s = 1.0 - angle2 / 8.0, 0.5 - angle2 / 48.0
    else:
        angle = np.sqrt(angle2)
        c, s = np.cos(0.5 * angle), np.sin(0.5 * angle) / angle
    return c, s * x, s * y, s * z


@compiled
@no_type_check
def turned_before(q, x, y, z):
    """Turn a quaternion by a rotation vector in the world, in place: exp(v) q."""
    c, a, b, d = _exp(x, y, z)
    w, i, j, k = q[0], q[1], q[2], q[3]
    q[0] = c * w - a * i - b * j - d * k
    q[1] = c * i + a * w + b * k - d * j
    q[2] = c * j - a * k + b * w + d * i
    q[3] = c * k + a * j - b * i + d * w


@compiled
@no_type_check
def turned_after(q, x, y, z):
    """Turn a quaternion by a rotation vector in its own frame, in place: q exp(v), unit again."""
    c, a, b, d = _exp(x, y, z)
    w, i, j, k = q[0], q[1], q[2], q[3]
    q[0] = w * c - i * a - j * b - k * d
    q[1] = i * c + w * a + j * d - k * b
    q[2] = j * c - i * d + w * b + k * a
    q[3] = k * c + i * b - j * a + w * d
    n = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for u in range(4):
        q[u] *= n


@compiled
@no_type_check
def square_to(f, weight, a):
    """Add ``weight [f]x' [f]x = weight (f'f 1 - f f')`` to a."""
    n = weight * (f[0] * f[0] + f[1] * f[1] + f[2] * f[2])
    for i in range(3):
        a[i, i] += n
        for j in range(3):
            a[i, j] -= weight * f[i] * f[j]


@compiled
@no_type_check
def cross_to(f, e, weight, a):
    """Add ``weight f x e`` to a."""
    a[0] += weight * (f[1] * e[2] - f[2] * e[1])
    a[1] += weight * (f[2] * e[0] - f[0] * e[2])
    a[2] += weight * (f[0] * e[1] - f[1] * e[0])


@compiled
@no_type_check
def at_joint(acc, w, dw, r, out):
    """Specific force at a point r from the sensor: ``a + dw x r + w x (w x r)``, sensor frame."""
    cx = w[1] * r[2] - w[2] * r[1]
    cy = w[2] * r[0] - w[0] * r[2]
    cz = w[0] * r[1] - w[1] * r[0]
    out[0] = acc[0] + dw[1] * r[2] - dw[2] * r[1] + w[1] * cz - w[2] * cy
    out[1] = acc[1] + dw[2] * r[0] - dw[0] * r[2] + w[2] * cx - w[0] * cz
    out[2] = acc[2] + dw[0] * r[1] - dw[1] * r[0] + w[0] * cy - w[1] * cx


@compiled
@no_type_check
def rotated(m, v, out):
    """Product of a matrix and a vector, into out."""
    for i in range(3):
        out[i] = m[i, 0] * v[0] + m[i, 1] * v[1] + m[i, 2] * v[2]


@compiled
@no_type_check
def times_by_rows(a, b, out):
    """Matrix product ``a b``, into out."""
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
