"""Virtual trackers: terminals on a moving hand, and what a tracker makes of where they are.

Terminals sit on skin that slides and rocks as it does under the boards of a glove (`skin`), and
what they are told to be is noisy, late, now and then missing, and bent by metal. Metal is a small
conductor in which the transmitter's field drives eddy currents: a sphere of radius a answers a
field B with the moment ``-2 pi a³ B / mu0``, which is what keeps the field out of a perfect one.
What the tracker makes of it is computed by a tracker's own way from signals to poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.imperfections.noise import generator
from handstudio.simulation.imperfections.strengths import IDEAL, Imperfections
from handstudio.simulation.mounting import Mounting, donned
from handstudio.simulation.moving import picked
from handstudio.simulation.rig import hand_at
from handstudio.simulation.skin import on_skin, settled, skin_of
from handstudio.simulation.subject import Subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.world import World
from handstudio.trackers.dipole import signals
from handstudio.trackers.dipole_pose import closed_form
from handstudio.trackers.track import Track

TERMINAL_HALF_M = 0.0048
"""From the skin to the middle of a terminal: the seed's receiver is a cube of 9.6 mm (0094)."""

ALONG = 0.5  # of the bone: the seed puts receivers in its middle (0103)


@dataclass(frozen=True, slots=True)
class Metal:
    """A conductor near the transmitter: a sphere, in the tracker's frame [m]."""

    place_m: tuple[float, float, float]
    radius_m: float


@dataclass(frozen=True, slots=True)
class TrackerErrors:
    """What is wrong with what a tracker tells; sizes are ours unless said.

    Attributes:
        noise_m: Standard deviation of every coordinate.
        noise_rad: Of the attitude about every axis.
        late_s: Poses are told so long after they were.
        lost: Share of instants without a pose.
        lost_for_s: How long a drop-out lasts, in the mean.
        metal: Conductors nearby.
        tug_rad: How far cable and flesh let a terminal tilt about each axis: a slow wander, and
            the terminal shifts as it tilts.
        knocked: Share of time in which something brushes against a terminal, the other one, a
            finger, a cable: for a second it is tilted by 10 deg and shifted by 3 mm (sd an axis).
    """

    noise_m: float = 1e-4
    noise_rad: float = float(np.deg2rad(0.1))
    late_s: float = 0.0
    lost: float = 0.0
    lost_for_s: float = 0.1
    metal: tuple[Metal, ...] = ()
    tug_rad: float = 0.0
    knocked: float = 0.0


ON_A_FINGER = TrackerErrors(tug_rad=float(np.deg2rad(0.3)), knocked=0.1)
"""Terminals on a finger. Tugs and knocks are sized on `subject.DEVELOPMENT` so that axes scatter,
and the seed's points lie apart, as in its figures 11 and 12; nothing else is."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """What a tracker told, and what was true then, in the tracker's frame.

    Attributes:
        tracks: One a terminal.
        q_room_segment: Attitudes of all segments at the instants that poses are of.
        t_room_joint: Their joint centres [m].
        spans: What was done when [s]: start, end, name.
    """

    tracks: tuple[Track, ...]
    q_room_segment: Float[Array, "n k 4"]
    t_room_joint: Float[Array, "n k 3"]
    spans: tuple[tuple[float, float, str], ...]


def tracked(
    subject: Subject,
    trajectory: Trajectory,
    segments: tuple[str, ...],
    errors: TrackerErrors,
    seed: int,
    *,
    skin: Imperfections = IDEAL,
    performance: int = 0,
    base: str | None = None,
    rate_hz: float = 240.0,
) -> Tracked:
    """Follow a terminal on each of these segments through a motion.

    Args:
        subject: Whose hand.
        trajectory: What it does.
        segments: Which segments carry a terminal, by name.
        errors: Of the tracker.
        seed: One tracker, put on once, on one skin.
        skin: Strengths of ``slide``, ``rock``, ``wobble`` and ``mounting``; others do not matter.
        performance: Another one has other noise, and the same terminals at the same places.
        base: The segment that carries the transmitter; None: it stands in the world's origin.
        rate_hz: Poses a second: 240 as the seed's (0097).
    """
    time_s = np.arange(0.0, trajectory.duration_s, 1.0 / rate_hz)
    world = World()
    joints, hand = hand_at(subject, trajectory, time_s, world)
    on = tuple(SEGMENTS.index(name) for name in segments)
    mounting = terminals_on(subject, segments, seed, skin.mounting)
    worn = skin_of(skin, subject.skeleton, mounting, on, seed=seed)
    terminals, _ = on_skin(worn, settled(worn), time_s, joints, picked(hand, list(on)))
    q_world_base, t_world_base = _base(subject, hand.q, hand.t, base, seed)
    q_base_world = so3.conjugate(q_world_base)[:, None]
    q_true = so3.multiply(q_base_world, terminals.q)
    t_true = so3.rotate(q_base_world, terminals.t - t_world_base[:, None])
    tracks = []
    for index, name in enumerate(segments):
        rng = generator(seed, _NOISE, performance, index)
        t, q = _loose(time_s, t_true[:, index], q_true[:, index], errors, rng)
        tracks.append(_told(name, time_s, (t, q), errors, rng))
    return Tracked(
        tuple(tracks),
        so3.multiply(q_base_world, hand.q),
        so3.rotate(q_base_world, hand.t - t_world_base[:, None]),
        tuple((span.start_s, span.end_s, span.name) for span in trajectory.spans),
    )


def terminals_on(
    subject: Subject, segments: tuple[str, ...], seed: int, strength: float = 1.0
) -> Mounting:
    """Terminals on the backs of segments, in their middle, put on as a glove's boards are."""
    on = [SEGMENTS.index(name) for name in segments]
    height = subject.half_depth_m[on] + TERMINAL_HALF_M
    place = ALONG * subject.skeleton.t_far_end[on] + height[:, None] * [0.0, 0.0, 1.0]
    nominal = Mounting(np.tile(so3.IDENTITY, (len(on), 1)), place)
    return donned(nominal, seed, subject.side, strength)


_NOISE, _STRAP = 60, 61  # which of a seed's streams
_STRAPPED_DEG = 6.0  # sd: how a transmitter is turned on a wrist or palm


def _base(subject: Subject, q: Array, t: Array, base: str | None, seed: int) -> tuple[Array, Array]:
    """Where the transmitter is; its y lies across the hand, as the seed has it."""
    if base is None:
        return np.tile(so3.IDENTITY, (len(q), 1)), np.zeros((len(q), 3))
    index = SEGMENTS.index(base)
    rng = generator(seed, _STRAP)
    strapped = so3.exp(np.deg2rad(_STRAPPED_DEG) * rng.standard_normal(3))
    q_segment_base = so3.multiply(so3.about_z(-0.5 * np.pi), strapped)
    place = 0.7 * subject.skeleton.t_far_end[index] + np.array([0.0, 0.0, 0.03])
    return so3.multiply(q[:, index], q_segment_base), t[:, index] + so3.rotate(q[:, index], place)


_KNOT_S = 0.25  # between the knots of a terminal's wander
_KNOCK_KNOTS = 4  # so long it is knocked
_TUG_DEPTH_M = 0.010  # it tilts about a point so far beneath
_KNOCK_RAD, _KNOCK_M = float(np.deg2rad(10.0)), 0.003  # sd about and along every axis


def _loose(
    time_s: Array, t: Array, q: Array, errors: TrackerErrors, rng: np.random.Generator
) -> tuple[Array, Array]:
    """A terminal that its cable tugs at, and that is knocked now and then."""
    if not (errors.tug_rad or errors.knocked):
        return t, q
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - takes a second to load

    knots = np.arange(-_KNOT_S, time_s[-1] + 2.0 * _KNOT_S, _KNOT_S)
    drawn = rng.random(len(knots) // _KNOCK_KNOTS + 1) < errors.knocked
    knocked = np.repeat(drawn, _KNOCK_KNOTS)[: len(knots), None]
    tilts = (errors.tug_rad + knocked * _KNOCK_RAD) * rng.standard_normal((len(knots), 3))
    shifts = knocked * _KNOCK_M * rng.standard_normal((len(knots), 3))
    tilt, shift = so3.exp(CubicSpline(knots, tilts)(time_s)), CubicSpline(knots, shifts)(time_s)
    arm = np.array([0.0, 0.0, _TUG_DEPTH_M])
    shift = shift + so3.rotate(tilt, arm) - arm
    return t + so3.rotate(q, shift), so3.multiply(q, tilt)


def _told(
    name: str,
    time_s: Array,
    pose: tuple[Array, Array],
    errors: TrackerErrors,
    rng: np.random.Generator,
) -> Track:
    t, q = pose
    if errors.metal:
        t, q = bent_by_metal(t, q, errors.metal)
    t = t + errors.noise_m * rng.standard_normal(t.shape)
    q = so3.multiply(q, so3.exp(errors.noise_rad * rng.standard_normal(t.shape)))
    quality = np.ones(len(t))
    gone = _drop_outs(time_s, errors, rng)
    t[gone], q[gone], quality[gone] = np.nan, np.nan, 0.0
    time_us = np.round((time_s + errors.late_s) * 1e6).astype(np.int64)
    return Track(name, time_us, t, q, quality)


def _drop_outs(time_s: Array, errors: TrackerErrors, rng: np.random.Generator) -> Array:
    """Two states with chances a step such that share and mean length come out."""
    gone = np.zeros(len(time_s), dtype=bool)
    if errors.lost <= 0.0:
        return gone
    back = min(1.0, float(np.median(np.diff(time_s))) / errors.lost_for_s)
    away = back * errors.lost / max(1e-9, 1.0 - errors.lost)
    chance, now = rng.random(len(time_s)), False
    for index, each in enumerate(chance):
        now = each >= back if now else each < away
        gone[index] = now
    return gone


def bent_by_metal(t: Array, q: Array, metal: tuple[Metal, ...]) -> tuple[Array, Array]:
    """What a tracker that knows of no metal makes of its signals."""
    heard = signals(t, q)
    q_terminal_room = so3.to_matrix(so3.conjugate(q))
    for piece in metal:
        place = np.asarray(piece.place_m)
        there = signals(place[None], so3.IDENTITY[None])[0]
        # the answer of a sphere: a dipole of -(a³ / 2) of the field there, in units of the coil's
        answer = -0.5 * piece.radius_m**3 * there
        heard = heard + q_terminal_room @ signals(t - place, np.tile(so3.IDENTITY, (len(t), 1))) @ (
            answer
        )
    # which half of the room a terminal is in is known to whoever put the transmitter there
    return closed_form(heard, towards=t)
