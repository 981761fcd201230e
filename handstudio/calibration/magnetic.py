"""Hard and soft iron of magnetometers, and their axes against the accelerometers', from a tumble.

A field that is the same everywhere is one vector in the world, whatever the attitude. With the
attitudes that accelerometer and gyroscope tell (`inertial`) a magnetometer must read
``D R_sensor_world b + h``: all of D and h follow, the turn of its axes against the
accelerometer's included, which the length of the field alone never tells. That
gravity and field include one angle is part of it. Where it begins is the sphere that the
readings lie on nearest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.inertial import Inertial
from handstudio.calibration.still import Still, Turns
from handstudio.maths import so3
from handstudio.samples import ImuSamples

LEAST_READINGS = 50
_EVERY_S = 0.05  # between readings used while it turns
_STILL_WEIGHT = 5.0  # of the mean of a rest against one of these
_ITERATIONS = 15
_SMALLEST = 1e-3  # of a field that is one, as a share of the others'
_SHAPE_SD = 0.2  # of D against unity; weak: 14 numbers from some hundred readings need none
_DIRECTION_SD = np.deg2rad(0.5)  # of the field's direction between sensors of one hand


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Magnetometers, and the attitudes that go with their readings.

    Attributes:
        mag: As read [µT].
        q_world_sensor: Of the same instants; every sensor's world has its own heading.
        weight: 0 where there is no reading.
        still: Which are means of rests.
    """

    mag: Float[Array, "s n 3"]
    q_world_sensor: Float[Array, "s n 4"]
    weight: Float[Array, "s n"]
    still: Bool[Array, " n"]


@dataclass(frozen=True, slots=True, eq=False)
class Magnetic:
    """What magnetometers err by: ``corrected = matrix (reading - bias)``, in the accelerometer's
    frame and [µT].

    Attributes:
        known: Which sensors could be calibrated; of the others everything is NaN.
        residual: RMS of the corrected length over the rests, as a share of the field.
        scale_sd, bias_sd: Of the diagonal; [µT].
        field_ut: Length that they are corrected to.
        dip: Angle of the field below the horizontal, by every sensor [rad].
    """

    known: Bool[Array, " s"]
    matrix: Float[Array, "s 3 3"]
    bias: Float[Array, "s 3"]
    residual: Float[Array, " s"]
    scale_sd: Float[Array, "s 3"]
    bias_sd: Float[Array, "s 3"]
    field_ut: float
    dip: Float[Array, " s"] = field(repr=False)


def readings_of(
    samples: ImuSamples, stills: Sequence[Still], turns: Turns, found: Inertial
) -> Readings:
    """Fresh readings: means over rests, and single ones of the turns between."""
    fresh = samples.fresh & samples.valid & np.isfinite(samples.mag).all(axis=-1)
    fresh &= (samples.mag != 0.0).any(axis=-1)
    mag = np.where(fresh[..., None], samples.mag, 0.0)
    count = np.array([fresh[each.slice].sum(axis=0) for each in stills])
    total = np.array([mag[each.slice].sum(axis=0) for each in stills])
    means = total / np.maximum(count, 1)[..., None]
    step = _every(turns)
    index, turned = turns.index[:, ::step], found.turned[:, :, ::step]
    moving = so3.multiply(found.q_world_sensor[:, :-1, None], turned)
    usable = turns.usable.T[:, None] & fresh[index] & _once(index)[..., None]
    s = mag.shape[1]
    return Readings(
        mag=np.concatenate([means, mag[index].reshape(-1, s, 3)]).transpose(1, 0, 2),
        q_world_sensor=np.concatenate([found.q_world_sensor, moving.reshape(s, -1, 4)], axis=1),
        weight=np.concatenate([_STILL_WEIGHT * (count > 0), 1.0 * usable.reshape(-1, s)]).T,
        still=np.arange(len(stills) + index.size) < len(stills),
    )


def magnetic(readings: Readings, field_ut: float | None = None) -> Magnetic:
    """Find the errors of all magnetometers.

    Args:
        readings: Of a board that was turned every way, away from iron.
        field_ut: Length of the field where that was [µT]; the sensors' own median unless given.
    """
    s = len(readings.mag)
    spheres = [_sphere(readings.mag[i], readings.weight[i]) for i in range(s)]
    enough = (readings.weight > 0.0).sum(axis=1) >= LEAST_READINGS
    radii = np.array([radius for _, radius in spheres])
    usual = float(np.median(radii[enough])) if enough.any() else np.nan
    known = enough & (radii > _SMALLEST * usual)
    length = usual if field_ut is None else field_ut
    fits = {int(i): _fit(readings, int(i), spheres[i], length, None) for i in np.flatnonzero(known)}
    if len(fits) > 2:
        dip = float(np.median([fit.dip for fit in fits.values()]))
        fits = {i: _fit(readings, i, spheres[i], length, dip) for i in fits}
    all_of_them = [fits.get(i, _NOTHING) for i in range(s)]
    return Magnetic(
        known=np.asarray(known),
        matrix=np.stack([fit.matrix for fit in all_of_them]),
        bias=np.stack([fit.bias for fit in all_of_them]),
        residual=np.array([fit.residual for fit in all_of_them]),
        scale_sd=np.stack([fit.scale_sd for fit in all_of_them]),
        bias_sd=np.stack([fit.bias_sd for fit in all_of_them]),
        field_ut=length,
        dip=np.array([fit.dip for fit in all_of_them]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    matrix: Array
    bias: Array
    scale_sd: Array
    bias_sd: Array
    residual: float
    dip: float


_NONE = np.full(3, np.nan)
_NOTHING = _Fit(np.full((3, 3), np.nan), _NONE, _NONE, _NONE, np.nan, np.nan)


def _every(turns: Turns) -> int:
    typical = np.diff(turns.time_s, axis=1)
    step_s = float(np.median(typical[typical > 0.0])) if (typical > 0.0).any() else _EVERY_S
    return max(1, round(_EVERY_S / step_s))


def _once(index: Array) -> Bool[Array, "t l"]:
    """Not the repeats of the last instant that fill a turn up."""
    return np.asarray(np.diff(index, axis=1, prepend=-1) > 0)


def _sphere(mag: Array, weight: Array) -> tuple[Array, float]:
    """Centre and radius of the sphere nearest: ``|m|² = 2 c m + r² - |c|²``."""
    use = weight > 0.0
    if use.sum() < 4:
        return np.zeros(3), np.nan
    design = np.concatenate([2.0 * mag[use], np.ones((int(use.sum()), 1))], axis=1)
    found = np.linalg.lstsq(design, np.sum(mag[use] ** 2, axis=1), rcond=None)[0]
    return found[:3], float(np.sqrt(max(found[3] + found[:3] @ found[:3], 0.0)))


def _fit(
    readings: Readings, i: int, sphere: tuple[Array, float], length: float, dip: float | None
) -> _Fit:
    """Gauss-Newton for D, h and the field's direction; spots where iron is count less."""
    use = readings.weight[i] > 0.0
    mag, back = readings.mag[i, use], so3.conjugate(readings.q_world_sensor[i, use])
    weight, (centre, radius) = readings.weight[i, use], sphere
    north = so3.rotate(so3.conjugate(back), mag - centre).mean(axis=0)
    heading = float(np.arctan2(north[1], north[0]))
    slope = -float(np.arctan2(north[2], np.hypot(north[0], north[1])))
    x = np.concatenate([(radius / length * np.eye(3)).ravel(), centre, [heading, slope]])
    begin, prior = x.copy(), np.zeros(len(x))
    prior[:9] = (_SHAPE_SD * radius / length) ** -2.0
    if dip is not None:
        begin[13], prior[13] = dip, _DIRECTION_SD**-2.0
    for _ in range(_ITERATIONS):
        residual, jacobian = _misfit(x, mag, back, length)
        far = np.linalg.norm(residual, axis=1)
        scale = max(float(np.median(far)) / 1.538, 1e-6 * length)
        w = weight / np.maximum(1.0, far / (2.5 * scale)) / scale**2
        rows, by = jacobian.reshape(-1, 14), np.repeat(w, 3)
        h = (rows.T * by) @ rows + np.diag(prior)
        g = rows.T @ (by * residual.ravel()) + prior * (x - begin)
        x = x - np.linalg.solve(h, g)
    matrix = np.linalg.inv(x[:9].reshape(3, 3))
    sd = np.sqrt(np.diagonal(np.linalg.inv(h)))
    still = readings.still[use]
    lengths = np.linalg.norm((mag[still] - x[9:12]) @ matrix.T, axis=1) / length - 1.0
    return _Fit(
        matrix=matrix,
        bias=x[9:12],
        scale_sd=sd[[0, 4, 8]] * length / radius,
        bias_sd=sd[9:12],
        residual=float(np.sqrt(np.mean(lengths**2))) if still.any() else np.nan,
        dip=float(x[13]),
    )


def _misfit(x: Array, mag: Array, back: Array, length: float) -> tuple[Array, Array]:
    """What is read too much (n, 3), and how it goes with D, h, heading and dip (n, 3, 14)."""
    d, (heading, dip) = x[:9].reshape(3, 3), x[12:]
    ch, sh, cd, sd = np.cos(heading), np.sin(heading), np.cos(dip), np.sin(dip)
    world = length * np.array([[cd * ch, cd * sh, -sd], [-cd * sh, cd * ch, 0.0],
                               [-sd * ch, -sd * sh, -cd]])  # fmt: skip
    felt, by_heading, by_dip = (so3.rotate(back, each) for each in world)
    jacobian = np.zeros((len(mag), 3, len(x)))
    for axis in range(3):
        jacobian[:, axis, 3 * axis : 3 * axis + 3] = felt
    jacobian[:, :, 9:12] = np.eye(3)
    jacobian[:, :, 12], jacobian[:, :, 13] = by_heading @ d.T, by_dip @ d.T
    return felt @ d.T + x[9:12] - mag, jacobian
