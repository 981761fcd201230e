"""What sensors were heard to say: which answer, for how long, and their means."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.calibration import demands
from handstudio.calibration.verdict import Reading
from handstudio.layout import Layout
from handstudio.samples import ImuSamples

ROOT = ("elbow", "forearm")
"""The joint above the first segment: its turns are those of the forearm in the world."""

_INSTANT_S = 0.01  # closer instants are taken together


def seconds_of(samples: ImuSamples) -> float:
    """How long they last [s], the last instant counted in."""
    if len(samples) < 2:
        return 0.0
    lasted_us = max(0, int(samples.time_us[-1] - samples.time_us[0]))
    return round(lasted_us * 1e-6 * len(samples) / (len(samples) - 1), 6)


def heard_pct(samples: ImuSamples) -> Float[Array, " s"]:
    """Share of the instants in which each sensor answered [%]."""
    if len(samples) and samples.valid.all():  # nearly always, and much faster to see
        return np.full(samples.valid.shape[1], 100.0)
    return np.asarray(100.0 * samples.valid.sum(axis=0) / max(1, len(samples)))


def thinned(samples: ImuSamples) -> ImuSamples:
    """At most some 100 instants a second, each the mean of those it stands for.

    So noise is let in alike at every rate, and tremor all the same.
    """
    each, count = steps_in(samples, _INSTANT_S)
    if each == 1 or not count:
        return samples
    part = samples[: count * each]
    valid = part.valid.reshape(count, each, -1)
    share = valid.mean(axis=1)
    gyr, acc = (
        np.where(valid[..., None], x.reshape(count, each, -1, 3), 0.0).mean(axis=1)
        / np.maximum(share, 0.5 / each)[..., None]
        for x in (part.gyr, part.acc)
    )
    last = part[each - 1 :: each]  # a compass holds its reading
    fresh, saturated = (
        np.asarray(x.reshape(valid.shape).any(axis=1)) for x in (part.fresh, part.saturated)
    )
    return ImuSamples(last.time_us, gyr, acc, last.mag, fresh, share >= 0.5, saturated)


def steps_in(samples: ImuSamples, step_s: float) -> tuple[int, int]:
    """Samples in a step of that length, and how many whole steps there are."""
    each = max(1, round(step_s * len(samples) / max(seconds_of(samples), 1e-3)))
    return each, len(samples) // each


def live_ones(samples: ImuSamples) -> Int64[Array, " l"]:
    """The sensors that answer often enough."""
    return np.flatnonzero(heard_pct(samples) >= demands.ANSWERING_PCT)


def answering_of(samples: ImuSamples, layout: Layout) -> Reading:
    """The sensor that answers least."""
    heard = heard_pct(samples)
    worst = int(np.argmin(heard))
    silent = len(samples) > 0 and heard[worst] < demands.ANSWERING_PCT
    about = layout.names[worst] if silent else ""
    return Reading("answering", float(heard[worst]), demands.ANSWERING_PCT, "%", about=about)


def both_sides(joint: str, done: ImuSamples, layout: Layout) -> Reading:
    """Of the segments that a joint joins, the one whose best sensor answers least."""
    root, first = ROOT
    sides = [(j.parent, j.child) for j in layout.joints if j.name == joint]
    sides = [("", first)] if joint == root else sides
    best = list[tuple[float, str]]()
    for segment in {side for pair in sides for side in pair if side}:
        on = [
            (float(heard), place.sensor)
            for heard, place in zip(heard_pct(done), layout.sensors, strict=True)
            if place.segment == segment
        ]
        best.append(max(on, key=lambda known: known[0], default=(0.0, segment)))
    value, name = min(best, default=(0.0, joint))
    silent = len(done) > 0 and value < demands.ANSWERING_PCT
    return Reading("answering", value, demands.ANSWERING_PCT, "%", about=name if silent else "")


def mean_while(values: Float[Array, "n s 3"], where: Array) -> Float[Array, "s 3"]:
    """Mean of every sensor over the instants that count; NaN where there are none."""
    if len(values) and where.all():
        return np.asarray(values.mean(axis=0))
    count = where.sum(axis=0)[:, None]
    total = np.where(where[..., None], values, 0.0).sum(axis=0)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def angle_between(a: Float[Array, "*#b 3"], b: Float[Array, "*#b 3"]) -> Float[Array, "*b"]:
    """Angle between directions [rad]."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1)))
