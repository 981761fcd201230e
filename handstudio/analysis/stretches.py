"""Where in a motion something should make one look twice: missing, doubted or hardly possible.

Doubts are the filter's and stand in the motion. What a hand cannot do, and a hand at rest that
turns, are judged from the motion alone, ten times a second, so that an hour takes seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, TypeAlias

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.hand.possible import possible
from handstudio.hand_fit import fit_of
from handstudio.kinematics import angles_of, measured_angles
from handstudio.maths import so3
from handstudio.pipeline import Doubt, Motion
from handstudio.setup import Setup

StretchKind: TypeAlias = Literal["gap", "unplaced", "saturated", "silent", "impossible", "drift"]


class Stretch(msgspec.Struct, frozen=True):
    """A stretch of a motion, seconds from its first instant.

    Attributes:
        kind: What is the matter.
        start_s: Its first instant; of a gap, the last one before.
        end_s: Its last instant; of a gap, the first one after.
        names: Sensors or joint angles concerned; none for a gap.
        worst: Of a gap, instants missing; of what is impossible, degrees beyond what a hand can; of
            a drift, degrees a minute; else the share of the sensors.
    """

    kind: StretchKind
    start_s: float
    end_s: float
    names: tuple[str, ...] = ()
    worst: float = 0.0


MOST = 200
"""Stretches of a kind that are told; where there are more, neighbours are joined."""

_STEP_S = 0.1
_LASTS_S = 0.3  # what is shorter is a glitch of one instant, and no posture
_REST_S = 5.0
_REST_DEG_S = 3.0  # faster than a resting hand trembles, slower than anything one does
_DRIFT_DEG = 1.5  # turned in a rest: more than noise and breathing


def stretches_of(
    setup: Setup, motion: Motion, progress: Callable[[float], None] = lambda _share: None
) -> tuple[Stretch, ...]:
    """All stretches of a motion, in order of time.

    Args:
        setup: What the motion was computed by.
        motion: At least one instant.
        progress: Told the share that is done.
    """
    time_s = np.asarray((motion.time_us - motion.time_us[0]) * 1e-6)
    found = _gaps(time_s, setup.rate_hz) + _doubts(setup, motion, time_s)
    progress(0.2)
    few = np.unique(np.searchsorted(time_s, np.arange(0.0, time_s[-1] + _STEP_S, _STEP_S)))
    few = few[few < len(time_s)]
    thin = Motion(*(getattr(motion, name)[few] for name in Motion.__slots__))
    if setup.layout.is_hand:
        found += _impossible(setup, thin, time_s[few], progress)
    found += _drifts(setup, thin, time_s[few])
    progress(1.0)
    return tuple(sorted(found, key=lambda one: (one.start_s, one.kind)))


def _gaps(time_s: Float[Array, " n"], rate_hz: float) -> list[Stretch]:
    missing = np.maximum(np.rint(np.diff(time_s) * rate_hz) - 1.0, 0.0)
    return [
        Stretch("gap", float(time_s[k]), float(time_s[e + 1]), (), float(missing[k : e + 1].sum()))
        for k, e in _runs(missing > 0.0)
    ]


def _doubts(setup: Setup, motion: Motion, time_s: Float[Array, " n"]) -> list[Stretch]:
    found: list[Stretch] = []
    names = setup.layout.names
    kinds: tuple[tuple[StretchKind, Doubt], ...] = (
        ("unplaced", Doubt.UNPLACED),
        ("saturated", Doubt.SATURATED),
        ("silent", Doubt.SILENT),
    )
    for kind, doubt in kinds:
        on = (motion.doubt & np.uint8(doubt)) != 0
        for begin, end in _runs(on.any(axis=1)):
            who = np.flatnonzero(on[begin : end + 1].any(axis=0))
            told = tuple(names[i] for i in who)
            found.append(
                Stretch(kind, float(time_s[begin]), float(time_s[end]), told, len(who) / len(names))
            )
    return found


def _impossible(
    setup: Setup, thin: Motion, time_s: Float[Array, " m"], progress: Callable[[float], None]
) -> list[Stretch]:
    angles = [angle for angle in measured_angles(setup.layout) if possible(angle) is not None]
    limits = np.array([possible(angle) for angle in angles])
    fit, block = fit_of(setup), 2000
    beyond = np.zeros((len(thin), len(angles)))
    for begin in range(0, len(thin), block):
        part = slice(begin, begin + block)
        deg = np.rad2deg(angles_of(setup, thin[part], angles, fit))
        beyond[part] = np.maximum(np.maximum(limits[:, 0] - deg, deg - limits[:, 1]), 0.0)
        progress(0.2 + 0.7 * min(1.0, (begin + block) / len(thin)))
    beyond[(thin.doubt & np.uint8(Doubt.UNPLACED)).any(axis=1)] = 0.0  # nobody believes these
    found: list[Stretch] = []
    outside: Array = (beyond > 0.0).max(axis=1)
    for begin, end in _runs(outside):
        if time_s[end] - time_s[begin] < _LASTS_S:
            continue
        worst = beyond[begin : end + 1].max(axis=0)
        names = tuple(angles[i].name for i in np.argsort(-worst) if worst[i] > 0.0)
        ends = float(time_s[begin]), float(time_s[end])
        found.append(Stretch("impossible", *ends, names, float(worst.max())))
    return found


def _drifts(setup: Setup, thin: Motion, time_s: Float[Array, " m"]) -> list[Stretch]:
    """Rests in which a sensor turned though nothing moved."""
    if len(thin) < 2:
        return []
    q = thin.q_world_sensor
    steps = np.linalg.norm(so3.log(so3.multiply(so3.conjugate(q[:-1]), q[1:])), axis=-1)
    deg_s = np.rad2deg(steps) / np.diff(time_s)[:, None]
    still: Array = (deg_s < _REST_DEG_S).all(axis=1)
    found: list[Stretch] = []
    for begin, end in _runs(still):
        seconds = float(time_s[end + 1] - time_s[begin])
        if seconds < _REST_S:
            continue
        turn = so3.log(so3.multiply(so3.conjugate(q[begin]), q[end + 1]))
        deg = np.rad2deg(np.linalg.norm(turn, axis=-1))
        who = [int(i) for i in np.argsort(-deg) if deg[i] > _DRIFT_DEG]
        if who:
            ends = float(time_s[begin]), float(time_s[end + 1])
            names = tuple(setup.layout.names[i] for i in who)
            found.append(Stretch("drift", *ends, names, float(deg.max()) * 60.0 / seconds))
    return found


def _runs(on: Bool[Array, " n"]) -> Sequence[tuple[int, int]]:
    """First and last index of every run of True, joined with their neighbours beyond `MOST`."""
    padded = np.concatenate([[False], on, [False]])
    begins = np.flatnonzero(~padded[:-1] & padded[1:])
    ends = np.flatnonzero(padded[:-1] & ~padded[1:]) - 1
    if len(begins) > MOST:
        chosen = np.linspace(0, len(begins) - 1, MOST).astype(int)
        begins, ends = begins[chosen], ends[np.append(chosen[1:] - 1, len(ends) - 1)]
    return [(int(b), int(e)) for b, e in zip(begins, ends, strict=True)]
