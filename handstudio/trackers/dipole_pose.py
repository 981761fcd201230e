"""From nine signals of crossed coils to a pose: in closed form, then by least squares.

``S^T S = (k / r³)² (3 u u^T + 1)`` knows nothing of the attitude: its eigenvalues are 4, 1 and 1
times ``(k / r³)²``, and the first eigenvector is u, up to its sign: both halves of the room sound
alike (Raab et al. 1979). The attitude then is ``R = (S C^-1)^T`` with the coupling C, which has no
sign of u in it, made orthogonal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.dipole import coupling

_STEPS = 8
_DONE = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class CoilPose:
    """A pose and how sure it is.

    Attributes:
        t_room_terminal: [m].
        q_room_terminal: Attitude.
        covariance: Of place [m²] and attitude (a small turn in the terminal's frame [rad²]).
        residual: Signals that are left, RMS over nine.
    """

    t_room_terminal: Float[Array, "*n 3"]
    q_room_terminal: Float[Array, "*n 4"]
    covariance: Float[Array, "*n 6 6"]
    residual: Float[Array, "*n"]


def closed_form(
    heard: Float[Array, "*n 3 3"], towards: Float[Array, "*#n 3"], gain: float = 1.0
) -> tuple[Float[Array, "*n 3"], Float[Array, "*n 4"]]:
    """Place [m] and attitude, exact for signals without noise.

    Args:
        heard: Signals, as `dipole.signals`.
        towards: Any vector into the half of the room that the receiver is in.
        gain: Of coils and receiver, as there.

    Raises:
        TrackError: the coils hear nothing.
    """
    if not np.all(np.isfinite(heard)) or np.any(np.abs(heard).max(axis=(-2, -1)) == 0.0):
        raise TrackError(
            "A receiver hears nothing.", "Check its cable, and bring it nearer to the transmitter."
        )
    power, axes = np.linalg.eigh(np.swapaxes(heard, -1, -2) @ heard)
    u = axes[..., -1]
    u = np.where(np.sum(u * towards, axis=-1, keepdims=True) < 0.0, -u, u)
    # all three eigenvalues tell the distance: their sum is 6 (k / r³)²
    strength = np.sqrt(power.sum(axis=-1) / 6.0)
    t = u * np.cbrt(gain / strength)[..., None]
    turned = np.swapaxes(heard @ np.linalg.inv(coupling(t)), -1, -2)
    return t, so3.from_matrix(_nearest_rotation(turned))


def refined(
    heard: Float[Array, "*n 3 3"],
    t_room_terminal: Float[Array, "*n 3"],
    q_room_terminal: Float[Array, "*n 4"],
    noise: float,
    gain: float = 1.0,
) -> CoilPose:
    """Least squares over all nine signals, from a pose nearby, by Gauss and Newton's way.

    Args:
        heard: Signals.
        t_room_terminal: Where to start: `closed_form`'s, or the pose before.
        q_room_terminal: And at which attitude.
        noise: Standard deviation of a signal.
        gain: Of coils and receiver.
    """
    t, q = t_room_terminal, q_room_terminal
    for _ in range(_STEPS):
        expected, slopes = _expected(t, q, gain)
        left = (heard - expected).reshape(*t.shape[:-1], 9)
        normal = np.swapaxes(slopes, -1, -2) @ slopes
        step = np.linalg.solve(normal, np.swapaxes(slopes, -1, -2) @ left[..., None])[..., 0]
        t, q = t + step[..., :3], so3.multiply(q, so3.exp(step[..., 3:]))
        if np.abs(step).max() < _DONE:
            break
    expected, slopes = _expected(t, q, gain)
    covariance = noise**2 * np.linalg.inv(np.swapaxes(slopes, -1, -2) @ slopes)
    left = (heard - expected).reshape(*t.shape[:-1], 9)
    return CoilPose(t, q, covariance, np.sqrt(np.mean(left**2, axis=-1)))


def _expected(t: Array, q: Array, gain: float) -> tuple[Array, Array]:
    """Signals at a pose, and their slopes with place and with a small turn of the terminal."""
    turned = np.swapaxes(so3.to_matrix(q), -1, -2)
    expected = gain * (turned @ coupling(t))
    slopes = np.empty((*t.shape[:-1], 9, 6))
    r2 = np.sum(t * t, axis=-1)[..., None, None]
    eye = np.eye(3)
    outer = t[..., :, None] * t[..., None, :]
    for axis in range(3):
        e = np.broadcast_to(eye[axis], t.shape)
        both = e[..., :, None] * t[..., None, :] + t[..., :, None] * e[..., None, :]
        along = t[..., axis, None, None]
        slope = 3.0 * both - 15.0 * outer * along / r2 + 3.0 * eye * along
        slope = slope / r2**2.5
        slopes[..., axis] = (gain * (turned @ slope)).reshape(*t.shape[:-1], 9)
        # a small turn a of the terminal: R^T becomes (1 - [a]x) R^T
        slopes[..., 3 + axis] = -np.cross(
            e[..., :, None], expected, axisa=-2, axisb=-2, axisc=-2
        ).reshape(*t.shape[:-1], 9)
    return expected, slopes


def _nearest_rotation(m: Array) -> Array:
    u, _, vt = np.linalg.svd(m)
    # a receiver with a coil wired backwards would come out mirrored; the nearest rotation is told
    flip = np.ones((*m.shape[:-2], 3))
    flip[..., 2] = np.sign(np.linalg.det(u @ vt))
    return np.asarray((u * flip[..., None, :]) @ vt)
