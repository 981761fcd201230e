"""Heading alignment over sensors: a rest, a turn of the whole rig, a rest (4.2.5).

Compasses of sensors centimetres apart differ by degrees. In the turn all sensors share one
rigid motion, which tells how they are headed against one another.

Two ways. `at_peak` is the thesis's: one sample, where the rig turns fastest. `align` takes all
samples. In the axes of the rig at rest, z up, every sensor has the same angular velocity Ω, and
the same specific force f but for the place r it sits at:

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

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.attitude import attitude
from handstudio.calibration.course import TURN
from handstudio.calibration.verdict import Reading, Unit, Verdict, What
from handstudio.errors import CalibrationError
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY, ImuSamples

FOREARM = ("SN1", "SN2", "SN3")
"""Sensors of the glove whose skin stays behind when the bone beneath turns about itself."""

LEAST_TURN = float(np.deg2rad(30.0))
"""How far the rig should be turned [rad]; below half of it there is no alignment."""

_STEEPEST = np.deg2rad(45.0)  # of the axis
_STILL = np.deg2rad(2.0)  # [rad/s]; four times it is no rest
_TREMOR_S = 0.1  # a period of tremor, which does no harm
_SPINNING = np.deg2rad(5.0)  # about the vertical, beyond every bias [rad/s]
_TOGETHER = np.deg2rad(3.0)
_RESIDUAL = np.deg2rad(3.0)  # [rad/s]
_BLOCK_S, _MOST_BLOCKS, _REST_S = 0.01, 400, 3.0
_COARSER = 10  # times as long are the blocks of a rest
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


class HeadingAlignment(msgspec.Struct, frozen=True):
    """How sensors are headed; one figure a sensor where it says so.

    Attributes:
        names: Of the sensors.
        psi_cor: Turn about the vertical [rad] for attitudes of the rest before the turn, as
            ``attitude(acc, mag)`` has them, without a compass ``attitude(acc)``: all headings
            then agree (4.21). What they agree on is the robust mean of the compasses. 0 where a
            sensor was silent.
        psi_wg: Heading [rad] of ``attitude(acc)`` in the world whose x axis is level and square to
            the axis of the turn (4.19): what ``psi_cor`` is without a compass.
        sd: Standard deviation of the heading against the others' [rad]; infinite where silent.
        residual: What is left of the angular velocities, RMS [rad/s].
        together: How far the sensor turned against the others, at most [rad].
        outlying: Whether it had no part in the common motion.
        turn: How far the rig was turned [rad].
        axis_tilt: How far the axis was from level [rad].
        verdict: Whether it was done well.
    """

    names: tuple[str, ...]
    psi_cor: tuple[float, ...]
    psi_wg: tuple[float, ...]
    sd: tuple[float, ...]
    residual: tuple[float, ...]
    together: tuple[float, ...]
    outlying: tuple[bool, ...]
    turn: float
    axis_tilt: float
    verdict: Verdict

    def aligned(self, q_world_sensor: Float[Array, "*b s 4"]) -> Float[Array, "*b s 4"]:
        """Attitudes whose headings agree."""
        return so3.multiply(so3.about_z(np.array(self.psi_cor)), q_world_sensor)


def align(
    before: ImuSamples,
    turning: ImuSamples,
    after: ImuSamples | None,
    names: Sequence[str],
    *,
    compass: bool = True,
    tolerances: Tolerances = UNCALIBRATED,
    lagging: Collection[str] = FOREARM,
) -> HeadingAlignment:
    """Find how sensors are headed, from a turn of the whole rig, which is stiff.

    Args:
        before: Rest before the turn, half a second or more.
        turning: The turn, there and back or one way.
        after: Rest after it, where there is one.
        names: Of the sensors.
        compass: Whether the common heading is the compasses' mean, or the turn's own.
        tolerances: What the sensors are off by.
        lagging: Names of the sensors on a forearm.

    Raises:
        CalibrationError: the rig did not rest, or turn, or turned about too steep an axis; too few
            sensors answered or moved as one; no compass answered.
    """
    parts = [before, turning] if after is None else [before, turning, after]
    unrest = max(_unrest(part) for part in parts[::2])
    _refuse_restless(unrest)
    heard = _heard(parts)
    _refuse_few(len(heard), len(names))
    signals = _signals([_of(part, heard) for part in parts])
    mine = [names[i] for i in heard]
    lag = [tolerances.forearm_lag if name in lagging else tolerances.lag for name in mine]
    found = _solved(signals, tolerances, np.array(lag))
    psi_wg = _least(so3.heading(found.q_body_level) + _wg(found.common.axis))
    psi_cor = psi_wg
    if compass:
        psi_cor = _onto_compasses(compass_headings(before)[heard], psi_wg, ~found.outlying)
    verdict = _verdict(found, unrest, mine)
    _refuse_apart(found)
    silent = len(names), heard
    return HeadingAlignment(
        names=tuple(names),
        psi_cor=_filled(*silent, psi_cor, 0.0),
        psi_wg=_filled(*silent, psi_wg, 0.0),
        sd=_filled(*silent, found.sd, np.inf),
        residual=_filled(*silent, found.residual, np.nan),
        together=_filled(*silent, found.together, np.nan),
        outlying=tuple(bool(x) for x in _filled(*silent, found.outlying, 1.0)),
        turn=found.common.turn,
        axis_tilt=found.common.axis_tilt,
        verdict=verdict,
    )


def at_peak(
    before: ImuSamples, turning: ImuSamples, *, compass: bool = True
) -> tuple[Float[Array, " s"], Float[Array, " s"]]:
    """The thesis's way, ``(psi_cor, psi_wg)`` [rad]: one sample (4.18 to 4.22).

    The same sample for all sensors, where the median over them of the angular velocity is largest:
    a turn there and back has two peaks, and the axis of one is the other's reversed.
    """
    level = attitude(_mean(before.acc, before.valid))
    rate = so3.rotate(level, turning.gyr - _mean(before.gyr, before.valid))
    psi_wg = _wg(rate[np.argmax(np.median(np.linalg.norm(rate, axis=-1), axis=1))])
    if not compass:
        return psi_wg, psi_wg
    psi_d = compass_headings(before) - psi_wg
    return _least(np.angle(np.exp(1j * psi_d).mean()) - psi_d), psi_wg


def shared_headings(rate: Float[Array, "n s 3"], weight: Float[Array, "n s"]) -> Float[Array, " s"]:
    """Headings [rad] that bring level angular velocities nearest to their robust mean.

    Least squares over all samples; the mean is the median over sensors. Of one sample it is
    (4.19), but for a turn that all share.
    """
    level = rate[..., 0] + 1j * rate[..., 1]
    psi = _wg(rate[np.argmax(np.median(np.linalg.norm(rate, axis=-1), axis=1))])
    for _ in range(_ROUNDS):
        turned = level * np.exp(1j * psi)
        common = np.median(turned.real, axis=1) + 1j * np.median(turned.imag, axis=1)
        psi = np.angle((level.conj() * common[:, None] * weight).sum(axis=0))
    return np.asarray(psi)


def compass_headings(rest: ImuSamples) -> Float[Array, " s"]:
    """Headings psi [rad] that the compasses give at rest (2.11); NaN where there is none."""
    fresh = rest.fresh & rest.valid & np.isfinite(rest.mag).all(axis=-1)
    level = attitude(_mean(rest.acc, rest.valid))
    field = so3.rotate(level, _mean(np.nan_to_num(rest.mag), fresh))
    told = np.hypot(field[..., 0], field[..., 1]) > 0.0
    return np.where(told, -np.arctan2(field[..., 1], field[..., 0]), np.nan)


def robust_mean(angles: Float[Array, " m"]) -> float:
    """Circular mean [rad] that far ones pull at with a constant force only (Huber)."""
    centre = angles[np.argmin(np.abs(_least(angles[:, None] - angles)).sum(axis=0))]
    for _ in range(20):
        off = _least(angles - centre)
        near = max(2.0 * float(np.median(np.abs(off))), 1e-9)
        weight = np.minimum(1.0, near / np.maximum(np.abs(off), 1e-12))
        centre += (weight * off).sum() / weight.sum()
    return float(np.angle(np.exp(1j * centre)))


@dataclass(frozen=True, slots=True, eq=False)
class _Signals:
    """Blocks of samples of the sensors that answered, in their own axes."""

    time_s: Float[Array, " n"]
    gyr: Float[Array, "n s 3"]  # less the bias
    acc: Float[Array, "n s 3"]
    weight: Float[Array, "n s"]  # 0: the sensor did not answer, or was at its limit
    turning: slice
    acc_rest: Float[Array, "s 3"]
    q_level_sensor: Float[Array, "s 4"]

    def in_body(self, q_body_level: Float[Array, "s 4"]) -> Float[Array, "n s 6"]:
        """Angular velocities and specific forces in the axes of the rig at rest."""
        q = so3.multiply(q_body_level, self.q_level_sensor)
        return np.concatenate([so3.rotate(q, self.gyr), so3.rotate(q, self.acc)], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class _Common:
    """What the sensors share, in the axes of the rig at rest."""

    shared: Float[Array, "n 6"]  # angular velocity, specific force
    slope: Float[Array, "n 6"]  # of them, a second
    gravity: Float[Array, "n 3"]  # the force's part that is gravity
    axis: Float[Array, " 3"]  # at the peak
    turned: Float[Array, " n"]  # about it [rad]

    @property
    def turn(self) -> float:
        return float(np.ptp(self.turned))

    @property
    def axis_tilt(self) -> float:
        return float(np.arcsin(np.clip(abs(self.axis[2]), 0.0, 1.0)))


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """What a round found; misfit and strain: RMS of what is left, and of the unknowns, in SDs."""

    q_body_level: Float[Array, "s 4"]
    sd: Float[Array, " s"]
    residual: Float[Array, " s"]
    together: Float[Array, " s"]
    misfit: Float[Array, " s"]
    strain: Float[Array, " s"]
    outlying: Bool[Array, " s"]
    common: _Common


def _solved(signals: _Signals, tolerances: Tolerances, lag: Float[Array, " s"]) -> _Found:
    rate = so3.rotate(signals.q_level_sensor, signals.gyr)
    q_body_level = so3.about_z(shared_headings(rate, signals.weight))
    shared = np.median(signals.in_body(q_body_level), axis=1)
    common = _common(signals, shared)
    _refuse_turn(common)
    for _ in range(_ROUNDS):
        found, shared = _round(signals, common, q_body_level, tolerances, lag)
        q_body_level, common = found.q_body_level, _common(signals, shared)
    return found


def _round(
    signals: _Signals, common: _Common, q_body_level: Array, tolerances: Tolerances, lag: Array
) -> tuple[_Found, Float[Array, "n 6"]]:
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
    found = _Found(
        q_body_level=so3.multiply(turned, q_body_level),
        sd=sd * np.maximum(1.0, np.maximum(misfit, strain)),
        residual=_rms(left[..., :3].transpose(1, 0, 2), weight.T),
        together=_apart(signals, common, so3.rotate(turned, read[..., :3])),
        misfit=misfit,
        strain=strain,
        outlying=outlying,
        common=common,
    )
    return found, _averaged(mended, weight * ~outlying)


def _unknowns(
    signals: _Signals, common: _Common, q_body_level: Array, tolerances: Tolerances, lag: Array
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


def _turning(by: Array, common: _Common, time_s: Array) -> tuple[Array, Array]:
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


def _common(signals: _Signals, shared: Float[Array, "n 6"]) -> _Common:
    time_s, rate = signals.time_s, shared[:, :3]
    steps = np.diff(time_s)[:, None] * 0.5 * (rate[1:] + rate[:-1])
    q_rest_body = [so3.IDENTITY]
    for step in so3.exp(steps):
        q_rest_body.append(so3.multiply(q_rest_body[-1], step))
    up = shared[: signals.turning.start, 3:].mean(axis=0)
    peak = rate[signals.turning][np.argmax(np.linalg.norm(rate[signals.turning], axis=-1))]
    axis = peak / max(float(np.linalg.norm(peak)), 1e-9)
    return _Common(
        shared=shared,
        slope=np.gradient(shared, time_s, axis=0),
        gravity=so3.rotate(so3.conjugate(np.array(q_rest_body)), up),
        axis=axis,
        turned=np.concatenate([[0.0], np.cumsum(steps @ axis)]),
    )


def _apart(signals: _Signals, common: _Common, rate: Float[Array, "n s 3"]) -> Float[Array, " s"]:
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


def _signals(parts: Sequence[ImuSamples]) -> _Signals:
    before, turning = parts[0], parts[1]
    step_s = float(np.median(np.diff(turning.time_us))) * 1e-6
    size = max(1, round(_BLOCK_S / step_s), -(-len(turning) // _MOST_BLOCKS))
    rest = round(_REST_S / step_s)
    cut = [before[-rest:], turning, *(part[:rest] for part in parts[2:])]
    sizes = [max(1, min(_COARSER * size, len(before) // 5)), size, _COARSER * size]
    blocks = [_blocks(part, of) for part, of in zip(cut, sizes, strict=False)]
    time_s, gyr, acc, weight = (np.concatenate(whole) for whole in zip(*blocks, strict=True))
    # a long block tells as much as the short ones in it
    weight = (
        weight * np.sqrt(np.repeat(sizes[: len(cut)], [len(b[0]) for b in blocks]) / size)[:, None]
    )
    acc_rest = _mean(before.acc, before.valid)
    return _Signals(
        time_s=time_s,
        gyr=gyr - _mean(before.gyr, before.valid),
        acc=acc,
        weight=weight,
        turning=slice(len(blocks[0][0]), len(blocks[0][0]) + len(blocks[1][0])),
        acc_rest=acc_rest,
        q_level_sensor=attitude(acc_rest),
    )


def _blocks(part: ImuSamples, size: int) -> tuple[Array, Array, Array, Array]:
    """Time [s], means of gyroscope and accelerometer, weight; of blocks of so many samples."""
    count = len(part) // size

    def cut(values: Array) -> Array:
        return values[: count * size].reshape(count, size, *values.shape[1:])

    good = cut(part.valid & ~part.saturated)
    means = (_averaged(cut(v), good) for v in (part.gyr, part.acc))
    return cut(part.time_us).mean(axis=1) * 1e-6, *means, good.all(axis=1).astype(float)


def _averaged(values: Float[Array, "n m *s k"], weight: Array) -> Float[Array, "n *s k"]:
    """Mean over the second axis."""
    total = (values * weight[..., None]).sum(axis=1)
    return np.asarray(total / np.maximum(weight.sum(axis=1), 1e-9)[..., None])


def _mean(values: Float[Array, "n s k"], good: Bool[Array, "n s"]) -> Float[Array, "s k"]:
    mean: Array = _averaged(values[None], good[None])[0]
    return mean


def _wg(rate: Float[Array, "*s 3"]) -> Float[Array, "*s"]:
    """Heading of gravity × angular velocity, both level (4.18, 4.19)."""
    return np.asarray(-np.arctan2(rate[..., 0], -rate[..., 1]))


def _least(angle: Float[Array, "*b"]) -> Float[Array, "*b"]:
    """The same angle, from -pi to pi."""
    return np.asarray(np.angle(np.exp(1j * angle)))


def _onto_compasses(
    psi: Float[Array, " s"], psi_wg: Float[Array, " s"], good: Bool[Array, " s"]
) -> Float[Array, " s"]:
    """``psi_cor`` (4.20, 4.21); a sensor without a compass is taken to point north."""
    told = good & np.isfinite(psi)
    if not told.any():
        raise CalibrationError(
            "No compass gave a reading in the rest before the turn.",
            "Align the headings without compasses, or use sensors that have them.",
        )
    psi_d = np.nan_to_num(psi) - psi_wg
    return _least(robust_mean(psi_d[told]) - psi_d)


def _heard(parts: Sequence[ImuSamples]) -> list[int]:
    """Sensors that answered more than half of the time in every part."""
    shares = [part.valid.mean(axis=0) for part in parts]
    return [int(i) for i in np.flatnonzero(np.min(shares, axis=0) > 0.5)]


def _of(part: ImuSamples, sensors: Sequence[int]) -> ImuSamples:
    columns = (getattr(part, name)[:, list(sensors)] for name in ImuSamples.__slots__[1:])
    return ImuSamples(part.time_us, *columns)


def _filled(count: int, heard: Sequence[int], values: Array, silent: float) -> tuple[float, ...]:
    whole = np.full(count, silent)
    whole[list(heard)] = values
    return tuple(whole.tolist())


def _unrest(rest: ImuSamples) -> float:
    """How fast the rig turned [rad/s]: RMS, or by the tilt between halves, or a spin."""
    if len(rest) < 2:
        return float("inf")
    step_s = float(np.median(np.diff(rest.time_us))) * 1e-6
    time_s, gyr, acc, _ = _blocks(rest, max(1, round(_TREMOR_S / step_s)))
    if len(time_s) < 4:
        return float("inf")
    half = len(time_s) // 2
    up = [part.mean(axis=0) for part in (acc[:half], acc[half:])]
    tilt = np.linalg.norm(np.cross(*up), axis=-1) / np.maximum(np.sum(up[0] * up[1], -1), 1e-9)
    shaking = np.linalg.norm(np.std(gyr, axis=0), axis=-1)
    spins = np.abs(so3.rotate(attitude(acc.mean(axis=0)), gyr.mean(axis=0))[:, 2])
    spin = float(np.median(spins))
    span_s = 0.5 * float(time_s[-1] - time_s[0])
    turning = max(float(np.median(shaking)), float(np.median(np.abs(tilt))) / span_s)
    return max(turning, spin) if spin > _SPINNING else turning


def _verdict(found: _Found, unrest: float, names: Sequence[str]) -> Verdict:
    def worst(what: What, values: Array, limit: float, unit: Unit) -> Reading:
        i = int(np.argmax(values))
        value, most = float(np.rad2deg(values[i])), float(np.rad2deg(limit))
        return Reading(what, value, most, unit, at_least=False, about=names[i])

    turn, least = float(np.rad2deg(found.common.turn)), float(np.rad2deg(LEAST_TURN))
    still, most = float(np.rad2deg(unrest)), float(np.rad2deg(_STILL))
    readings = (
        Reading("turn", turn, least, "deg"),
        worst("together", found.together, _TOGETHER, "deg"),
        Reading("stillness", still, most, "deg/s", at_least=False),
        worst("residual", found.residual, _RESIDUAL, "deg/s"),
    )
    return Verdict(TURN.name, readings)


def _refuse_restless(unrest: float) -> None:
    if unrest > 4.0 * _STILL:
        raise CalibrationError(
            "The rig did not rest beside the turn: {found:.1f} deg/s, limit {limit:.1f}.",
            "Lay hand and arm down, keep still for two seconds before and after, and turn again.",
            found=float(np.rad2deg(unrest)),
            limit=float(np.rad2deg(4.0 * _STILL)),
        )


def _refuse_few(heard: int, count: int) -> None:
    if heard == 0 or 2 * heard < count:
        raise CalibrationError(
            "Only {heard} of {count} sensors answered during rest and turn; half are needed.",
            "Check the plugs and the cable, then rest and turn again.",
            heard=heard,
            count=count,
        )


def _refuse_turn(common: _Common) -> None:
    if common.turn < 0.5 * LEAST_TURN:
        raise CalibrationError(
            "The rig was turned by {found:.0f} deg; at least {least:.0f} are needed.",
            "Lift the forearm about the elbow by 50 degrees, the hand stiff, and lay it back.",
            found=float(np.rad2deg(common.turn)),
            least=float(np.rad2deg(0.5 * LEAST_TURN)),
        )
    if common.axis_tilt > _STEEPEST:
        raise CalibrationError(
            "The rig was turned about an axis {found:.0f} deg from level; limit {limit:.0f}.",
            "Lift the forearm straight up about the elbow instead of swinging it sideways.",
            found=float(np.rad2deg(common.axis_tilt)),
            limit=float(np.rad2deg(_STEEPEST)),
        )


def _refuse_apart(found: _Found) -> None:
    apart = float(np.median(found.together))
    if apart > 3.0 * _TOGETHER:
        raise CalibrationError(
            "The sensors did not turn as one: most moved by {found:.0f} deg; limit {limit:.0f}.",
            "Keep wrist and fingers as stiff as a board while you lift the arm.",
            found=float(np.rad2deg(apart)),
            limit=float(np.rad2deg(3.0 * _TOGETHER)),
        )
