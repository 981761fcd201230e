"""Allan deviation of a signal at rest, and the two densities read off it (4.1 to 4.4).

``sigma²(tau) = Q²/tau + K² tau/3``: the line of slope -1/2, read at 1 s, is the white noise Q; that
of slope +1/2, read at 3 s, is the walk K. Both are fitted at once to the overlapping Allan
variances of octaves of tau, each weighted by what it knows: long averages are few, and neighbours
say nearly the same. Densities are two-sided, as the thesis's; a data sheet's is sqrt(2) times Q.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from types import ModuleType
from typing import NamedTuple, cast

import msgspec
import numpy as np

from handstudio.arrays import Array

CONFIDENCE = 0.95
_FIT_FROM_S = 0.1  # below, a chip's own filter and its counts shape the curve
_MOST_OF_IT = 4  # the longest average is this part of a recording


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


class Plan(NamedTuple):
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
def plan_of(lengths: tuple[int, ...], rate_hz: float) -> Plan:
    """What is the same for all axes of recordings of so many instants at that rate."""
    octaves = 2 ** np.arange(int(math.log2(max(lengths) / _MOST_OF_IT)) + 1)
    first = int(np.searchsorted(octaves, _FIT_FROM_S * rate_hz))
    n = np.array(lengths)[:, None]
    pairs = np.where(octaves <= n / _MOST_OF_IT, n - 2 * octaves + 1, 0)
    fitted, total = octaves[first:], pairs[:, first:].sum(axis=0)
    sums = sum(_sums(tuple(fitted.tolist()), tuple(row[first:].tolist()), rate_hz) for row in pairs)
    return Plan(rate_hz, octaves, pairs, first, *(sums / np.outer(total, total)))


def axis_noise(signals: list[Array], plan: Plan) -> AxisNoise:
    """Noise of one axis, read in several recordings that count as one long one."""
    variance = np.zeros(len(plan.m))
    for signal, pairs in zip(signals, plan.pairs, strict=True):
        taus = plan.m[pairs > 0] / plan.rate_hz
        level = signal - signal.mean()
        sigma = _allantools().oadev(level, plan.rate_hz, data_type="freq", taus=taus)[1]
        variance[: len(sigma)] += pairs[pairs > 0] * sigma**2
    variance /= plan.pairs.sum(axis=0)
    tau = plan.m / plan.rate_hz
    white, walk, misfit = fitted(tau[plan.first :], variance[plan.first :], plan)
    rules = np.where(white.value**2 / tau >= walk.value**2 * tau / 3.0, 0, -2)
    bounds = [
        _interval(math.sqrt(v), _freedom(plan, k, int(alpha)))
        for k, (v, alpha) in enumerate(zip(variance, rules, strict=True))
    ]
    low, high = zip(*bounds, strict=True)
    sigma = tuple(np.sqrt(variance).tolist())
    return AxisNoise(tuple(tau.tolist()), sigma, low, high, white, walk, misfit)


def fitted(tau: Array, variance: Array, plan: Plan) -> tuple[Density, Density, float]:
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


def _freedom(plan: Plan, k: int, alpha: int) -> float:
    return sum(
        _greenhall(alpha, int(plan.m[k]), int(pairs + 2 * plan.m[k]))
        for pairs in plan.pairs[:, k]
        if pairs
    )


@lru_cache(maxsize=256)
def _greenhall(alpha: int, m: int, phases: int) -> float:
    return float(_allantools().edf_greenhall(alpha, 2, m, phases, overlapping=True))


def _allantools() -> ModuleType:
    import allantools  # noqa: PLC0415 - takes seconds to import

    return cast("ModuleType", allantools)
