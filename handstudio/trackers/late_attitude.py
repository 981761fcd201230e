"""Attitude now, from gyroscopes and a tracker that is late by an unknown time.

An error-state filter on quaternions that lives in the past: its state is of the instant that the
newest tracker pose is of, where the pose belongs. From there the gyroscopes' turns, which are
remembered, lead to now. That equals applying the pose to a stored past state and going through all
samples since again, at the cost of two products (`late_turns`).

The state is attitude, bias of the gyroscopes and the delay; an error of attitude is
``q = q_found exp(dtheta)``, in the sensor. A pose that is later than thought by ``dd`` is off by
``-omega dd``: so the delay shows wherever anything turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int64, UInt8

from handstudio.arrays import Array
from handstudio.trackers import late_small as small
from handstudio.trackers.late_faults import GATE, PATIENCE_S, Fate, squared
from handstudio.trackers.late_small import Quaternion
from handstudio.trackers.late_turns import Turns
from handstudio.trackers.track import Track

_RATE_HALF_S = 0.03  # rates are means of so long to either side: their noise would bias the delay
_LATEST_S = 0.6


@dataclass(frozen=True, slots=True)
class LateFilter:
    """How good the sensors are; instants in seconds, angles in radians.

    Attributes:
        delay_s, delay_sd: What is known of the delay before anything came [s].
        delay_walk: How it changes [s/sqrt(s)].
        jitter_sd: How it differs from sample to sample [s].
        tracker_sd: Of a pose, about each axis [rad].
        gyr_density: White noise of rates [rad/s/sqrt(Hz)].
        bias_sd, bias_walk: Of the gyroscopes [rad/s], and how it changes [rad/s/sqrt(s)].
    """

    delay_s: float = 0.1
    delay_sd: float = 0.04
    delay_walk: float = 1e-4
    jitter_sd: float = 0.001
    tracker_sd: float = 0.013
    gyr_density: float = 0.015
    bias_sd: float = 0.1
    bias_walk: float = 2e-3


@dataclass(slots=True)
class LateState:
    """Everything it remembers; `run` hands on a new one and leaves the one that came alone.

    Attributes:
        turns: Of the gyroscopes, a second back.
        waiting: Poses told after the newest gyroscope sample: when [s], attitude.
        at_s: The instant the state is of; None: nothing was seen yet.
        q_room_sensor, bias, delay_s: The state.
        p: Covariance of ``dtheta``, bias and delay.
        q_seen: The pose before.
        away: Since when poses are too far off, since when in one place [s], and in which.
    """

    turns: Turns = field(default_factory=Turns)
    waiting: list[tuple[float, Quaternion]] = field(default_factory=list)
    at_s: float | None = None
    q_room_sensor: Quaternion = small.IDENTITY
    bias: Float[Array, "3"] = field(default_factory=lambda: np.zeros(3))
    delay_s: float = 0.0
    p: Float[Array, "7 7"] = field(default_factory=lambda: np.zeros((7, 7)))
    q_seen: Quaternion | None = None
    away: tuple[float, float, Quaternion] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """What came out.

    Attributes:
        q_room_sensor: Attitude at every gyroscope sample, at its own instant; NaN before the first
            pose.
        sd_rad: How sure it is, about one axis [rad].
        delay_s: As it was known then [s].
        fates: `Fate` of every pose that was told until the last gyroscope sample.
    """

    q_room_sensor: Float[Array, "n 4"]
    sd_rad: Float[Array, " n"]
    delay_s: Float[Array, " n"]
    fates: UInt8[Array, " m"]


def begin(filter: LateFilter) -> LateState:
    """Before anything came."""
    sd = [0.0] * 3 + [filter.bias_sd] * 3 + [filter.delay_sd]
    return LateState(delay_s=filter.delay_s, p=np.diag(np.square(sd)))


def run(
    filter: LateFilter,
    state: LateState,
    time_us: Int64[Array, " n"],
    gyr: Float[Array, "n 3"],
    track: Track,
) -> tuple[Followed, LateState]:
    """Follow a stretch; cutting it anywhere changes no digit.

    Args:
        filter: Parameters.
        state: Of the stretch before.
        time_us: Of the gyroscope samples [µs].
        gyr: About x, y and z [rad/s].
        track: Poses of the stretch, with the times when they were told, on the same clock;
            attitudes in the gyroscopes' axes. Each is taken in with the first gyroscope sample that
            is not before it was told.
    """
    state = replace(state, turns=state.turns.copied(), waiting=list(state.waiting))
    told_s, poses = (track.time_us * 1e-6).tolist(), track.q_room_terminal.tolist()
    state.waiting += zip(told_s, map(tuple, poses), strict=True)
    n = len(time_us)
    q, sd, delay, fates = np.full((n, 4), np.nan), np.full(n, np.nan), np.empty(n), list[int]()
    for k, (now, rate) in enumerate(zip((time_us * 1e-6).tolist(), gyr.tolist(), strict=True)):
        state.turns.add(now, tuple(rate))
        while state.waiting and state.waiting[0][0] <= now:
            fates.append(_see(filter, state, *state.waiting.pop(0)))
        delay[k] = state.delay_s
        if state.at_s is not None:
            turn, _ = state.turns.between(state.at_s, now, state.bias)
            q[k] = small.multiply(state.q_room_sensor, turn)
            sd[k] = _sd_ahead(filter, state, now - state.at_s)
    return Followed(q, sd, delay, np.array(fates, dtype=np.uint8)), state


def _sd_ahead(filter: LateFilter, state: LateState, seconds: float) -> float:
    attitude = np.trace(state.p[:3, :3]) + seconds**2 * np.trace(state.p[3:6, 3:6])
    return math.sqrt(attitude / 3.0 + filter.gyr_density**2 * abs(seconds))


def _see(filter: LateFilter, state: LateState, told_s: float, q_told: Quaternion) -> Fate:
    """Take in a pose, where it belongs."""
    if not math.isfinite(sum(q_told)):
        return Fate.LOST
    if q_told == state.q_seen:
        return Fate.FROZEN
    state.q_seen = q_told
    at = told_s - state.delay_s
    if state.at_s is None or state.at_s < state.turns.first_s:
        _begin_at(filter, state, at, q_told)  # of before the gyroscopes: there is no way from it
        return Fate.TAKEN
    _go_to(filter, state, at)
    off = np.array(small.log(small.multiply(small.conjugate(state.q_room_sensor), q_told)))
    omega = state.turns.rate(at, state.bias, _RATE_HALF_S)
    h = np.concatenate([np.eye(3), np.zeros((3, 3)), -omega[:, None]], axis=1)
    r = filter.tracker_sd**2 * np.eye(3) + filter.jitter_sd**2 * np.outer(omega, omega)
    s = h @ state.p @ h.T + r
    if squared(off, s) > GATE:
        return _far_off(filter, state, at, q_told)
    state.away = None
    gain = np.linalg.solve(s, h @ state.p).T
    _correct(state, gain @ off)
    left = np.eye(7) - gain @ h
    state.p = left @ state.p @ left.T + gain @ r @ gain.T  # Joseph's form stays positive
    return Fate.TAKEN


def _begin_at(filter: LateFilter, state: LateState, at: float, q_told: Quaternion) -> None:
    state.at_s, state.q_room_sensor = at, q_told
    state.p = state.p.copy()
    state.p[:3, :] = 0.0
    state.p[:, :3] = 0.0
    # where it was then is known as well as the delay: what may have turned meanwhile is not
    sd = filter.tracker_sd + np.sqrt(state.p[6, 6]) * np.linalg.norm(
        state.turns.rate(at, state.bias, _RATE_HALF_S)
    )
    state.p[:3, :3] = sd**2 * np.eye(3)


def _go_to(filter: LateFilter, state: LateState, at: float) -> None:
    """Bring the state to another instant, a later one but where the delay was found longer."""
    assert state.at_s is not None
    turn, m = state.turns.between(state.at_s, at, state.bias)
    f = np.eye(7)
    f[:3, :3] = small.to_matrix(small.conjugate(turn))
    f[:3, 3:6] = -m
    walks = [filter.gyr_density] * 3 + [filter.bias_walk] * 3 + [filter.delay_walk]
    state.p = f @ state.p @ f.T + abs(at - state.at_s) * np.diag(np.square(walks))
    state.q_room_sensor = small.normalize(small.multiply(state.q_room_sensor, turn))
    state.at_s = at


def _correct(state: LateState, by: Array) -> None:
    state.q_room_sensor = small.multiply(state.q_room_sensor, small.exp(*by[:3].tolist()))
    state.bias = state.bias + by[3:6]
    state.delay_s = float(np.clip(state.delay_s + by[6], 0.0, _LATEST_S))


def _far_off(filter: LateFilter, state: LateState, at: float, q_told: Quaternion) -> Fate:
    """A jump, or the new place of a tracker that stays there as the gyroscopes say it would."""
    jump = small.multiply(q_told, small.conjugate(state.q_room_sensor))
    if state.away is None:
        state.away = (at, at, jump)
    since, elsewhere, before = state.away
    moved = small.log(small.multiply(small.conjugate(before), jump))
    if math.hypot(*moved) > 10.0 * filter.tracker_sd:
        elsewhere = at
    state.away = (since, elsewhere, jump)
    if at - elsewhere < PATIENCE_S and at - since < 3.0 * PATIENCE_S:
        return Fate.JUMPED
    fresh = begin(filter)  # what was believed led here: bias and delay are not known any more
    state.bias, state.delay_s, state.p, state.away = fresh.bias, fresh.delay_s, fresh.p, None
    _begin_at(filter, state, at, q_told)
    return Fate.AFRESH
