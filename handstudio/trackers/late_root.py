"""Where a sensor is in the room now: a late tracker beside it, and what it feels.

An error-state filter that lives in the past, as `late_attitude` does: its state is of the instant
that the newest pose is of, and the integrals of the specific force, which are remembered, lead to
now. How the sensor is turned comes from the fusion of the inertial stream; what that is off, in
heading above all, is a part of the state.

The state: place and velocity of the sensor in the room; an error ``dphi`` of attitude, in the room,
by which ``q_room_world`` is corrected; the accelerometer's bias; the lever to the terminal and an
error of its mounting, in the sensor; the delay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int64, UInt8

from handstudio.arrays import Array
from handstudio.trackers import late_small as small
from handstudio.trackers.late_align import Alignment
from handstudio.trackers.late_faults import GATE, PATIENCE_S, Fate, squared
from handstudio.trackers.late_path import Path
from handstudio.trackers.late_small import Quaternion
from handstudio.trackers.track import Track

_GRAVITY = 9.80665
_RATE_HALF_S = 0.02
_LONGEST_STEP_S = 0.25  # after a longer gap nothing is known of where it went
P, V, PHI, BIAS, LEVER, MOUNT, DELAY = (
    slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 15), slice(15, 18), 18,
)  # fmt: skip
_SIZE = 19


@dataclass(frozen=True, slots=True)
class RootFilter:
    """What is known before anything came, and how good the sensors are; SI and radians.

    Attributes:
        q_sensor_terminal, q_room_world, delay_s: As `late_align.align` found them.
        t_sensor_terminal: The lever, where it was measured [m].
        lever_sd: How well it is known [m]; it is estimated within that.
        mount_sd, heading_sd, delay_sd: How well the alignment is known.
        position_sd, attitude_sd: Of a pose.
        jitter_sd: How the delay differs from pose to pose [s].
        acc_density: What the specific force misses, noise and skin [m/s²/sqrt(Hz)].
        bias_sd, bias_walk: Of the accelerometer [m/s²], and what changes it [m/s²/sqrt(s)].
        turn_walk: How the fused attitude goes astray [rad/sqrt(s)].
        turn_share: And by how much of what it turned.
        delay_walk: How the delay changes [s/sqrt(s)].
    """

    q_sensor_terminal: Quaternion = small.IDENTITY
    q_room_world: Quaternion = small.IDENTITY
    delay_s: float = 0.05
    t_sensor_terminal: tuple[float, float, float] = (0.0, 0.0, 0.0)
    lever_sd: float = 0.03
    mount_sd: float = 0.02
    heading_sd: float = 0.05
    delay_sd: float = 0.01
    position_sd: float = 0.001
    attitude_sd: float = 0.01
    jitter_sd: float = 0.0005
    acc_density: float = 0.03
    bias_sd: float = 0.3
    bias_walk: float = 0.05
    turn_walk: float = 0.01
    turn_share: float = 0.01
    delay_walk: float = 1e-4


@dataclass(slots=True)
class RootState:
    """Everything it remembers; `run` hands on a new one and leaves the one that came alone.

    Attributes:
        path: What the sensor felt, a second back.
        waiting: Poses told after the newest sample: when [s], place, attitude.
        at_s: The instant the state is of; None: nothing was seen yet.
        t_room_sensor, v_room_sensor, q_room_world, bias, lever, q_sensor_terminal, delay_s: The
            state.
        up: Gravity's reaction in the room [m/s²].
        p: Its covariance.
        seen: The pose before.
        away_s: Since when poses are too far off [s].
    """

    path: Path
    waiting: list[tuple[float, tuple[float, ...], Quaternion]]
    at_s: float | None
    t_room_sensor: Float[Array, "3"]
    v_room_sensor: Float[Array, "3"]
    q_room_world: Quaternion
    bias: Float[Array, "3"]
    lever: Float[Array, "3"]
    q_sensor_terminal: Quaternion
    delay_s: float
    up: Float[Array, "3"]
    p: Float[Array, "19 19"]
    seen: tuple[tuple[float, ...], Quaternion] | None = None
    away_s: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Felt:
    """What is known of the sensor, sample by sample.

    Attributes:
        time_us: Of the samples [µs].
        q_world_sensor: Fused attitudes.
        acc: Specific force in the sensor's axes [m/s²].
        known: Where attitude and force can be believed; elsewhere it waits.
    """

    time_us: Int64[Array, " n"]
    q_world_sensor: Float[Array, "n 4"]
    acc: Float[Array, "n 3"]
    known: Bool[Array, " n"]

    def __getitem__(self, part: slice) -> Felt:
        return Felt(self.time_us[part], self.q_world_sensor[part], self.acc[part], self.known[part])


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """What came out, at every sample's own instant; NaN where nothing is known.

    Attributes:
        t_room_sensor: Where the sensor is [m].
        q_room_world: The world of the inertial stream in the room: what takes its attitudes there.
        sd_m: How sure the place is, along one axis [m].
        delay_s: Of the tracker, as it was known then [s].
        fates: `Fate` of every pose that was told until the last sample.
    """

    t_room_sensor: Float[Array, "n 3"]
    q_room_world: Float[Array, "n 4"]
    sd_m: Float[Array, " n"]
    delay_s: Float[Array, " n"]
    fates: UInt8[Array, " m"]


def filter_for(alignment: Alignment, like: RootFilter | None = None) -> RootFilter:
    """The filter of a terminal whose mounting, room and delay were found."""
    mount, room = alignment.q_sensor_terminal.tolist(), alignment.q_room_world.tolist()
    return replace(
        like or RootFilter(),
        q_sensor_terminal=tuple(mount),
        q_room_world=tuple(room),
        delay_s=alignment.delay_s,
    )


def begin(filter: RootFilter) -> RootState:
    """Before anything came."""
    sd = np.zeros(_SIZE)
    sd[PHI], sd[BIAS], sd[LEVER] = filter.heading_sd, filter.bias_sd, filter.lever_sd
    sd[MOUNT], sd[DELAY] = filter.mount_sd, filter.delay_sd
    return RootState(
        path=Path(),
        waiting=[],
        at_s=None,
        t_room_sensor=np.zeros(3),
        v_room_sensor=np.zeros(3),
        q_room_world=filter.q_room_world,
        bias=np.zeros(3),
        lever=np.array(filter.t_sensor_terminal),
        q_sensor_terminal=filter.q_sensor_terminal,
        delay_s=filter.delay_s,
        up=_GRAVITY * small.to_matrix(filter.q_room_world)[:, 2],
        p=np.diag(sd**2),
    )


def run(
    filter: RootFilter,
    state: RootState,
    felt: Felt,
    track: Track,
) -> tuple[Placed, RootState]:
    """Follow a stretch; cutting it anywhere changes no digit.

    Args:
        filter: Parameters.
        state: Of the stretch before.
        felt: The sensor's samples.
        track: Poses of the stretch with the times when they were told, on the same clock. Each is
            taken in with the first sample that is not before it was told.
    """
    state = replace(state, path=state.path.copied(), waiting=list(state.waiting))
    poses = zip(
        (track.time_us * 1e-6).tolist(),
        map(tuple, track.t_room_terminal.tolist()),
        map(tuple, track.q_room_terminal.tolist()),
        strict=True,
    )
    state.waiting += poses
    n = len(felt.time_us)
    t, q = np.full((n, 3), np.nan), np.full((n, 4), np.nan)
    sd, delay, fates = np.full(n, np.nan), np.empty(n), list[int]()
    attitudes = map(tuple, felt.q_world_sensor.tolist())
    times = (felt.time_us * 1e-6).tolist()
    for k, (now, attitude) in enumerate(zip(times, attitudes, strict=True)):
        known = felt.known[k]
        if not known or (state.path.at_s and now - state.path.at_s[-1] > _LONGEST_STEP_S):
            _forget(filter, state)
        if known:
            state.path.add(now, attitude, felt.acc[k])
        while state.waiting and state.waiting[0][0] <= now:
            fates.append(_see(filter, state, *state.waiting.pop(0)))
        delay[k] = state.delay_s
        if state.at_s is not None:
            t[k], _ = _ahead(state, now)
            q[k] = state.q_room_world
            sd[k] = _sd_ahead(filter, state, now - state.at_s)
    return Placed(t, q, sd, delay, np.array(fates, dtype=np.uint8)), state


def _ahead(state: RootState, to: float) -> tuple[Array, Array]:
    """Place and velocity at another instant."""
    assert state.at_s is not None
    dt, turn = to - state.at_s, small.to_matrix(state.q_room_world)
    faster, further = state.path.between(state.at_s, to)
    gained = turn @ (faster[:, 3] - faster[:, :3] @ state.bias) - dt * state.up
    gone = turn @ (further[:, 3] - further[:, :3] @ state.bias) - 0.5 * dt * dt * state.up
    return state.t_room_sensor + dt * state.v_room_sensor + gone, state.v_room_sensor + gained


def _sd_ahead(filter: RootFilter, state: RootState, seconds: float) -> float:
    variance = np.trace(state.p[P, P]) + 2.0 * seconds * np.trace(state.p[P, V])
    variance += seconds**2 * np.trace(state.p[V, V])
    return math.sqrt(variance / 3.0 + filter.acc_density**2 * abs(seconds) ** 3 / 3.0)


def _see(
    filter: RootFilter, state: RootState, told_s: float, t: tuple[float, ...], q: Quaternion
) -> Fate:
    """Take in a pose, where it belongs."""
    if not math.isfinite(sum(t)) or not state.path.at_s:
        return Fate.LOST
    if (t, q) == state.seen:
        return Fate.FROZEN
    state.seen = (t, q)
    at, place = told_s - state.delay_s, np.array(t)
    if state.at_s is None or state.at_s < state.path.at_s[0]:
        _begin_at(filter, state, at, place)
        return Fate.TAKEN
    _go_to(filter, state, at)
    off, h, r = _of_place(filter, state, place)
    fate, s = Fate.TAKEN, h @ state.p @ h.T + r
    if squared(off, s) > GATE:
        off, fate = off - 2.0 * place, Fate.MIRRORED  # a transmitter cannot tell its two sides
        if squared(off, s) > GATE:
            return _far_off(filter, state, at, place)
    state.away_s = None
    _correct(state, off, h, r)
    if math.isfinite(sum(q)):
        off, h, r = _of_attitude(filter, state, q)
        if squared(off, h @ state.p @ h.T + r) > GATE:
            return Fate.TURNED
        _correct(state, off, h, r)
    return fate


def _of_place(filter: RootFilter, state: RootState, place: Array) -> tuple[Array, Array, Array]:
    """Innovation of a place, its derivatives by the state, and its noise."""
    assert state.at_s is not None
    room = small.to_matrix(state.q_room_world)
    turn = room @ small.to_matrix(state.path.attitude(state.at_s))
    arm = turn @ state.lever
    speed = state.v_room_sensor + _cross(room @ state.path.rate(state.at_s, _RATE_HALF_S)) @ arm
    h = np.zeros((3, _SIZE))
    h[:, P], h[:, PHI], h[:, LEVER], h[:, DELAY] = np.eye(3), -_cross(arm), turn, -speed
    r = filter.position_sd**2 * np.eye(3) + filter.jitter_sd**2 * np.outer(speed, speed)
    return place - state.t_room_sensor - arm, h, r


def _of_attitude(
    filter: RootFilter, state: RootState, q_told: Quaternion
) -> tuple[Array, Array, Array]:
    """The same of an attitude."""
    assert state.at_s is not None
    q_room_sensor = small.multiply(state.q_room_world, state.path.attitude(state.at_s))
    q_expected = small.multiply(q_room_sensor, state.q_sensor_terminal)
    off = small.log(small.multiply(q_told, small.conjugate(q_expected)))
    rate = state.path.rate(state.at_s, _RATE_HALF_S)
    omega = small.to_matrix(state.q_room_world) @ rate
    h = np.zeros((3, _SIZE))
    h[:, PHI], h[:, MOUNT], h[:, DELAY] = np.eye(3), small.to_matrix(q_expected), -omega
    r = filter.attitude_sd**2 * np.eye(3) + filter.jitter_sd**2 * np.outer(omega, omega)
    return np.array(off), h, r


def _correct(state: RootState, off: Array, h: Array, r: Array) -> None:
    gain = np.linalg.solve(h @ state.p @ h.T + r, h @ state.p).T
    by, left = gain @ off, np.eye(_SIZE) - gain @ h
    state.p = left @ state.p @ left.T + gain @ r @ gain.T
    state.t_room_sensor = state.t_room_sensor + by[P]
    state.v_room_sensor = state.v_room_sensor + by[V]
    turned = small.multiply(small.exp(*by[PHI].tolist()), state.q_room_world)
    state.q_room_world = small.normalize(turned)
    state.bias, state.lever = state.bias + by[BIAS], state.lever + by[LEVER]
    mounted = small.multiply(state.q_sensor_terminal, small.exp(*by[MOUNT].tolist()))
    state.q_sensor_terminal = small.normalize(mounted)
    state.delay_s += float(by[DELAY])


def _go_to(filter: RootFilter, state: RootState, at: float) -> None:
    """Bring the state to another instant, a later one but where the delay was found longer."""
    assert state.at_s is not None
    dt, turn = at - state.at_s, small.to_matrix(state.q_room_world)
    faster, further = state.path.between(state.at_s, at)
    f = np.eye(_SIZE)
    f[P, V] = dt * np.eye(3)
    f[P, PHI], f[V, PHI] = -_cross(turn @ further[:, 3]), -_cross(turn @ faster[:, 3])
    f[P, BIAS], f[V, BIAS] = -turn @ further[:, :3], -turn @ faster[:, :3]
    state.t_room_sensor, state.v_room_sensor = _ahead(state, at)
    state.p = f @ state.p @ f.T + abs(dt) * _walks(filter)
    turned = filter.turn_share * dt * float(np.linalg.norm(state.path.rate(at, _RATE_HALF_S)))
    state.p[PHI, PHI] += turned**2 * np.eye(3)
    state.at_s = at


def _walks(filter: RootFilter) -> Array:
    walk = np.zeros(_SIZE)
    walk[V], walk[PHI], walk[BIAS] = filter.acc_density, filter.turn_walk, filter.bias_walk
    walk[DELAY] = filter.delay_walk
    return np.diag(walk**2)


def _begin_at(filter: RootFilter, state: RootState, at: float, place: Array) -> None:
    """Place of a pose, nothing known of velocity; what is known of the sensors stays."""
    q_room_sensor = small.multiply(state.q_room_world, state.path.attitude(at))
    state.t_room_sensor = place - small.to_matrix(q_room_sensor) @ state.lever
    state.v_room_sensor, state.at_s = np.zeros(3), at
    p = state.p.copy()
    p[:6], p[:, :6] = 0.0, 0.0
    # anywhere around the pose by the lever; hands are not faster
    p[P, P] = (filter.position_sd + filter.lever_sd) ** 2 * np.eye(3)
    p[V, V] = np.eye(3)
    state.p = p


def _far_off(filter: RootFilter, state: RootState, at: float, place: Array) -> Fate:
    """A jump, or a tracker that stays away so long that it is believed."""
    state.away_s = at if state.away_s is None else state.away_s
    if at - state.away_s < PATIENCE_S:
        return Fate.JUMPED
    fresh, state.away_s = begin(filter), None
    state.p, state.delay_s, state.bias = fresh.p, fresh.delay_s, fresh.bias
    _begin_at(filter, state, at, place)
    return Fate.AFRESH


def _forget(filter: RootFilter, state: RootState) -> None:
    """After a gap attitudes begin anew: what is left is what is known of mounting and delay."""
    state.path, state.at_s, state.away_s = Path(), None, None
    p = state.p.copy()
    p[PHI], p[:, PHI] = 0.0, 0.0
    p[PHI, PHI] = filter.heading_sd**2 * np.eye(3)
    state.p = p


def _cross(v: Array) -> Array:
    x, y, z = v.tolist()
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
