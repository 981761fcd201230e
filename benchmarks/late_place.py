"""A virtual person with a late tracker on hand or forearm: where the hand is, against the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.trials import Followed, Trial, follow, performance
from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3
from handstudio.pipeline import Doubt
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.rig import hand_at
from handstudio.simulation.subject import subject
from handstudio.simulation.trajectory import stretched
from handstudio.simulation.world import World
from handstudio.trackers import late_root
from handstudio.trackers.late_align import align, attitude_at
from handstudio.trackers.late_root import Felt, RootFilter
from handstudio.trackers.track import Track

MOTION = "quick_start+ball_throw&elbow_moving:all 30+tissue"
"""The hand goes at up to 2.3 to 4.1 m/s in it."""

TRACKER_HZ, DELAY_S = 60.0, 0.05
POSITION_SD, ATTITUDE_SD = 0.001, float(np.deg2rad(0.15))
LEVER = np.array([0.010, 0.004, 0.008])  # from sensor to terminal
LEVER_SD = 0.0006  # along each axis: it was measured with a calliper
_SETTLED_S = 5.0  # compared from then on
_BAD = int(Doubt.UNPLACED | Doubt.SILENT)


@dataclass(frozen=True, slots=True)
class Placing:
    """Who, and on which segment's sensor the terminal sits."""

    person: int
    seed: int
    segment: str
    fastest_m_s: float | None = None  # of the hand: all is slowed down to that
    imperfections: str = "typical"
    filter: str = "tree"
    like: RootFilter = RootFilter(lever_sd=0.0)
    lever_known: bool = True


@lru_cache(maxsize=2)
def _followed(
    person: int, seed: int, imperfections: str, filter: str, fastest_m_s: float | None
) -> Followed:
    trial = Trial(person, MOTION, parse(imperfections), seed, filter=filter)
    performed = performance(subject(person), MOTION, seed)
    if fastest_m_s is not None:
        at = np.arange(0.0, performed.duration_s, 0.01)
        _, segments = hand_at(subject(person), performed, at, World())
        speed = _length(segments.v[:, SEGMENTS.index("middle_proximal")]).max()  # its knuckle
        performed = stretched(performed, max(1.0, float(speed) / fastest_m_s))
    return follow(trial, performed)


def place(asked: Placing) -> dict[str, Any]:
    """RMS errors [mm, deg, ms], of the sensor, the joint its segment begins at, and the rest."""
    followed = _followed(
        asked.person, asked.seed, asked.imperfections, asked.filter, asked.fastest_m_s
    )
    truth, motion, worn = followed.truth, followed.motion, followed.worn
    k = followed.setup.layout.drivers[asked.segment]
    rng = np.random.default_rng([asked.seed, 7])
    room = _Room(so3.normalize(rng.normal(size=4)), rng.normal(0.0, 0.3, 3))
    q_sensor_terminal = so3.normalize(rng.normal(size=4))
    track = _track(followed, k, room, q_sensor_terminal, rng)
    known = (motion.doubt[:, k] & _BAD) == 0
    acc = np.concatenate([run.acc[:, k] for run in followed.runs])
    felt = Felt(truth.time_us, np.array(motion.q_world_sensor[:, k]), acc, known)
    found = align(felt.time_us[known], felt.q_world_sensor[known], track)
    lever = LEVER + rng.normal(0.0, LEVER_SD, 3) if asked.lever_known else np.zeros(3)
    x, y, z = lever.tolist()
    filter = late_root.filter_for(found, replace(asked.like, t_sensor_terminal=(x, y, z)))
    placed, state = late_root.run(filter, late_root.begin(filter), felt, track)
    true = room.seen(truth.t_world_sensor[:, k])
    compared = np.isfinite(placed.t_room_sensor[:, 0]) & (truth.time_us > _SETTLED_S * 1e6)
    q_room_sensor = so3.multiply(placed.q_room_world, felt.q_world_sensor)
    q_true = so3.multiply(room.q, truth.q_world_sensor[:, k])
    # to the joint as mounting and bones are at rest: what skin does to it is in the error
    q_room_segment = so3.multiply(q_room_sensor, so3.conjugate(worn.mounting.q_segment_sensor[k]))
    arm = so3.rotate(q_room_segment, worn.mounting.t_segment_sensor[k])
    joint = room.seen(truth.t_world_joint[:, SEGMENTS.index(asked.segment)])
    at = np.searchsorted(track.time_us, truth.time_us, side="right") - 1
    held = track.t_room_terminal[np.maximum(at, 0)] - so3.rotate(q_true, LEVER)
    speed = np.linalg.norm(np.gradient(true, 1e-6 * truth.time_us, axis=0), axis=-1)
    return {
        "person": asked.person,
        "segment": asked.segment,
        "root_mm": _rms(1e3 * _length(placed.t_room_sensor - arm - joint), compared),
        "sensor_mm": _rms(1e3 * _length(placed.t_room_sensor - true), compared),
        "held_mm": _rms(1e3 * _length(held - true), compared),
        "attitude_deg": _rms(np.rad2deg(so3.angle_between(q_room_sensor, q_true)), compared),
        "delay_ms": 1e3 * (state.delay_s - DELAY_S),
        "lever_mm": 1e3 * float(np.linalg.norm(state.lever - LEVER)),
        "told_sd_mm": _rms(1e3 * np.sqrt(3.0) * placed.sd_m, compared),
        "fastest_m_s": float(speed[compared].max()),
    }


@dataclass(frozen=True, slots=True)
class _Room:
    """How the world lies in the tracker's room."""

    q: Array
    t: Array

    def seen(self, t_world: Array) -> Array:
        return np.asarray(self.t + so3.rotate(self.q, t_world))


def _track(
    followed: Followed, k: int, room: _Room, q_sensor_terminal: Array, rng: np.random.Generator
) -> Track:
    truth = followed.truth
    time_s = truth.time_us * 1e-6
    told_s = np.arange(time_s[0] + 2.0 * DELAY_S, time_s[-1], 1.0 / TRACKER_HZ)
    q = attitude_at(time_s, truth.q_world_sensor[:, k], told_s - DELAY_S)
    t = CubicSpline(time_s, truth.t_world_sensor[:, k])(told_s - DELAY_S)
    noise = so3.exp(rng.normal(0.0, ATTITUDE_SD, (len(told_s), 3)))
    q_told = so3.multiply(so3.multiply(so3.multiply(room.q, q), q_sensor_terminal), noise)
    t_told = room.seen(t + so3.rotate(q, LEVER)) + rng.normal(0.0, POSITION_SD, t.shape)
    time_us = np.round(told_s * 1e6).astype(np.int64)
    return Track("terminal", time_us, t_told, q_told, np.ones(len(told_s)))


def _length(v: Array) -> Array:
    return np.asarray(np.linalg.norm(v, axis=-1))


def _rms(values: Array, part: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values[part]))))
