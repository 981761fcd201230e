"""Noise of sensors at rest: Allan deviation, and the two densities read off it (4.1 to 4.4).

``sigma²(tau) = Q²/tau + K² tau/3``: the line of slope -1/2, read at 1 s, is the white noise Q; that
of slope +1/2, read at 3 s, is the walk K. Both are fitted at once to the overlapping Allan
variances of octaves of tau, each weighted by what it knows: long averages are few, and neighbours
say nearly the same. Densities are two-sided, as the thesis's; a data sheet's is sqrt(2) times Q.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType
from typing import NamedTuple, cast

import msgspec
import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import CalibrationError

LEAST_S = 120.0
"""Shorter recordings are refused; a walk takes half an hour to be distinct."""

MISSING = 0.01
"""Share of instants that may be missing; they are closed up, which neither line notices."""

CONFIDENCE = 0.95

_FIT_FROM_S = 0.1  # below, a chip's own filter and its counts shape the curve
_MOST_OF_IT = 4  # the longest average is this part of a recording
_REST = "Record the glove lying still: two minutes show its noise, half an hour also the walk."
_BLOCK_S = 0.5
# A warming sensor drifts by 0.6 deg/s and 0.04 m/s²; a hand that is not laid down does more. Means
# of blocks, off the median of all [rad/s], [m/s²]; scatter within one, of what is usual.
_LIMITS = (math.radians(1.0), 0.2, 3.0)


@dataclass(frozen=True, slots=True, eq=False)
class StaticRecording:
    """A recording in which nothing moves; NaN where a sensor did not answer."""

    time_s: Float[Array, " n"]
    gyr: Float[Array, "n s 3"]  # [rad/s]
    acc: Float[Array, "n s 3"]  # [m/s²]
    rate_hz: float


class Density(msgspec.Struct, frozen=True):
    """A density and its interval of 95 % confidence.

    Attributes:
        value: The most likely one; 0 where the curve asks for none.
        low: 0 where it is not distinct.
        high: Where it is not distinct, what it stays below.
        distinct: Whether its line is seen: beyond chance, and above the other within the curve.
    """

    value: float
    low: float
    high: float
    distinct: bool


class AxisNoise(msgspec.Struct, frozen=True):
    """One axis of a gyroscope or an accelerometer, SI (x is rad/s or m/s²).

    Attributes:
        tau_s: Averaging times.
        sigma: Allan deviation at each [x].
        low: Of its interval of 95 % [x].
        high: Of the same.
        white: Q [x sqrt(s)].
        walk: K [x/sqrt(s)].
        misfit: Chi-square of the fit a degree of freedom: about 1 where both lines are all there
            is, several where flicker, warming or the mains are seen too.
    """

    tau_s: tuple[float, ...]
    sigma: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    white: Density
    walk: Density
    misfit: float


class SensorNoise(msgspec.Struct, frozen=True):
    """Noise of a sensor, axes x y z."""

    sensor: str
    gyr: tuple[AxisNoise, AxisNoise, AxisNoise]
    acc: tuple[AxisNoise, AxisNoise, AxisNoise]


class Noise(msgspec.Struct, frozen=True):
    """What static recordings tell of their sensors.

    Attributes:
        sensors: In the order given.
        left_out: Names of those that were silent too often, or read nothing but one number.
        rate_hz: Sampling rate.
        durations_s: Of the recordings.
    """

    sensors: tuple[SensorNoise, ...]
    left_out: tuple[str, ...]
    rate_hz: float
    durations_s: tuple[float, ...]


def noise_of(
    recordings: Sequence[StaticRecording],
    sensors: Sequence[str],
    progress: Callable[[float], None] = lambda _: None,
) -> Noise:
    """Characterise sensors from static recordings; several count as one long one.

    Args:
        recordings: Of the same sensors at the same rate.
        sensors: Their names.
        progress: Told the share that is done.

    Raises:
        CalibrationError: a recording is too short, has gaps or does not fit the others, a sensor
            moved, or none was left to look at.
    """
    _refuse_unfit(recordings, sensors)
    lengths = tuple(len(each.time_s) for each in recordings)
    plan = _plan(lengths, recordings[0].rate_hz)
    found, left_out = list[SensorNoise](), list[str]()
    for index, name in enumerate(sensors):
        one = _sensor(recordings, index, name, plan)
        if one is None:
            left_out.append(name)
        else:
            found.append(one)
        progress((index + 1) / len(sensors))
    if not found:
        raise CalibrationError(
            "None of {count} sensors gave readings with noise in them.",
            "Check that they answer and that the recording is of real sensors.",
            count=len(sensors),
        )
    return Noise(
        tuple(found),
        tuple(left_out),
        recordings[0].rate_hz,
        tuple(length / recordings[0].rate_hz for length in lengths),
    )


def mean_of(densities: Sequence[Density]) -> Density:
    """Mean of independent densities, a sensor's three axes, distinct where all of them are."""
    values, low, high = (
        np.array([getattr(each, name) for each in densities]) for name in ("value", "low", "high")
    )
    mean, n = float(values.mean()), len(values)
    below, above = np.linalg.norm(values - low) / n, np.linalg.norm(high - values) / n
    return Density(
        mean, float(mean - below), float(mean + above), all(each.distinct for each in densities)
    )


class _Plan(NamedTuple):
    """What is the same for all axes.

    The variances' covariance is ``white Q⁴ + both Q² K² + walk K⁴``, of the taus that are fitted.
    """

    rate_hz: float
    m: Array  # averaging lengths [instants]
    pairs: Array  # (recordings, taus): how many pairs of averages each has
    first: int  # of the taus that are fitted
    white: Array
    both: Array
    walk: Array


@lru_cache(maxsize=8)
def _plan(lengths: tuple[int, ...], rate_hz: float) -> _Plan:
    octaves = 2 ** np.arange(int(math.log2(max(lengths) / _MOST_OF_IT)) + 1)
    first = int(np.searchsorted(octaves, _FIT_FROM_S * rate_hz))
    n = np.array(lengths)[:, None]
    pairs = np.where(octaves <= n / _MOST_OF_IT, n - 2 * octaves + 1, 0)
    fitted, total = octaves[first:], pairs[:, first:].sum(axis=0)
    sums = sum(_sums(tuple(fitted.tolist()), tuple(row[first:].tolist()), rate_hz) for row in pairs)
    return _Plan(rate_hz, octaves, pairs, first, *(sums / np.outer(total, total)))


def _sums(m: tuple[int, ...], pairs: tuple[int, ...], rate_hz: float) -> Array:
    """Covariance of the sums of squares at every two taus: of Q⁴, Q² K² and K⁴, (3, t, t).

    A Gaussian process: twice the squared covariance of two differences, over all their lags.
    """
    out = np.zeros((3, len(m), len(m)))
    stride = max(1, m[0] // 4)  # the covariance is smooth at the scale of the shortest
    for i, one in enumerate(m):
        for j, other in enumerate(m[: i + 1]):
            lag = np.arange(-2 * one, 2 * other + 1, stride)
            count = np.minimum(pairs[i], pairs[j] + lag) - np.maximum(0, lag)
            weight = 2.0 * stride * np.maximum(count, 0)
            white, walk = _covariance(lag, one, other, rate_hz)
            out[:, i, j] = out[:, j, i] = [
                weight @ white**2,
                2.0 * weight @ (white * walk),
                weight @ walk**2,
            ]
    return out


def _covariance(lag: Array, one: int, other: int, rate_hz: float) -> tuple[Array, Array]:
    """Covariance of two differences of averages that begin a lag apart, for Q = 1 and for K = 1.

    An angle is the sum of a rate; its generalised covariance is ``-Q² |t|/2`` and ``K² |t|³/12``.
    """
    white, walk = np.zeros(len(lag)), np.zeros(len(lag))
    for a, of_a in enumerate((1.0, -2.0, 1.0)):
        for b, of_b in enumerate((1.0, -2.0, 1.0)):
            apart = np.abs(lag + a * one - b * other) / rate_hz
            white -= of_a * of_b * apart / 2.0
            walk += of_a * of_b * apart**3 / 12.0
    scale = rate_hz**2 / (2.0 * one * other)
    return white * scale, walk * scale


def _sensor(
    recordings: Sequence[StaticRecording], index: int, name: str, plan: _Plan
) -> SensorNoise | None:
    there = []
    for each in recordings:
        both = np.concatenate([each.gyr[:, index], each.acc[:, index]], axis=-1, dtype=float)
        kept = both[np.isfinite(both).all(axis=-1)]
        if len(kept) < (1.0 - MISSING) * len(both) or not np.ptp(kept, axis=0).all():
            return None
        _refuse_motion(kept, each.rate_hz, name)
        there.append(kept)
    axes = [_axis([each[:, axis] for each in there], plan) for axis in range(6)]
    return SensorNoise(name, (axes[0], axes[1], axes[2]), (axes[3], axes[4], axes[5]))


def _axis(signals: list[Array], plan: _Plan) -> AxisNoise:
    variance = np.zeros(len(plan.m))
    for signal, pairs in zip(signals, plan.pairs, strict=True):
        taus = plan.m[pairs > 0] / plan.rate_hz
        level = signal - signal.mean()
        sigma = _allantools().oadev(level, plan.rate_hz, data_type="freq", taus=taus)[1]
        variance[: len(sigma)] += pairs[pairs > 0] * sigma**2
    variance /= plan.pairs.sum(axis=0)
    tau = plan.m / plan.rate_hz
    white, walk, misfit = _fitted(tau[plan.first :], variance[plan.first :], plan)
    rules = np.where(white.value**2 / tau >= walk.value**2 * tau / 3.0, 0, -2)
    bounds = [
        _interval(math.sqrt(v), _freedom(plan, k, int(alpha)))
        for k, (v, alpha) in enumerate(zip(variance, rules, strict=True))
    ]
    low, high = zip(*bounds, strict=True)
    sigma = tuple(np.sqrt(variance).tolist())
    return AxisNoise(tuple(tau.tolist()), sigma, low, high, white, walk, misfit)


def _fitted(tau: Array, variance: Array, plan: _Plan) -> tuple[Density, Density, float]:
    """Least squares with the covariance that the fit itself asks for."""
    lines = np.stack([1.0 / tau, tau / 3.0], axis=-1)
    at_1_s = int(np.argmin(np.abs(np.log(tau))))
    q2, k2 = float(variance[at_1_s] * tau[at_1_s]), 0.0
    for _ in range(8):
        inverse = _inverse(q2 * q2 * plan.white + q2 * k2 * plan.both + k2 * k2 * plan.walk)
        weights = np.linalg.solve(lines.T @ inverse @ lines, lines.T @ inverse)
        found: Array = weights @ variance
        q2, k2 = max(float(found[0]), 1e-3 * q2), max(float(found[1]), 0.0)
    rest = variance - lines @ found
    of_white, of_both, of_walk = (
        np.einsum("ij,jk,ik->i", weights, each, weights)
        for each in (plan.white, plan.both, plan.walk)
    )
    spread = q2 * q2 * of_white + q2 * k2 * of_both + k2 * k2 * of_walk
    white = _density(found[0], spread[0], k2 * math.sqrt(of_walk[0] / of_white[0]))
    walk = _density(found[1], spread[1], q2 * math.sqrt(of_white[1] / of_walk[1]))
    seen = k2 > 0.0 and math.sqrt(3.0 * q2 / k2) < tau[-1]  # the curve rises within what there is
    if not seen and walk.distinct:
        walk = msgspec.structs.replace(walk, low=0.0, distinct=False)
    return white, walk, float(rest @ inverse @ rest) / (len(tau) - 2)


def _inverse(covariance: Array) -> Array:
    scale = np.sqrt(np.diag(covariance))  # they are far apart: brings all near 1
    inverse: Array = np.linalg.inv(covariance / np.outer(scale, scale)) / np.outer(scale, scale)
    return inverse


def _density(square: float, variance: float, other: float) -> Density:
    """A squared density as the difference of a chi-square and what the other noise adds to it.

    The estimate's variance is ``(square + other)²`` times a constant, of which the two ends are
    known: where it would be without either noise.
    """
    freedom = 2.0 * (max(square, 0.0) + other) ** 2 / variance
    whole = max(square + other, 0.05 * other)  # chance may put an estimate below none
    low, high = _interval(math.sqrt(whole), freedom)
    low, high = (math.sqrt(max(end**2 - other, 0.0)) for end in (low, high))
    return Density(math.sqrt(max(square, 0.0)), low, high, low > 0.0)


def _interval(value: float, freedom: float) -> tuple[float, float]:
    low, high = _relative_interval(freedom)
    return value * low, value * high


@lru_cache(maxsize=256)
def _relative_interval(freedom: float) -> tuple[float, float]:
    low, high = _allantools().confidence_interval(1.0, freedom, CONFIDENCE)
    return float(low), float(high)


def _freedom(plan: _Plan, k: int, alpha: int) -> float:
    return sum(
        _greenhall(alpha, int(plan.m[k]), int(pairs + 2 * plan.m[k]))
        for pairs in plan.pairs[:, k]
        if pairs
    )


@lru_cache(maxsize=256)
def _greenhall(alpha: int, m: int, phases: int) -> float:
    return float(_allantools().edf_greenhall(alpha, 2, m, phases, overlapping=True))


def _refuse_unfit(recordings: Sequence[StaticRecording], sensors: Sequence[str]) -> None:
    if not recordings:
        raise CalibrationError("There is no recording at rest.", _REST)
    rate_hz = recordings[0].rate_hz
    for each in recordings:
        count, seconds = each.gyr.shape[1], len(each.time_s) / each.rate_hz
        if each.rate_hz != rate_hz or count != len(sensors):
            raise CalibrationError(
                "A recording of {count} sensors at {rate:g} Hz is among those of {sensors} sensors "
                "at {first:g} Hz.",
                "Characterise each glove, at each rate, by itself.",
                count=count,
                rate=each.rate_hz,
                sensors=len(sensors),
                first=rate_hz,
            )
        if not seconds >= LEAST_S:
            raise CalibrationError(
                "A recording at rest is {seconds:.0f} s long, at least {least:.0f} s are needed.",
                _REST,
                seconds=seconds,
                least=LEAST_S,
            )
        made = float(each.time_s[-1] - each.time_s[0]) * rate_hz + 1.0
        if not abs(len(each.time_s) - made) <= MISSING * made:
            raise CalibrationError(
                "A recording has {count} instants where {rate:g} Hz make {made:.0f}; {limit:.0f} % "
                "may be missing.",
                "Give the rate it was recorded at; what lies before and after a long gap is two "
                "recordings.",
                count=len(each.time_s),
                rate=rate_hz,
                made=made,
                limit=100.0 * MISSING,
            )


def _refuse_motion(read: Float[Array, "n 6"], rate_hz: float, sensor: str) -> None:
    size = max(8, round(_BLOCK_S * rate_hz))
    blocks = read[: len(read) // size * size].reshape(-1, size, 6)
    means, spreads = blocks.mean(axis=1), blocks.var(axis=1)
    off = np.abs(means - np.median(means, axis=0)).reshape(-1, 2, 3).max(axis=-1)
    usual = np.maximum(np.median(spreads, axis=0), 0.1 * spreads.mean(axis=0))
    shaken = (spreads / usual).reshape(-1, 2, 3).mean(axis=-1).max(axis=-1)
    seen = np.column_stack([off, np.sqrt(shaken)])
    worst = int(np.argmax((seen / _LIMITS).max(axis=-1)))
    if (seen[worst] > _LIMITS).any():
        raise CalibrationError(
            "{sensor} did not rest {at:.0f} s after the start: turned by {turn:.1f} deg/s (limit "
            "{turns:.1f}), tilted or pushed by {push:.2f} m/s² (limit {pushes:.2f}), shaken to "
            "{shake:.1f} times its usual noise (limit {shakes:.1f}).",
            "Lay the glove where nobody touches it, or label the part in which it lies still.",
            sensor=sensor,
            at=worst * size / rate_hz,
            turn=float(np.rad2deg(seen[worst, 0])),
            turns=float(np.rad2deg(_LIMITS[0])),
            push=float(seen[worst, 1]),
            pushes=_LIMITS[1],
            shake=float(seen[worst, 2]),
            shakes=_LIMITS[2],
        )


def _allantools() -> ModuleType:
    import allantools  # type: ignore[import-untyped] # noqa: PLC0415 - takes seconds to import

    return cast("ModuleType", allantools)
