"""The quick start at the beginning of a recording: rest, turn, rest; found, and put to use.

By its labels, or without any: the first stretch between two rests in which all sensors turn as
fast as one another, far enough, about a level axis. What was done before does not matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.calibration.course import REST, TURN
from handstudio.calibration.heading import HeadingAlignment, align
from handstudio.calibration.heading_fit import UNCALIBRATED, Tolerances
from handstudio.calibration.rig_turn import LEAST_TURN
from handstudio.errors import CalibrationError
from handstudio.samples import ImuSamples

WITHIN_S = 120.0
"""How far into a recording a quick start is looked for."""

_BLOCK_S = 0.1  # tremor has no longer periods
_STILL = np.deg2rad(8.0)  # [rad/s] of a rig at rest, biases taken out
_REST_S = 0.6  # at least
_MARGIN = 1  # block of the rests that are given to the turn, which begins slowly
_USED_S = 2.0  # of each rest
_TURN_S = 0.5, 12.0
_ALIKE = 0.15  # how far speeds may differ in the turn, as a share
_NEAR_S = 0.5  # of the turn a labelled rest may end or begin


class Place(msgspec.Struct, frozen=True):
    """Where a quick start is: sample numbers, first and beyond the last."""

    before: tuple[int, int]
    turning: tuple[int, int]
    after: tuple[int, int] | None


Labelled = tuple[float, float, str]
"""A stretch of a recording: from, to [s since its first sample], label."""


def quick_start(
    samples: ImuSamples,
    names: Sequence[str],
    *,
    labels: Sequence[Labelled] = (),
    compass: bool = True,
    tolerances: Tolerances = UNCALIBRATED,
) -> tuple[HeadingAlignment, Place]:
    """Align the headings of a recording's sensors, and say where it shows how.

    Labels count where one of them is a turn's. Of several turns the first whose verdict is good is
    taken, else the first that can be used.

    Args:
        samples: The recording from its first sample on.
        names: Of the sensors.
        labels: What its labels say.
        compass: As in `heading.align`.
        tolerances: As there.

    Raises:
        CalibrationError: there is no quick start in it, or none that can be used.
    """
    places = list(labelled(samples, labels)) or list(candidates(samples))
    usable: list[tuple[HeadingAlignment, Place]] = []
    refused: list[CalibrationError] = []
    for place in places:
        try:
            found = _aligned(samples, place, names, compass, tolerances)
        except CalibrationError as error:
            refused.append(error)
            continue
        if found.verdict.ok:
            return found, place
        usable.append((found, place))
    if usable:
        return usable[0]
    if refused:
        raise refused[0]
    raise CalibrationError(
        "No quick start in the first {seconds:.0f} s: nowhere a turn between two rests.",
        "Begin recordings so: rest two seconds, lift the forearm and lay it back, rest again.",
        seconds=min(WITHIN_S, float(np.ptp(samples.time_us)) * 1e-6 if len(samples) else 0.0),
    )


def labelled(samples: ImuSamples, labels: Sequence[Labelled]) -> Iterator[Place]:
    """Turns that labels tell of, each with the rests beside it."""
    rests = [_samples_of(samples, label) for label in labels if label[2] == REST.name]
    near = round(_NEAR_S / _step_s(samples)) if len(samples) > 1 else 0
    used = round(_USED_S / _step_s(samples)) if len(samples) > 1 else 0
    for label in labels:
        if label[2] != TURN.name:
            continue
        start, stop = _samples_of(samples, label)
        before = [rest for rest in rests if rest[0] < start and abs(rest[1] - start) <= near]
        after = [rest for rest in rests if rest[1] > stop and abs(rest[0] - stop) <= near]
        yield Place(
            before=before[-1] if before else (max(0, start - used), start),
            turning=(start, stop),
            after=after[0] if after else None,
        )


def candidates(samples: ImuSamples) -> Iterator[Place]:
    """Turns of the whole rig between two rests, in their order, without labels."""
    if len(samples) < 2:
        return
    size = max(1, round(_BLOCK_S / _step_s(samples)))
    speed = _speeds(samples[: round(WITHIN_S / _step_s(samples))], size)
    rig = _medians(speed)
    rests = [rest for rest in _runs(rig < _STILL) if rest[1] - rest[0] >= _REST_S / _BLOCK_S]
    used = round(_USED_S / _BLOCK_S)
    for one, other in pairwise(rests):
        start, stop = one[1], other[0]
        if _is_turn(speed[start:stop], rig[start:stop]):
            first, last = start - _MARGIN, stop + _MARGIN
            yield Place(
                before=(max(one[0], first - used) * size, first * size),
                turning=(first * size, last * size),
                after=(last * size, min(other[1], last + used) * size),
            )


def _aligned(
    samples: ImuSamples, place: Place, names: Sequence[str], compass: bool, tolerances: Tolerances
) -> HeadingAlignment:
    before, turning = (samples[slice(*part)] for part in (place.before, place.turning))
    after = None if place.after is None else samples[slice(*place.after)]
    return align(before, turning, after, names, compass=compass, tolerances=tolerances)


def _is_turn(speed: Float[Array, "n s"], rig: Float[Array, " n"]) -> bool:
    seconds = len(rig) * _BLOCK_S
    if not _TURN_S[0] <= seconds <= _TURN_S[1] or rig.sum() * _BLOCK_S < 0.5 * LEAST_TURN:
        return False
    apart = np.nansum(np.abs(speed - rig[:, None]), axis=0) / rig.sum()
    return float(np.median(apart)) < _ALIKE


def _speeds(samples: ImuSamples, size: int) -> Float[Array, "n s"]:
    """How fast each sensor turns [rad/s], its bias taken out; NaN where it did not answer.

    The bias is the mean over the blocks in which the sensor's rates spread least.
    """
    count = len(samples) // size
    gyr = samples.gyr[: count * size].reshape(count, size, -1, 3).mean(axis=1)
    valid = samples.valid[: count * size].reshape(count, size, -1).all(axis=1)
    spread = np.ptp(samples.gyr[: count * size].reshape(count, size, -1, 3), axis=1).max(axis=-1)
    spread = np.where(valid, spread, np.inf)
    quiet = max(1, min(count, round(_REST_S / _BLOCK_S)))
    calm = np.argsort(spread, axis=0)[:quiet]
    bias = np.median(np.take_along_axis(gyr, calm[..., None], axis=0), axis=0)
    return np.where(valid, np.linalg.norm(gyr - bias, axis=-1), np.nan)


def _medians(speed: Float[Array, "n s"]) -> Float[Array, " n"]:
    """Over the sensors that answered; infinite where none did."""
    silent = np.isnan(speed).all(axis=1, keepdims=True)
    return np.asarray(np.nanmedian(np.where(silent, np.inf, speed), axis=1))


def _runs(flags: Bool[Array, " n"]) -> list[tuple[int, int]]:
    """First and beyond the last of every stretch that is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _samples_of(samples: ImuSamples, label: Labelled) -> tuple[int, int]:
    since_s = (samples.time_us - samples.time_us[:1]) * 1e-6
    start, stop = np.searchsorted(since_s, np.array(label[:2]) - 1e-9)
    return int(start), int(stop)


def _step_s(samples: ImuSamples) -> float:
    return float(np.median(np.diff(samples.time_us))) * 1e-6
