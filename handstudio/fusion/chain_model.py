"""What the sensors of a chain should read: H1, H2 and H3 of the thesis (4.3.1).

Pure functions of attitudes, (c, l): chains, and sensors along each, root first. Each returns what
is expected and its exact slopes by the Euler angles phi, theta, psi of all sensors of the chain and
by the elbow's acceleration. A turn of an angle is one about an axis of the world, ``d(R v) = u x
R v``, and all slopes are made of that. Accelerations [m/s²] are specific forces, +9.81 upward at
rest, so that ``g`` points up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.samples import STANDARD_GRAVITY

UP = np.array([0.0, 0.0, STANDARD_GRAVITY])
"""``g`` in the world, as an accelerometer at rest reads it."""


@dataclass(frozen=True, slots=True, eq=False)
class Attitudes:
    """Rotations ``R_GS`` of sensors (2.7), and about which axes of the world their angles turn."""

    r: Float[Array, "c l 3 3"]
    axes: Float[Array, "c l 3 3"]  # one a row: of phi, theta and psi


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """Readings as they should be, and how they change.

    Attributes:
        value: Three components a sensor.
        by_angles: By all angles of the chain [1/rad].
        by_elbow: By the elbow's acceleration.
    """

    value: Float[Array, "c l 3"]
    by_angles: Float[Array, "c l 3 a"]
    by_elbow: Float[Array, "c l 3 3"]


def attitudes(angles: Float[Array, "c l 3"]) -> Attitudes:
    """Rotations of sensors with these angles [rad], ``Rz(psi) Ry(theta) Rx(phi)``."""
    sin, cos = np.sin(angles), np.cos(angles)
    (sx, sy, sz), (cx, cy, cz) = np.moveaxis(sin, -1, 0), np.moveaxis(cos, -1, 0)
    r = np.empty((*angles.shape, 3))
    r[..., 0, 0], r[..., 0, 1], r[..., 0, 2] = (
        cz * cy,
        cz * sy * sx - sz * cx,
        cz * sy * cx + sz * sx,
    )
    r[..., 1, 0], r[..., 1, 1], r[..., 1, 2] = (
        sz * cy,
        sz * sy * sx + cz * cx,
        sz * sy * cx - cz * sx,
    )
    r[..., 2, 0], r[..., 2, 1], r[..., 2, 2] = -sy, cy * sx, cy * cx
    axes = np.zeros_like(r)
    axes[..., 0, :] = r[..., :, 0]
    axes[..., 1, 0], axes[..., 1, 1] = -sz, cz
    axes[..., 2, 2] = 1.0
    return Attitudes(r, axes)


def rotational(
    gyr: Float[Array, "*b 3"], change: Float[Array, "*b 3"], lever: Float[Array, "*#b 3"]
) -> Float[Array, "*b 3"]:
    """Acceleration at the end of a lever [m] that turns about its start (3.1, 4.27, 4.28, 4.30).

    ``gyr`` [rad/s] and its ``change`` [rad/s²] are in the lever's frame, and so is the result.
    """
    return cross(change, lever) + cross(gyr, cross(gyr, lever))


def accumulated(
    at: Attitudes, carried: Float[Array, "c l 3"], elbow: Float[Array, "c 3"]
) -> Expected:
    """H1 (4.26, with (4.37) in every row): acceleration at each sensor's own joint, in its frame.

    ``R_Sj' (g + a_e + sum over k < j of R_Sk a_r,Jk+1)``: gravity, the elbow, and what the links
    from the root on add by turning.

    Args:
        at: Attitudes.
        carried: What each link adds at its far joint, in its sensor's frame (4.28).
        elbow: Acceleration of the elbow, in the world.
    """
    turned = _forth(at.r, carried)
    felt = np.empty_like(turned)
    felt[:, 0] = elbow + UP
    felt[:, 1:] = turned[:, :-1]
    felt = np.cumsum(felt, axis=1)
    links = turned.shape[1]
    below = np.tri(links, k=-1)[:, :, None, None]
    slopes = below * cross(at.axes, turned[..., None, :])[:, None]
    own = np.arange(links)
    slopes[:, own, own] = cross(felt[..., None, :], at.axes)
    return Expected(_back(at.r, felt), _seen(at.r, slopes), np.swapaxes(at.r, -1, -2))


def from_before(
    at: Attitudes, before: Float[Array, "c l 3"], elbow: Float[Array, "c 3"]
) -> Expected:
    """H2 (4.29, 4.32), first half: acceleration at each joint, from the sensor before to its own.

    ``R_Sj' R_S(j-1) a_Jj``; in the first row ``R_S1' (g + a_e)``.

    Args:
        at: Attitudes.
        before: What each sensor feels at the chain's next joint, in its own frame.
        elbow: Acceleration of the elbow, in the world.
    """
    turned = _forth(at.r, before)
    felt = np.empty_like(turned)
    felt[:, 0] = elbow + UP
    felt[:, 1:] = turned[:, :-1]
    links = turned.shape[1]
    own, other = np.arange(links), np.arange(links - 1)
    slopes = np.zeros((len(felt), links, links, 3, 3))
    slopes[:, own, own] = cross(felt[..., None, :], at.axes)
    slopes[:, other + 1, other] = cross(at.axes[:, :-1], felt[:, 1:, None])
    by_elbow = np.zeros_like(at.r)
    by_elbow[:, 0] = np.swapaxes(at.r[:, 0], -1, -2)
    return Expected(_back(at.r, felt), _seen(at.r, slopes), by_elbow)


def from_beyond(at: Attitudes, own: Float[Array, "c l 3"], elbow: Float[Array, "c 3"]) -> Expected:
    """H2 (4.29, 4.32), second half: acceleration at each joint, from its own sensor to that before.

    ``R_S(j-1)' R_Sj a_Jj``; in the first row ``R_S1 a_J1 - a_e``, which should be gravity: what is
    observed may not depend on the state, so the elbow stands on this side of (4.37).

    Args:
        at: Attitudes.
        own: What each sensor feels at its own joint, in its own frame.
        elbow: Acceleration of the elbow, in the world.
    """
    felt = _forth(at.r, own)
    links = felt.shape[1]
    to = np.empty_like(at.r)
    to[:, 0], to[:, 1:] = np.eye(3), at.r[:, :-1]
    each, other = np.arange(links), np.arange(links - 1)
    slopes = np.zeros((len(felt), links, links, 3, 3))
    slopes[:, each, each] = cross(at.axes, felt[..., None, :])
    slopes[:, other + 1, other] = cross(felt[:, 1:, None], at.axes[:, :-1])
    value = _back(to, felt)
    value[:, 0] -= elbow
    by_elbow = np.zeros_like(at.r)
    by_elbow[:, 0] = -np.eye(3)
    return Expected(value, _seen(to, slopes), by_elbow)


def horizontal(
    at: Attitudes, mag: Float[Array, "c l 3"], heading_rad: Float[Array, "c l"]
) -> Expected:
    """H3 (4.34, 4.35): the level part of the field, turned back by the heading's correction.

    ``Rz0(-psi_cor) R_Sj m``, which should be ``(M, 0, 0)`` (4.33). The third component is 0 = 0.
    """
    field = _forth(at.r, mag)
    links = field.shape[1]
    each = np.arange(links)
    slopes = np.zeros((len(field), links, links, 3, 3))
    slopes[:, each, each] = cross(at.axes, field[..., None, :])
    sin, cos = np.sin(heading_rad), np.cos(heading_rad)
    to = np.zeros_like(at.r)  # its transpose is Rz0(-psi_cor)
    to[..., 0, 0] = to[..., 1, 1] = cos
    to[..., 1, 0], to[..., 0, 1] = sin, -sin
    return Expected(_back(to, field), _seen(to, slopes), np.zeros_like(at.r))


def cross(a: Float[Array, "*#b 3"], b: Float[Array, "*#b 3"]) -> Float[Array, "*b 3"]:
    """The vector product; numpy's own takes thrice as long on so few."""
    product: Array = a[..., _YZX] * b[..., _ZXY] - a[..., _ZXY] * b[..., _YZX]
    return product


_YZX = np.array([1, 2, 0])
_ZXY = np.array([2, 0, 1])


def _forth(r: Array, v: Array) -> Array:
    turned: Array = (r @ v[..., None])[..., 0]
    return turned


def _back(r: Array, v: Array) -> Array:
    turned: Array = (v[..., None, :] @ r)[..., 0, :]
    return turned


def _seen(r: Array, slopes: Array) -> Array:
    """Slopes in the world, (c, j, k, angle, 3), as frame j has them: (c, j, 3, k angle)."""
    c, links = slopes.shape[:2]
    seen = slopes.reshape(c, links, 3 * links, 3) @ r
    return np.swapaxes(seen, -1, -2)
