"""Least squares of a turn of the whole rig, for the headings of all its sensors.

In the axes of the rig at rest, z up, every sensor has the same angular velocity Ω, and the same
specific force f but for the place r it sits at:

    Ω_i = Ω,   f_i = f + dΩ/dt × r_i + Ω × (Ω × r_i)

What a sensor reads is turned there by its tilt at rest and the heading that is sought. It is off
by scales and cross axes of gyroscope and accelerometer, by biases, by what a gyroscope feels of
acceleration, by a delay, by a board that tilts as it is accelerated, by skin that lags behind. Each
is an unknown with a standard deviation (`Tolerances`); heading and place are free. Least squares
for every sensor against Ω and f, which are the means over sensors of what is so put right, in
turns: the most probable headings, with standard deviations. The accelerometers matter: their
errors across the axis are not the gyroscopes'. A sensor that does not fit has no part in the means.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.averages import averaged
from handstudio.calibration.level_headings import shared_headings
from handstudio.calibration.rig_turn import Common, Signals, common_of, refuse_turn
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

_ROUNDS = 3
_OUTLYING = 4.0  # times what is usual among the sensors
_USUAL_MISFIT, _USUAL_STRAIN = 0.3, 0.7  # at least
_ROUGHLY = 0.1, 0.05  # of the heading and the tilts, once started from one sample [rad]
_PLACE_M = 0.3
_TURNING = 3  # unknowns that turn a sensor: about z, x and y


class Tolerances(msgspec.Struct, frozen=True):
    """Standard deviations of what sensors are off by.

    Attributes:
        gyr_scale, acc_scale: Of an axis.
        gyr_cross, acc_cross: Of what an axis reads of another.
        gyr_bias: What is left of it after the rest [rad/s].
        acc_bias: Of an axis [m/s²].
        g_sensitivity: What a gyroscope's axis reads of acceleration [rad/s per m/s²].
        delay: Of a sensor against the mean [s].
        lag: Of skin, about the arm's axis, per rad of the turn.
        forearm_lag: The same on the forearm.
        board: How far a board on skin tilts as it is accelerated [rad per m/s²].
        gyr_noise: Of a gyroscope on a board that swings, in 10 ms [rad/s].
        acc_noise: Of an accelerometer there [m/s²].
    """

    gyr_scale: float = 0.01
    acc_scale: float = 0.01
    gyr_cross: float = 0.0067
    acc_cross: float = 0.0067
    gyr_bias: float = float(np.deg2rad(0.02))
    acc_bias: float = 0.010 * STANDARD_GRAVITY
    g_sensitivity: float = float(np.deg2rad(0.1)) / STANDARD_GRAVITY
    delay: float = 0.0004
    lag: float = 0.001
    forearm_lag: float = 0.02
    board: float = 0.004
    gyr_noise: float = float(np.deg2rad(1.0))
    acc_noise: float = 0.3


UNCALIBRATED = Tolerances()
"""Sensors as their maker delivers them."""

CALIBRATED = Tolerances(gyr_scale=0.002, acc_scale=0.002, gyr_cross=0.002, acc_cross=0.002)
"""Sensors whose scales and axes were calibrated."""


def tolerances_of(calibrated: bool) -> Tolerances:
    """What sensors are off by, whose own errors are known or not."""
    return CALIBRATED if calibrated else UNCALIBRATED


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What a round found; misfit and strain: RMS of what is left, and of the unknowns, in SDs."""

    q_body_level: Float[Array, "s 4"]
    sd: Float[Array, " s"]
    residual: Float[Array, " s"]
    together: Float[Array, " s"]
    misfit: Float[Array, " s"]
    strain: Float[Array, " s"]
    outlying: Bool[Array, " s"]
    common: Common


def solved(signals: Signals, tolerances: Tolerances, lag: Float[Array, " s"]) -> Found:
    """The most probable headings of all sensors.

    Args:
        signals: Of rest, turn and rest.
        tolerances: What the sensors are off by.
        lag: Of skin, for each sensor.

    Raises:
        CalibrationError: the rig was hardly turned, or about too steep an axis.
    """
    rate = so3.rotate(signals.q_level_sensor, signals.gyr)
    q_body_level = so3.about_z(shared_headings(rate, signals.weight))
    shared = np.median(signals.in_body(q_body_level), axis=1)
    common = common_of(signals, shared)
    refuse_turn(common)
    for _ in range(_ROUNDS):
        found, shared = _round(signals, common, q_body_level, tolerances, lag)
        q_body_level, common = found.q_body_level, common_of(signals, shared)
    return found


def _round(
    signals: Signals, common: Common, q_body_level: Array, tolerances: Tolerances, lag: Array
) -> tuple[Found, Float[Array, "n 6"]]:
    """Every sensor against what is common, then what is common anew."""
    read = signals.in_body(q_body_level)
    columns, sds = _unknowns(signals, common, q_body_level, tolerances, lag)
    noise = np.repeat([tolerances.gyr_noise, tolerances.acc_noise], 3)
    off = common.shared[:, None] - read
    u, sd = _least_squares(columns, sds, off / noise, noise, signals.weight)
    x = u * sds
    left = off - np.einsum("nsip,sp->nsi", columns, x)
    weight = signals.weight
    misfit = _rms((left / noise).transpose(1, 0, 2), weight.T)
    strain = np.sqrt(np.mean(u[:, _TURNING:] ** 2, axis=-1))
    outlying = _far(misfit, _USUAL_MISFIT) | _far(strain, _USUAL_STRAIN)
    turned = so3.exp(x[:, [1, 2, 0]])
    mended = read + np.einsum("nsip,sp->nsi", columns[..., _TURNING:], x[:, _TURNING:])
    mended = np.concatenate([so3.rotate(turned, mended[..., k : k + 3]) for k in (0, 3)], axis=-1)
    found = Found(
        q_body_level=so3.multiply(turned, q_body_level),
        sd=sd * np.maximum(1.0, np.maximum(misfit, strain)),
        residual=_rms(left[..., :3].transpose(1, 0, 2), weight.T),
        together=_apart(signals, common, so3.rotate(turned, read[..., :3])),
        misfit=misfit,
        strain=strain,
        outlying=outlying,
        common=common,
    )
    return found, averaged(mended, weight * ~outlying)


def _unknowns(
    signals: Signals, common: Common, q_body_level: Array, tolerances: Tolerances, lag: Array
) -> tuple[Float[Array, "n s 6 p"], Float[Array, "s p"]]:
    """What each unknown adds to a sensor's readings to make them the common ones; its SD.

    The first three turn the sensor about z, x and y.
    """
    tol, (n, s) = tolerances, signals.weight.shape
    axes = so3.to_matrix(so3.multiply(q_body_level, signals.q_level_sensor))

    def each(reading: Array) -> Array:  # what every axis makes of every axis
        made: Array = np.einsum("sir,nsc->nsirc", axes, reading).reshape(n, s, 3, 9)
        return made

    def wide(column: Array) -> Array:
        return np.broadcast_to(column, (n, s, *column.shape[-2:]))

    def turning(by: Array) -> tuple[Array, Array]:
        return _turning(by, common, signals.time_s)

    def matrix(scale: float, cross: float) -> Array:
        return np.where(np.eye(3, dtype=bool), scale, cross).ravel()

    none, heading, tilt = np.zeros((n, s, 3, 9)), _ROUGHLY[0], _ROUGHLY[1]
    arm = np.array([-common.axis[1], common.axis[0], 0.0]) / np.hypot(*common.axis[:2])
    pull = signals.acc - np.einsum("sji,nj->nsi", axes, common.gravity)
    spin, gain = _cross_matrix(common.shared[:, :3]), _cross_matrix(common.slope[:, :3])
    place = wide(-(gain + spin @ spin)[:, None])
    slope = common.slope[:, None, :, None]
    skin = wide((common.turned[:, None] * arm)[:, None, :, None])
    steady = [wide(_crossed(_Z_X_Y, common.shared[:, None, half])) for half in _HALVES]
    pieces = (
        (*steady, np.array([heading, tilt, tilt])),
        (each(signals.gyr), none, matrix(tol.gyr_scale, tol.gyr_cross)),
        (wide(axes), none[..., :3], np.full(3, tol.gyr_bias)),
        (each(signals.acc - signals.acc_rest), none, np.full(9, tol.g_sensitivity)),
        (wide(slope[:, :, :3]), wide(slope[:, :, 3:]), np.full(1, tol.delay)),
        (*turning(skin), lag[:, None]),
        (*turning(each(pull)), np.full(9, tol.board)),
        (none[..., :3], wide(axes), np.full(3, tol.acc_bias)),
        (none, each(signals.acc), matrix(tol.acc_scale, tol.acc_cross)),
        (none[..., :3], place, np.full(3, _PLACE_M)),
    )
    gyr, acc = (np.concatenate([piece[k] for piece in pieces], axis=-1) for k in (0, 1))
    sds = [np.broadcast_to(piece[2], (s, piece[2].shape[-1])) for piece in pieces]
    return np.concatenate([gyr, acc], axis=2), np.concatenate(sds, axis=-1)


def _turning(by: Array, common: Common, time_s: Array) -> tuple[Array, Array]:
    """A sensor that is turned by small rotation vectors, (n, s, 3, k), against the rig."""
    rate, force = (_crossed(by, common.shared[:, None, half]) for half in _HALVES)
    return rate - np.gradient(by, time_s, axis=0), force


def _crossed(by: Float[Array, "*#b 3 k"], v: Float[Array, "*#b 3"]) -> Float[Array, "*b 3 k"]:
    x, y, z = (by[..., i, :] for i in range(3))
    a, b, c = (v[..., i, None] for i in range(3))
    return np.stack([y * c - z * b, z * a - x * c, x * b - y * a], axis=-2)


_HALVES = slice(0, 3), slice(3, 6)
_Z_X_Y = np.eye(3)[:, [2, 0, 1]]


def _cross_matrix(v: Float[Array, "n 3"]) -> Float[Array, "n 3 3"]:
    return np.stack([np.cross(v, e) for e in np.eye(3)], axis=-1)


def _least_squares(
    columns: Array, sds: Array, off: Array, noise: Array, weight: Array
) -> tuple[Float[Array, "s p"], Float[Array, " s"]]:
    """Unknowns in their SDs, and the SD of the first."""
    n, s, _, p = columns.shape
    a = columns * (weight[..., None] / noise)[..., None] * sds[:, None]
    a = a.transpose(1, 0, 2, 3).reshape(s, 6 * n, p)
    b = (off * weight[..., None]).transpose(1, 0, 2).reshape(s, 6 * n, 1)
    across = a.transpose(0, 2, 1)
    inverse = np.linalg.inv(across @ a + np.eye(p))
    return (inverse @ (across @ b))[..., 0], np.sqrt(inverse[:, 0, 0]) * sds[:, 0]


def _apart(signals: Signals, common: Common, rate: Float[Array, "n s 3"]) -> Float[Array, " s"]:
    """How far each sensor turned against the others, at most [rad]; scales and axes included."""
    off = (rate - common.shared[:, None, :3]) * signals.weight[..., None]
    span_s = np.gradient(signals.time_s)[signals.turning]
    turned = np.cumsum(off[signals.turning] * span_s[:, None, None], axis=0)
    return np.asarray(np.linalg.norm(turned, axis=-1).max(axis=0))


def _far(value: Float[Array, " s"], usual: float) -> Bool[Array, " s"]:
    return np.asarray(value > _OUTLYING * max(float(np.median(value)), usual))


def _rms(vectors: Float[Array, "s n k"], weight: Float[Array, "s n"]) -> Float[Array, " s"]:
    total = (vectors**2 * weight[..., None]).sum(axis=(1, 2))
    return np.asarray(np.sqrt(total / np.maximum(weight.sum(axis=1), 1.0)))
