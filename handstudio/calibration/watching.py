"""Whether a step of a calibration was done well, from the signals alone.

The same judgement for somebody who is guided live and for a take that is calibrated later. It may
be asked at any time with everything so far: a figure that is not there yet is 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.calibration import demands
from handstudio.calibration.attitude import attitude
from handstudio.calibration.course import Step
from handstudio.calibration.demands import demand_of
from handstudio.calibration.verdict import Reading, Verdict, What
from handstudio.hand.skeleton import PARENTS, SEGMENTS, HandSide, nominal_skeleton
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import ImuSamples

_ROOT = ("elbow", "forearm")
"""The joint above the first segment: its turns are those of the forearm in the world."""

_BLOCK_S = 0.5  # that a rest is judged by, and the shortest there is
_STEP_S = 0.05  # turns are followed at 20 Hz: swings are below 3 Hz
_CROOKED = np.deg2rad(12.0)  # that the headings of two sensors are off by, at most
_LEADING = 0.1  # share of the most movement: with less, nobody can tell a neighbour's heading
_TURNS_BACK = 0.35  # share of the range: what goes back by less is a tremble, no swing
_NOTHING = 0.03  # share of what is demanded: less is no movement that another could follow
_EDGES = (5.0, 95.0)  # percentiles between which a joint wanders
_INSTANT_S = 0.01  # closer instants are taken together
_TREMOR_S = 0.05  # half a period of tremor
_NAN = float("nan")


def observe(step: Step, rest: ImuSamples | None, done: ImuSamples, layout: Layout) -> Verdict:
    """Judge what has been done so far.

    Args:
        step: What was asked.
        rest: The rest right before it, for biases and attitudes; None where there was none.
        done: What is labelled with the step, from its begin; may be empty.
        layout: Which sensor sits where, in the order of the samples.

    Returns:
        Readings, the most telling first, in an order that stays while ``done`` grows. A figure
        that cannot be had is NaN and fails. A step that begins with a rest and had too little of
        it fails for "time" about "static", and then nothing is said of stillness. The cost grows
        with ``done``: of a rest of hours the last minute is enough while it lasts.
    """
    rest = None if rest is None else _thinned(rest)
    return Verdict(step.name, tuple(_readings(step, rest, done, layout)))


def enough(verdict: Verdict, step: Step, seconds: float) -> bool:
    """Whether a step that has gone on for so long [s] may stop by itself.

    It may when all is well, but a look at the result lasts as long as somebody looks.
    """
    if seconds >= step.most_s:
        return True
    return step.kind != "tryout" and seconds >= step.least_s and verdict.ok


def _readings(
    step: Step, rest: ImuSamples | None, done: ImuSamples, layout: Layout
) -> list[Reading]:
    time = Reading("time", _seconds(done), step.least_s, "s")
    everything = _answering(done, layout)
    match step.kind:
        case "fit":
            seen = [everything, *_upright(done, layout), time]
        case "rest" | "noise":
            seen = [everything, _stillness(done, layout, "table"), time]
        case "pose":
            still = _stillness(done, layout, "table")
            seen = [everything, still, *_upright(done, layout), time]
        case "turn":
            seen = [everything, *_turn(rest, done, layout), time]
        case "swing":
            seen = [*_swing(step, rest, done, layout), time]
        case "tumble":
            seen = [everything, _directions(done), time]
        case "tryout":
            seen = [everything]
    return seen


# Sensors: which answer, how they lie


def _seconds(samples: ImuSamples) -> float:
    """How long they last [s], the last instant counted in."""
    if len(samples) < 2:
        return 0.0
    lasted_us = max(0, int(samples.time_us[-1] - samples.time_us[0]))
    return round(lasted_us * 1e-6 * len(samples) / (len(samples) - 1), 6)


def _heard_pct(samples: ImuSamples) -> Float[Array, " s"]:
    if len(samples) and samples.valid.all():  # nearly always, and much faster to see
        return np.full(samples.valid.shape[1], 100.0)
    return np.asarray(100.0 * samples.valid.sum(axis=0) / max(1, len(samples)))


def _thinned(samples: ImuSamples) -> ImuSamples:
    """At most some 100 instants a second, each the mean of those it stands for.

    So noise is let in alike at every rate, and tremor all the same.
    """
    each, count = _steps(samples, _INSTANT_S)
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


def _live(samples: ImuSamples) -> Int64[Array, " l"]:
    return np.flatnonzero(_heard_pct(samples) >= demands.ANSWERING_PCT)


def _answering(samples: ImuSamples, layout: Layout) -> Reading:
    heard = _heard_pct(samples)
    worst = int(np.argmin(heard))
    silent = len(samples) > 0 and heard[worst] < demands.ANSWERING_PCT
    about = layout.names[worst] if silent else ""
    return Reading("answering", float(heard[worst]), demands.ANSWERING_PCT, "%", about=about)


def _mean(values: Float[Array, "n s 3"], where: Array) -> Float[Array, "s 3"]:
    """Mean of every sensor over the instants that count; NaN where there are none."""
    if len(values) and where.all():
        return np.asarray(values.mean(axis=0))
    count = where.sum(axis=0)[:, None]
    total = np.where(where[..., None], values, 0.0).sum(axis=0)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def _upright(samples: ImuSamples, layout: Layout) -> list[Reading]:
    """The sensor that lies least as the flat hand lets expect; nothing without a hand."""
    if not layout.is_hand:
        return []
    live = _live(samples)
    if not len(live):
        return [Reading("upright", _NAN, demands.UPRIGHT_DEG, "deg", at_least=False)]
    segments = [layout.sensors[index].segment for index in live]
    q_world_segment = _flat("left" if layout.side == "left" else "right", segments)
    up_segment = so3.rotate(so3.conjugate(q_world_segment), np.array([0.0, 0.0, 1.0]))
    off = np.rad2deg(_angle(_mean(samples.acc, samples.valid)[live], up_segment))
    limit = np.where(
        ["thumb" in name for name in segments], demands.UPRIGHT_THUMB_DEG, demands.UPRIGHT_DEG
    )
    worst = int(np.argmax(off / limit))
    value, most = float(off[worst]), float(limit[worst])
    about = layout.names[live[worst]] if value > most else ""
    return [Reading("upright", value, most, "deg", at_least=False, about=about)]


def _flat(side: HandSide, segments: list[str]) -> Float[Array, "s 4"]:
    """Attitudes of segments while the hand lies flat, the fingers to the north."""
    rest, world = nominal_skeleton(side).q_parent_rest, list[Array]()
    for index, parent in enumerate(PARENTS):
        world.append(rest[index] if parent < 0 else so3.multiply(world[parent], rest[index]))
    return np.stack([world[SEGMENTS.index(name)] for name in segments])


def _angle(a: Float[Array, "*#b 3"], b: Float[Array, "*#b 3"]) -> Float[Array, "*b"]:
    """Angle between directions [rad]."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1)))


# Rest


def _stillness(samples: ImuSamples, layout: Layout, where: str) -> Reading:
    """The most that a sensor turned in half a second [deg/s], its bias taken off."""
    limit = demands.RESTING_DEG_S if where == "table" else demands.HELD_STILL_DEG_S
    samples = _thinned(samples)
    live = _live(samples)
    if not len(live) or _seconds(samples) < 0.5 * _BLOCK_S:
        return Reading("stillness", _NAN, limit, "deg/s", at_least=False)
    gyr, valid = np.rad2deg(samples.gyr[:, live]), samples.valid[:, live]
    mean = _mean(gyr, valid)
    square = np.where(valid, np.sum((gyr - mean) ** 2, axis=-1), 0.0)
    blocks = _blocks(samples)
    turned = np.sqrt(
        np.add.reduceat(square, blocks) / np.maximum(1, np.add.reduceat(valid, blocks, dtype=int))
    )
    fast = np.maximum(turned.max(axis=0), np.linalg.norm(mean, axis=-1) - demands.BIAS_DEG_S)
    fast = np.maximum(fast, _tilting(samples, live))
    worst = int(np.argmax(fast))
    value = float(fast[worst])
    about = layout.names[live[worst]] if value > limit else ""
    return Reading("stillness", value, limit, "deg/s", at_least=False, about=about)


def _blocks(samples: ImuSamples) -> Int64[Array, " b"]:
    """Where pieces of half a second begin; what is left over belongs to the last."""
    each = max(1, round(_BLOCK_S * len(samples) / max(_seconds(samples), 1e-3)))
    return np.arange(max(1, len(samples) // each)) * each


def _tilting(samples: ImuSamples, live: Int64[Array, " l"]) -> Float[Array, " l"]:
    """How fast gravity's direction moved [deg/s]: a slow turn looks like a bias otherwise."""
    seconds, half = _seconds(samples), len(samples) // 2
    if seconds < _BLOCK_S:
        return np.zeros(len(live))
    before, after = (_mean(x.acc, x.valid)[live] for x in (samples[:half], samples[half:]))
    return np.nan_to_num(np.rad2deg(_angle(before, after)) / (0.5 * seconds))


def _directions(done: ImuSamples) -> Reading:
    """How many directions the first sensor that answers lay still in."""
    found = list[Array]()
    live = _live(done)
    if len(live) and _seconds(done) >= _BLOCK_S:
        gyr, acc = done.gyr[:, live[0]], done.acc[:, live[0]]
        blocks = _blocks(done)
        for part in zip(blocks, [*blocks[1:], len(done)], strict=True):
            rate, up = gyr[slice(*part)], acc[slice(*part)].mean(axis=0)
            still = np.rad2deg(np.linalg.norm(rate - np.median(rate, axis=0), axis=-1).max())
            slow = np.rad2deg(np.linalg.norm(rate.mean(axis=0))) < demands.BIAS_DEG_S
            new = all(_angle(up, known) > np.deg2rad(demands.APART_DEG) for known in found)
            if slow and still < 2.0 * demands.HELD_STILL_DEG_S and new:
                found.append(up)
    return Reading("directions", float(len(found)), float(demands.DIRECTIONS), "")


# Movement: what turns against what


@dataclass(frozen=True, slots=True, eq=False)
class _Moved:
    """How the rig and its joints turned since the begin.

    Attributes:
        time_s: Of every step.
        q_world_sensor: Of one sensor for each segment.
        joints: Those with a sensor on both sides, and the one above the first segment.
        turned: Their rotation vectors since the begin [rad], in the first frame of the sensor
            beyond the joint.
        q_parent_child: Between the sensors of each at the begin; of the first joint, of the world.
    """

    time_s: Float[Array, " m"]
    q_world_sensor: Float[Array, "m s 4"]
    joints: tuple[str, ...]
    turned: Float[Array, "m j 3"]
    q_parent_child: Float[Array, "j 4"]


def _moved(rest: ImuSamples | None, done: ImuSamples, layout: Layout) -> _Moved:
    """Follow the sensors by their gyroscopes, from their attitudes at rest."""
    calm = done[: max(1, len(done) // 20)] if rest is None or not len(rest) else rest
    heard = np.minimum(_heard_pct(done), _heard_pct(calm))
    stand: dict[str, int] = {}
    for index, place in enumerate(layout.sensors):
        if heard[index] >= demands.ANSWERING_PCT:
            stand.setdefault(place.segment, index)
    used = list(stand.values())
    time_s, span_s, rate = _rates(done, used)
    rate = rate - _biases(rest, done)[used]
    mag = _mean(np.nan_to_num(calm.mag), calm.fresh & calm.valid)[used]
    q_world_start = attitude(_mean(calm.acc, calm.valid)[used], mag)
    q_world_sensor = _chained(q_world_start, so3.exp(rate * span_s[:, None, None]))
    pairs = _pairs(layout, list(stand))
    q_parent_child = _between(q_world_sensor, so3.rotate(q_world_sensor, rate), pairs)
    turned = so3.log(so3.multiply(so3.conjugate(q_parent_child[:1]), q_parent_child))
    return _Moved(time_s, q_world_sensor, tuple(pairs), turned, q_parent_child[0])


def _pairs(layout: Layout, segments: list[str]) -> dict[str, tuple[int, int]]:
    """Columns of the sensors on both sides of every joint; -1: the world."""
    joint, first = _ROOT
    pairs = {joint: (-1, segments.index(first))} if first in segments else {}
    return pairs | {
        j.name: (segments.index(j.parent), segments.index(j.child))
        for j in layout.joints
        if {j.parent, j.child} <= set(segments)
    }


def _between(
    q_world_sensor: Float[Array, "m s 4"],
    rate_world: Float[Array, "m s 3"],
    pairs: dict[str, tuple[int, int]],
) -> Float[Array, "m j 4"]:
    """What lies between the two sensors of every joint, their headings agreed.

    Compasses differ by some degrees, and when both sensors turn together that looks as if the
    joint moved. Where the inner one moves, the level parts of both rates lie apart by just that.
    """
    if not pairs:
        return np.zeros((len(q_world_sensor), 0, 4))
    parent, child = np.array(list(pairs.values())).T
    x, y = rate_world[..., 0], rate_world[..., 1]
    most = float(np.sum(rate_world**2, axis=(0, 2)).max())
    along, across = (x.T @ x + y.T @ y)[parent, child], (x.T @ y)[parent, child]
    across = across - (x.T @ y)[child, parent]
    off = np.arctan2(across, np.maximum(along, 0.0) + _LEADING * most)
    q_world_parent = so3.multiply(
        so3.about_z(np.clip(off, -_CROOKED, _CROOKED)), q_world_sensor[:, parent]
    )
    q_world_parent[:, parent < 0] = so3.IDENTITY
    return so3.multiply(so3.conjugate(q_world_parent), q_world_sensor[:, child])


def _biases(rest: ImuSamples | None, done: ImuSamples) -> Float[Array, "s 3"]:
    """What gyroscopes read at rest [rad/s]: without a rest, what is left of going and coming."""
    if rest is not None and _seconds(rest) >= _BLOCK_S:
        return np.nan_to_num(_mean(rest.gyr, rest.valid))
    mean = np.nan_to_num(_mean(done.gyr, done.valid))
    small = np.linalg.norm(mean, axis=-1) < np.deg2rad(demands.BIAS_DEG_S)
    return np.asarray(np.where(small[:, None], mean, 0.0))


def _rates(done: ImuSamples, used: list[int]) -> tuple[Array, Array, Array]:
    """Times [s], spans [s] and mean rates [rad/s] of steps; a silent sensor goes on as it was."""
    each, count = _steps(done, _STEP_S)
    gyr, valid = done.gyr, done.valid
    if not valid[:, used].all():
        last = np.maximum.accumulate(np.where(valid, np.arange(len(done))[:, None], 0), axis=0)
        gyr = np.take_along_axis(gyr, last[..., None], axis=0)
    rate = gyr[: count * each].reshape(count, each, -1, 3).mean(axis=1)[:, used]
    time_s = (done.time_us - done.time_us[0]) * 1e-6
    begins = np.append(time_s, time_s[-1] + _seconds(done) / len(done))[: count * each + 1 : each]
    return begins[1:], np.maximum(np.diff(begins), 0.0), rate


def _steps(samples: ImuSamples, step_s: float) -> tuple[int, int]:
    """Samples in a step of that length, and how many whole steps there are."""
    each = max(1, round(step_s * len(samples) / max(_seconds(samples), 1e-3)))
    return each, len(samples) // each


def _chained(start: Float[Array, "s 4"], steps: Float[Array, "m s 4"]) -> Float[Array, "m s 4"]:
    """A rotation and all steps up to each, multiplied in runs side by side."""
    m, s, _ = steps.shape
    side = int(np.ceil(np.sqrt(m)))
    padded = np.tile(so3.IDENTITY, (side * side, s, 1))
    padded[:m] = steps
    q = padded.reshape(side, side, s, 4)
    for index in range(1, side):
        q[:, index] = so3.multiply(q[:, index - 1], q[:, index])
    before = np.tile(start, (side, 1, 1, 1))
    for index in range(1, side):
        before[index, 0] = so3.multiply(before[index - 1, 0], q[index - 1, -1])
    return so3.multiply(before, q).reshape(side * side, s, 4)[:m]


def _main_axes(turned: Float[Array, "m j 3"]) -> Float[Array, "j 3"]:
    """The directions in which rotation vectors spread most."""
    by_joint = np.moveaxis(turned - turned.mean(axis=0), 1, 0)
    return np.asarray(np.linalg.eigh(np.swapaxes(by_joint, 1, 2) @ by_joint)[1][..., -1])


# Turn of the whole rig


def _turn(rest: ImuSamples | None, done: ImuSamples, layout: Layout) -> list[Reading]:
    angle, pace, apart, about, tremor = 0.0, 0.0, 0.0, "", 0.0
    if _seconds(done) >= _STEP_S:
        moved = _moved(rest, done, layout)
        angle, pace = _lifted(moved)
        apart, about = _apart(moved)
        tremor = _tremor(done)
    least, slowest, most = demands.TURN_DEG, demands.TURN_PACE, demands.TOGETHER_DEG
    about = about if apart > most else ""
    return [
        Reading("turn", angle, least, "deg"),
        Reading("together", apart, most, "deg", at_least=False, about=about),
        Reading("pace", pace, slowest, "1/s"),
        Reading("stillness", tremor, demands.STIFF_DEG_S, "deg/s", at_least=False),
    ]


def _lifted(moved: _Moved) -> tuple[float, float]:
    """How far the rig was turned about a level axis [deg], and how often a second."""
    q = moved.q_world_sensor
    vectors = so3.log(so3.multiply(q, so3.conjugate(q[:1])))
    if not vectors.shape[1]:
        return _NAN, _NAN
    angle = np.median(np.linalg.norm(vectors[..., :2], axis=-1), axis=1)
    above = angle > 0.5 * angle.max()
    lifts = int(above[0]) + int(np.count_nonzero(np.diff(above.astype(int)) > 0))
    step_s = float(moved.time_s[-1]) / len(moved.time_s)
    # half the time is spent above half the way
    return float(np.rad2deg(angle.max())), 0.5 * lifts / (step_s * max(1, int(above.sum())))


def _apart(moved: _Moved) -> tuple[float, str]:
    """How far the joint turned that should have kept still and did least [deg]."""
    inner = [k for k, joint in enumerate(moved.joints) if joint != _ROOT[0]]
    if not inner:
        return 0.0, ""
    went = np.rad2deg(np.linalg.norm(moved.turned[:, inner], axis=-1).max(axis=0))
    worst = int(np.argmax(went))
    return float(went[worst]), moved.joints[inner[worst]]


def _tremor(done: ImuSamples) -> float:
    """How much the sensor that trembles most does so at some 10 Hz [deg/s].

    The fourth difference over half periods: 1 at 10 Hz, a thousandth where an arm is lifted.
    """
    done, live = _thinned(done), _live(done)
    count, (far, _) = len(done), _steps(done, _TREMOR_S)
    if count <= 4 * far or not len(live):
        return 0.0
    gyr = done.gyr[:, live]
    pieces = [gyr[k * far : count - (4 - k) * far] for k in range(5)]
    fast = sum(w * piece for w, piece in zip((1, -4, 6, -4, 1), pieces, strict=True)) / 16.0
    return float(np.rad2deg(np.sqrt(np.mean(np.sum(fast**2, axis=-1), axis=0)).max()))


# Swing of one joint


def _swing(step: Step, rest: ImuSamples | None, done: ImuSamples, layout: Layout) -> list[Reading]:
    answering = _both_sides(step.joint, done, layout)
    seen = [0.0, 0.0, 0.0]  # range [deg], pace [1/s], others as a share of what they may
    worst, allowed = "", demand_of(step).others
    if answering.ok and _seconds(done) >= _STEP_S:
        moved = _moved(rest, done, layout)
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


def _swung(step: Step, moved: _Moved) -> tuple[float, float, float, str, float]:
    """Range [deg], pace [1/s], how much the worst other joint moved along, which, and its limit."""
    demand, own = demand_of(step), moved.joints.index(step.joint)
    axes = _main_axes(moved.turned)
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
    rested_s = 0.0 if rest is None else _seconds(rest)
    time = Reading("time", rested_s, demands.RESTED_SHARE * step.rest_s, "s", about="static")
    return [time] if rest is None or not time.ok else [_stillness(rest, layout, "air"), time]


def _both_sides(joint: str, done: ImuSamples, layout: Layout) -> Reading:
    """Of the segments that a joint joins, the one whose best sensor answers least."""
    root, first = _ROOT
    sides = [(j.parent, j.child) for j in layout.joints if j.name == joint]
    sides = [("", first)] if joint == root else sides
    best = list[tuple[float, str]]()
    for segment in {side for pair in sides for side in pair if side}:
        on = [
            (float(heard), place.sensor)
            for heard, place in zip(_heard_pct(done), layout.sensors, strict=True)
            if place.segment == segment
        ]
        best.append(max(on, key=lambda known: known[0], default=(0.0, segment)))
    value, name = min(best, default=(0.0, joint))
    silent = len(done) > 0 and value < demands.ANSWERING_PCT
    return Reading("answering", value, demands.ANSWERING_PCT, "%", about=name if silent else "")


def _to_and_fro(along: Float[Array, " m"], time_s: Float[Array, " m"]) -> tuple[float, float]:
    """How far it swings [rad], the median of all ways, and how often a second."""
    back = _reversals(along)
    if len(back) < 2:
        return float(np.ptp(along)), 0.0
    far = float(np.median(np.abs(np.diff(along[back]))))
    return far, 0.5 * (len(back) - 1) / float(time_s[back[-1]] - time_s[back[0]])


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
    if step.joint not in ("thumb_cmc", _ROOT[0]):
        axis = axis + so3.rotate(q_parent_child, axis)
        axis = axis / np.linalg.norm(axis)
    flexed, dorsal = abs(float(axis[0])), abs(float(axis[2]))
    if step.turn == "flexion":
        return float(np.hypot(axis[0], axis[1])), 0.0
    return dorsal, flexed / max(dorsal, 1e-3)


def _others(
    moved: _Moved, axes: Float[Array, "j 3"], along: Float[Array, " m"], range_rad: float
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
