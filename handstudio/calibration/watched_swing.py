"""Whether one joint was swung far and fast enough, about its axis, and it alone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration import demands
from handstudio.calibration.course import Step
from handstudio.calibration.demands import demand_of
from handstudio.calibration.heard import ROOT, both_sides, seconds_of
from handstudio.calibration.movement import STEP_S, Moved, main_axes, moved_since
from handstudio.calibration.stillness import stillness_of
from handstudio.calibration.verdict import Reading, What
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import ImuSamples

_TURNS_BACK = 0.35  # share of the range: what goes back by less is a tremble, no swing
_PAUSED = 1.5  # times as long as usual is a way with a pause in it
_NOTHING = 0.03  # share of what is demanded: less is no movement that another could follow
_EDGES = (5.0, 95.0)  # percentiles between which a joint wanders
_NAN = float("nan")


def watch_swing(
    step: Step, rest: ImuSamples | None, done: ImuSamples, layout: Layout
) -> list[Reading]:
    """How far and how fast the joint was swung, what moved along, and the rest before."""
    answering = both_sides(step.joint, done, layout)
    seen = [0.0, 0.0, 0.0]  # range [deg], pace [1/s], others as a share of what they may
    worst, allowed = "", demand_of(step).others
    if answering.ok and seconds_of(done) >= STEP_S:
        moved = moved_since(rest, done, layout)
        if step.joint in moved.joints:
            *seen, worst, allowed = _swung(step, moved)
        else:  # it answers, and did not while it should rest
            seen = [_NAN] * 3
    elif len(done) and not answering.ok:
        seen = [_NAN] * 3
    range_deg, pace, others = seen
    demand, fast = demand_of(step), pace > demand_of(step).fastest
    what: What = "range" if step.turn == "flexion" else "second_axis"
    # unrest comes before what moves along: where biases are wrong everything seems to
    *still, rested = _rested(step, rest, layout)
    return [
        answering,
        Reading(what, range_deg, demand.range_deg, "deg"),
        *still,
        Reading("others", 100.0 * others, 100.0 * allowed, "%", at_least=False, about=worst),
        Reading("pace", pace, demand.fastest if fast else demand.slowest, "1/s", not fast),
        rested,
    ]


def _swung(step: Step, moved: Moved) -> tuple[float, float, float, str, float]:
    """Range [deg], pace [1/s], how much the worst other joint moved along, which, and its limit."""
    demand, own = demand_of(step), moved.joints.index(step.joint)
    axes = main_axes(moved.turned)
    along = moved.turned[:, own] @ axes[own]
    range_rad, pace = _to_and_fro(along, moved.time_s)
    asked, sideways = _asked(step, axes[own], moved.q_parent_child[own])
    others = _others(moved, axes, along, max(range_rad, np.deg2rad(demand.range_deg)))
    shares = {
        joint: (share, demand.others)
        for joint, share in zip(moved.joints, others.tolist(), strict=True)
        if joint not in demand.natural
    }
    shares[step.joint] = (sideways, demands.SIDEWAYS)
    worst = max(shares, key=lambda joint: shares[joint][0] / shares[joint][1])
    share, limit = shares[worst]
    return asked * float(np.rad2deg(range_rad)), pace, share, worst, limit


def _rested(step: Step, rest: ImuSamples | None, layout: Layout) -> list[Reading]:
    """How still the rest before was, if there was one, and how long."""
    rested_s = 0.0 if rest is None else seconds_of(rest)
    time = Reading("time", rested_s, demands.RESTED_SHARE * step.rest_s, "s", about="static")
    return [time] if rest is None or not time.ok else [stillness_of(rest, layout, "air"), time]


def _to_and_fro(along: Float[Array, " m"], time_s: Float[Array, " m"]) -> tuple[float, float]:
    """How far it swings [rad], the median of all ways, and how often a second.

    A way in which it also kept still, before it began or when it had ended, says nothing of pace.
    """
    back = _reversals(along)
    if len(back) < 2:
        return float(np.ptp(along)), 0.0
    far, took_s = float(np.median(np.abs(np.diff(along[back])))), np.diff(time_s[back])
    swung_s = took_s[took_s <= _PAUSED * np.median(took_s)]
    return far, 0.5 * len(swung_s) / float(swung_s.sum())


def _reversals(along: Float[Array, " m"]) -> list[int]:
    """Where it turned back: the extremes between which it went a good part of its range."""
    low_end, high_end = np.percentile(along, _EDGES)
    # nobody swings by less than a joint wanders
    spread = max(float(high_end - low_end), np.deg2rad(demands.UNSTEADY_DEG))
    far, values = _TURNS_BACK * spread, along.tolist()
    found, high, low, sign = list[int](), 0, 0, 0
    for index, value in enumerate(values):
        high = index if value > values[high] else high
        low = index if value < values[low] else low
        if sign >= 0 and values[high] - value > far:
            found.append(high)
            sign, low = -1, index
        elif sign <= 0 and value - values[low] > far:
            found.append(low)
            sign, high = 1, index
    return found


def _asked(
    step: Step, axis: Float[Array, " 3"], q_parent_child: Float[Array, " 4"]
) -> tuple[float, float]:
    """Share of the movement about the asked axis, and how much of the other one is in it.

    The second axis is the sensors' dorsal one, however they are turned on the skin. Both sensors
    count half, as each sits a little crooked; a thumb's metacarpal lies across the hand.
    """
    if step.joint not in ("thumb_cmc", ROOT[0]):
        axis = axis + so3.rotate(q_parent_child, axis)
        axis = axis / np.linalg.norm(axis)
    flexed, dorsal = abs(float(axis[0])), abs(float(axis[2]))
    if step.turn == "flexion":
        return float(np.hypot(axis[0], axis[1])), 0.0
    return dorsal, flexed / max(dorsal, 1e-3)


def _others(
    moved: Moved, axes: Float[Array, "j 3"], along: Float[Array, " m"], range_rad: float
) -> Float[Array, " j"]:
    """How far every joint moves per that of the one asked for.

    With it, or by itself more than a joint wanders that nobody thinks of.
    """
    centred = along - along.mean()
    least = len(along) * (_NOTHING * range_rad) ** 2
    follows = np.einsum("m,mjk->jk", centred, moved.turned) / (centred @ centred + least)
    low, high = np.percentile(np.einsum("mjk,jk->mj", moved.turned, axes), _EDGES, axis=0)
    went = float(np.ptp(along)) / range_rad
    wanders = (high - low - np.deg2rad(demands.UNSTEADY_DEG)) / range_rad
    return np.asarray(np.maximum(np.linalg.norm(follows, axis=-1) * min(1.0, went), wanders))
