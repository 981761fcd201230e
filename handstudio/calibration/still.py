"""When a board with several sensors lies still, and what they read then and in between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.samples import ImuSamples

WINDOW_S = 0.3
LEAST_S = 0.7  # of an interval, its margins taken off
MARGIN_S = 0.15  # taken off at both ends: boards ring on, and slow movements look still
_QUIETEST = 0.25  # this share of the windows is taken to be still, whatever they spread
_TIMES_QUIET = 3.0
# A perfect sensor spreads by nothing, and three times that lets nothing pass.
_GYR_FLOOR, _ACC_FLOOR = np.deg2rad(0.05), 0.01
# A steady turn spreads by nothing either: it must not turn on from what it does mostly.
_GYR_STEADY = np.deg2rad(1.5)
_AGREE = 2.0 / 3.0  # of the working sensors must be still
_WORKING = 0.9  # of the time a sensor must answer
_CREEP = 0.03  # the most a mean may differ between the halves of a rest [m/s²]
_GAP_S = 0.05  # the longest between samples that a turn may be integrated over


@dataclass(frozen=True, slots=True)
class Still:
    """An interval in which the board lies still: samples ``start`` to before ``stop``."""

    start: int
    stop: int

    @property
    def slice(self) -> slice:
        """Its samples."""
        return slice(self.start, self.stop)

    def __len__(self) -> int:
        return self.stop - self.start


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """What sensors read while the board lay still.

    Attributes:
        acc: Means [m/s²].
        gyr: Means [rad/s].
        time_s: Middle of the rests.
        seconds: How long they are.
        usable: The sensor answered and did not move.
    """

    acc: Float[Array, "s k 3"]
    gyr: Float[Array, "s k 3"]
    time_s: Float[Array, " k"]
    seconds: Float[Array, " k"]
    usable: Bool[Array, "s k"]


@dataclass(frozen=True, slots=True, eq=False)
class Turns:
    """What sensors read from one rest to the next, filled up with steps that take no time.

    Attributes:
        index: Sample of every instant.
        time_s: Of every instant.
        gyr: As read [rad/s].
        acc: As read [m/s²].
        usable: Nothing is missing or at its limit.
    """

    index: Array
    time_s: Float[Array, "t l"]
    gyr: Float[Array, "s t l 3"]
    acc: Float[Array, "s t l 3"]
    usable: Bool[Array, "s t"]


def working(samples: ImuSamples) -> Bool[Array, " s"]:
    """Which sensors answer, read numbers, and do not read the same for ever."""
    both = np.concatenate([samples.gyr, samples.acc], axis=-1)
    if not len(both):
        return np.zeros(both.shape[1], dtype=bool)
    answering = samples.valid.mean(axis=0) >= _WORKING
    numbers = np.isfinite(both).all(axis=(0, 2))
    moving = (np.ptp(both, axis=0) > 0.0).any(axis=-1)
    return np.asarray(answering & numbers & moving)


def still_intervals(samples: ImuSamples, least_s: float = LEAST_S) -> tuple[Still, ...]:
    """Find when the board lies still.

    A sensor is still where gyroscope and accelerometer spread little more within 0.3 s than they
    do in the quietest quarter of the recording, so nothing needs to be known of its noise. The
    board is still where two thirds of the working sensors are.

    Args:
        samples: Of sensors that are rigid to one another, or nearly so; any units for which noise
            is above 0.05 deg/s and 0.01 m/s².
        least_s: The shortest interval [s].

    Returns:
        Intervals in order; none if there is no working sensor.
    """
    use = working(samples)
    period_s = period(samples)
    window = max(2, round(WINDOW_S / period_s)) if period_s else 0
    if not use.any() or not window or len(samples) < window:
        return ()
    gyr, acc = samples.gyr[:, use], samples.acc[:, use]
    calm = _calm(_spread(gyr, window), _GYR_FLOOR) & _calm(_spread(acc, window), _ACC_FLOOR)
    calm &= _steady(gyr, window, calm)
    together = calm.mean(axis=1) >= _AGREE
    margin = round(MARGIN_S / period_s)
    found = (Still(a + margin, b + window - 1 - margin) for a, b in _runs(together))
    return tuple(each for each in found if each.stop - each.start >= least_s / period_s)


def period(samples: ImuSamples) -> float:
    """Typical time between samples [s]; 0 of less than two."""
    return float(np.median(np.diff(samples.time_us))) * 1e-6 if len(samples) > 1 else 0.0


def poses_of(samples: ImuSamples, stills: Sequence[Still]) -> Poses:
    """Means over rests; one in which the sensor creeps is not usable."""
    means, creeps, answered = [], [], []
    for still in stills:
        part = samples[still.slice]
        both = np.concatenate([part.acc, part.gyr], axis=-1)
        half = len(part) // 2
        means.append(both.mean(axis=0))
        creep = both[:half].mean(axis=0) - both[half:].mean(axis=0)
        creeps.append(np.abs(creep[:, :3]).max(axis=-1) > _CREEP)
        answered.append(part.valid.all(axis=0))
    s = samples.valid.shape[1]
    mean = np.reshape(means, (len(stills), s, 6)).transpose(1, 0, 2)
    edges = samples.time_us[[[each.start, each.stop - 1] for each in stills]] * 1e-6
    edges = edges.reshape(-1, 2)
    return Poses(
        acc=mean[..., :3],
        gyr=mean[..., 3:],
        time_s=edges.mean(axis=1),
        seconds=edges[:, 1] - edges[:, 0],
        usable=np.asarray(~np.reshape(creeps, (-1, s)) & np.reshape(answered, (-1, s))).T,
    )


def turns_of(samples: ImuSamples, stills: Sequence[Still]) -> Turns:
    """Readings between rests, from the last sample of one to the first of the next."""
    spans = [np.arange(a.stop - 1, b.start + 1) for a, b in pairwise(stills)]
    longest = max((len(span) for span in spans), default=1)
    index = np.reshape(
        [np.pad(span, (0, longest - len(span)), mode="edge") for span in spans], (-1, longest)
    ).astype(int)
    time_s = samples.time_us[index] * 1e-6
    gaps = np.diff(time_s, axis=1).max(axis=1, initial=0.0) > max(_GAP_S, 3.0 * period(samples))
    whole = (samples.valid & ~samples.saturated)[index].all(axis=1) & ~gaps[:, None]
    return Turns(
        index=index,
        time_s=time_s,
        gyr=np.moveaxis(samples.gyr[index], 2, 0),
        acc=np.moveaxis(samples.acc[index], 2, 0),
        usable=np.asarray(whole.T),
    )


def _spread(signal: Array, window: int) -> Float[Array, "m s"]:
    """Standard deviation within every window, of all axes together."""
    centred = signal - np.median(signal, axis=0)
    mean, square = _means(centred, window), _means(centred**2, window)
    return np.asarray(np.sqrt(np.maximum(square - mean**2, 0.0).sum(axis=-1)))


def _means(signal: Array, window: int) -> Array:
    total = np.cumsum(np.concatenate([np.zeros((1, *signal.shape[1:])), signal]), axis=0)
    means: Array = (total[window:] - total[:-window]) / window
    return means


def _calm(spread: Array, floor: float) -> Bool[Array, "m s"]:
    quiet = np.quantile(spread, _QUIETEST, axis=0)
    return np.asarray(spread <= np.maximum(_TIMES_QUIET * quiet, floor))


def _steady(gyr: Array, window: int, calm: Array) -> Bool[Array, "m s"]:
    mean = _means(gyr, window)
    usual = np.median(mean[calm.mean(axis=1) >= _AGREE], axis=0)
    return np.asarray((np.abs(mean - usual) <= _GYR_STEADY).all(axis=-1))


def _runs(flags: Array) -> list[tuple[int, int]]:
    """Begin and end of every run of true ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
