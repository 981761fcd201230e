"""Frames that move in other frames, with first and second derivatives, exact.

A chain of them composes as rotations do: ``a_c = a_b.then(b_c)``. Whatever turns or slides, a
joint, a sensor on skin, is one link more in the chain.

Arrays look as everywhere, the vector last, but in memory components come first: what is computed
goes through whole planes of them, twice as fast.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class Moving:
    """Frame b in frame a, everything written in a.

    Attributes:
        q: Attitude ``q_a_b``.
        t: Place of b's origin [m].
        omega: Angular velocity of b against a [rad/s].
        v: Velocity of b's origin [m/s].
        alpha: Derivative of ``omega`` in a [rad/s²].
        a: Derivative of ``v`` in a [m/s²].
    """

    q: Float[Array, "*n 4"]
    t: Float[Array, "*n 3"]
    omega: Float[Array, "*n 3"]
    v: Float[Array, "*n 3"]
    alpha: Float[Array, "*n 3"]
    a: Float[Array, "*n 3"]

    def __getitem__(self, part: Any) -> Moving:
        return Moving(*(getattr(self, name)[part] for name in _FIELDS))

    def then(self, inner: Moving) -> Moving:
        """Frame c in a, where ``self`` is b in a and ``inner`` is c in b."""
        arm, speed, turning, alpha, a = rotate_all(
            self.q, (inner.t, inner.v, inner.omega, inner.alpha, inner.a)
        )
        around = cross(self.omega, arm)
        return Moving(
            q=multiply(self.q, inner.q),
            t=self.t + arm,
            omega=self.omega + turning,
            v=self.v + around + speed,
            alpha=self.alpha + alpha + cross(self.omega, turning),
            a=(
                self.a
                + cross(self.alpha, arm)
                + cross(self.omega, around + 2.0 * speed)  # the second is Coriolis'
                + a
            ),
        )

    def carrying(self, q: Float[Array, "*#n 4"], t: Float[Array, "*#n 3"]) -> Moving:
        """As `then`, of a frame that is fixed in b: cheaper."""
        arm = rotate(self.q, t)
        around = cross(self.omega, arm)
        return Moving(
            q=multiply(self.q, q),
            t=self.t + arm,
            omega=self.omega,
            v=self.v + around,
            alpha=self.alpha,
            a=self.a + cross(self.alpha, arm) + cross(self.omega, around),
        )

    def seen_from(self, q: Float[Array, "*#n 4"], t: Float[Array, "*#n 3"]) -> Moving:
        """Frame b in a frame that has a fixed in it, at this attitude and place."""
        vectors = (self.t, self.omega, self.v, self.alpha, self.a)
        place, omega, v, alpha, a = rotate_all(q, vectors)
        return Moving(multiply(q, self.q), t + place, omega, v, alpha, a)

    def slid(
        self, t: Float[Array, "*#n 3"], v: Float[Array, "*#n 3"], a: Float[Array, "*#n 3"]
    ) -> Moving:
        """The same frame, moved in a without turning."""
        return Moving(self.q, self.t + t, self.omega, self.v + v, self.alpha, self.a + a)


_FIELDS = tuple(Moving.__dataclass_fields__)


def turning(
    axis: Float[Array, "*#n 3"],
    through: Float[Array, "*#n 3"],
    angle: Float[Array, "*n"],
    rate: Float[Array, "*n"],
    acceleration: Float[Array, "*n"],
) -> Moving:
    """A frame that turns about a fixed unit axis through a fixed point [rad, rad/s, rad/s²]."""
    q = from_axis_angle(axis, angle)
    omega, alpha = along(axis, rate), along(axis, acceleration)
    arm = rotate(q, -through)  # from the axis to the frame's origin
    v = cross(omega, arm)
    return Moving(q, through + arm, omega, v, alpha, cross(alpha, arm) + cross(omega, v))


def planes_first(vectors: Float[Array, "*n d"]) -> Float[Array, "d *n"]:
    """Components on the first axis: a view. What `np.moveaxis` does, in a tenth of its time."""
    last = vectors.ndim - 1
    return vectors.transpose(last, *range(last))


def vectors_last(planes: Float[Array, "d *n"]) -> Float[Array, "*n d"]:
    """Components on the last axis: a view, the inverse of `planes_first`."""
    return planes.transpose(*range(1, planes.ndim), 0)


def picked(moving: Moving, columns: list[int]) -> Moving:
    """Some of the frames (n, k), in this order."""
    return Moving(
        *(
            vectors_last(np.take(planes_first(getattr(moving, name)), columns, axis=-1))
            for name in _FIELDS
        )
    )


def stacked(parts: list[Moving]) -> Moving:
    """Frames side by side, on a new axis before the last."""
    return Moving(*(np.stack([getattr(p, name) for p in parts], axis=-2) for name in _FIELDS))


def cross(a: Float[Array, "*#n 3"], b: Float[Array, "*#n 3"]) -> Float[Array, "*n 3"]:
    """Cross product; numpy's spends most of its time on generality that nobody needs here."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    x = ay * bz
    out = np.empty((3, *x.shape))
    np.subtract(x, az * by, out=out[0])
    np.subtract(az * bx, ax * bz, out=out[1])
    np.subtract(ax * by, ay * bx, out=out[2])
    return vectors_last(out)


def rotate(q: Float[Array, "*#n 4"], v: Float[Array, "*#n 3"]) -> Float[Array, "*n 3"]:
    """As `so3.rotate`, ``v_a = rotate(q_a_b, v_b)``, components first in memory."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    a, b, c = v[..., 0], v[..., 1], v[..., 2]
    ta, tb, tc = y * c - z * b, z * a - x * c, x * b - y * a
    ta, tb, tc = ta + ta, tb + tb, tc + tc
    out = np.empty((3, *ta.shape))
    for i, (own, t, crossed) in enumerate(
        ((a, ta, y * tc - z * tb), (b, tb, z * ta - x * tc), (c, tc, x * tb - y * ta))
    ):
        np.multiply(w, t, out=out[i])
        out[i] += crossed
        out[i] += own
    return vectors_last(out)


def rotate_all(
    q: Float[Array, "*#n 4"], vectors: tuple[Float[Array, "*#n 3"], ...]
) -> list[Float[Array, "*n 3"]]:
    """Several vectors of one shape, each as `rotate` does, but by the matrix: cheaper."""
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    x2, y2, z2 = x + x, y + y, z + z
    xx, yy, zz = x * x2, y * y2, z * z2
    xy, xz, yz = x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    rows = (
        (1.0 - (yy + zz), xy - wz, xz + wy),
        (xy + wz, 1.0 - (xx + zz), yz - wx),
        (xz - wy, yz + wx, 1.0 - (xx + yy)),
    )
    a, b, c = np.stack([planes_first(v) for v in vectors], axis=1)
    out = np.empty((3, *np.broadcast_shapes(a.shape, w.shape)))
    for i, (ma, mb, mc) in enumerate(rows):
        np.multiply(ma, a, out=out[i])
        out[i] += mb * b
        out[i] += mc * c
    return [vectors_last(out[:, i]) for i in range(len(vectors))]


def multiply(p: Float[Array, "*#n 4"], q: Float[Array, "*#n 4"]) -> Float[Array, "*n 4"]:
    """As `so3.multiply`, ``q_a_c = multiply(q_a_b, q_b_c)``, components first in memory."""
    pw, px, py, pz = p[..., 0], p[..., 1], p[..., 2], p[..., 3]
    qw, qx, qy, qz = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    w = pw * qw - px * qx - py * qy - pz * qz
    out = np.empty((4, *w.shape))
    out[0] = w
    out[1] = pw * qx + px * qw + py * qz - pz * qy
    out[2] = pw * qy - px * qz + py * qw + pz * qx
    out[3] = pw * qz + px * qy - py * qx + pz * qw
    return vectors_last(out)


def from_axis_angle(axis: Float[Array, "*#n 3"], angle: Float[Array, "*n"]) -> Float[Array, "*n 4"]:
    """As `so3.from_axis_angle`, components first in memory."""
    half = 0.5 * angle
    sine = np.sin(half)
    out = np.empty((4, *half.shape))
    np.cos(half, out=out[0])
    for i in range(3):
        np.multiply(sine, axis[..., i], out=out[i + 1])
    return vectors_last(out)


def along(axis: Float[Array, "*#n 3"], length: Float[Array, "*n"]) -> Float[Array, "*n 3"]:
    """``length`` times ``axis``, components first in memory."""
    out = np.empty((3, *length.shape))
    for i in range(3):
        np.multiply(length, axis[..., i], out=out[i])
    return vectors_last(out)
