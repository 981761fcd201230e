"""Frames that move in other frames, with first and second derivatives, exact.

A chain of them composes as rotations do: ``a_c = a_b.then(b_c)``. Whatever turns or slides, a
joint, a sensor on skin, is one link more in the chain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3


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
        arm = so3.rotate(self.q, inner.t)
        speed = so3.rotate(self.q, inner.v)
        turning = so3.rotate(self.q, inner.omega)
        around = cross(self.omega, arm)
        return Moving(
            q=so3.multiply(self.q, inner.q),
            t=self.t + arm,
            omega=self.omega + turning,
            v=self.v + around + speed,
            alpha=self.alpha + so3.rotate(self.q, inner.alpha) + cross(self.omega, turning),
            a=(
                self.a
                + cross(self.alpha, arm)
                + cross(self.omega, around + 2.0 * speed)  # the second is Coriolis'
                + so3.rotate(self.q, inner.a)
            ),
        )

    def carrying(self, q: Float[Array, "*#n 4"], t: Float[Array, "*#n 3"]) -> Moving:
        """As `then`, of a frame that is fixed in b: cheaper."""
        arm = so3.rotate(self.q, t)
        around = cross(self.omega, arm)
        return Moving(
            q=so3.multiply(self.q, q),
            t=self.t + arm,
            omega=self.omega,
            v=self.v + around,
            alpha=self.alpha,
            a=self.a + cross(self.alpha, arm) + cross(self.omega, around),
        )

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
    q = so3.from_axis_angle(axis, angle)
    omega, alpha = rate[..., None] * axis, acceleration[..., None] * axis
    arm = -so3.rotate(q, through)  # from the axis to the frame's origin
    v = cross(omega, arm)
    return Moving(q, through + arm, omega, v, alpha, cross(alpha, arm) + cross(omega, v))


def stacked(parts: list[Moving]) -> Moving:
    """Frames side by side, on a new axis before the last."""
    return Moving(*(np.stack([getattr(p, name) for p in parts], axis=-2) for name in _FIELDS))


def cross(a: Float[Array, "*#n 3"], b: Float[Array, "*#n 3"]) -> Float[Array, "*n 3"]:
    """Cross product; numpy's spends most of its time on generality that nobody needs here."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)
