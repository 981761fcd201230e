"""A glove on a person in a room: what its sensors read while the person moves.

Everything but the motion is decided once (`wear`); `sense` then reads the instants of a motion, in
pieces of any size, and hands the state on. Cutting the instants elsewhere changes no digit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int16, Int64

from handstudio.arrays import Array
from handstudio.layout import Layout
from handstudio.samples import FULL_SCALE, ImuSamples
from handstudio.simulation.disturbed import disturbed
from handstudio.simulation.imperfections.drawn import WARM_CELSIUS, WARM_UP_S, Drawn, draw
from handstudio.simulation.imperfections.dying import answering, outages
from handstudio.simulation.imperfections.noise import normals
from handstudio.simulation.imperfections.readout import MPU9250
from handstudio.simulation.imperfections.strengths import Imperfections
from handstudio.simulation.imperfections.timing import (
    Timing,
    step_back_s,
    timing_of,
    true_time_s,
)
from handstudio.simulation.mounting import Mounting, donned, nominal_mounting, segment_indices
from handstudio.simulation.moving import Moving, picked, planes_first, vectors_last
from handstudio.simulation.rig import Felt, Truth, feel, hand_at, truth_of
from handstudio.simulation.skin import Skin, Wobble, on_skin, settled, skin_of
from handstudio.simulation.subject import Subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.world import World


@dataclass(frozen=True, slots=True, eq=False)
class Worn:
    """A glove on a person in a room: everything but the motion.

    Attributes:
        world: With what disturbs it.
        mounting: With what donning made of it, at rest at the flat hand.
        drawn: Errors of the sensors.
        timing: When they are read.
        skin: How they move on their segments.
        dying: Which sensor is silent when [s].
    """

    subject: Subject
    layout: Layout
    world: World
    mounting: Mounting
    imperfections: Imperfections
    seed: int
    drawn: Drawn
    timing: Timing
    skin: Skin
    dying: tuple[int, Float[Array, "o 2"]]


@dataclass(frozen=True, slots=True, eq=False)
class WornState:
    """Where a stream stands.

    Attributes:
        index: Instants read so far.
        last_us: Stamp of the last; None before the first.
        walk: Where the biases have walked to [m/s²], [rad/s].
        reading: Number of the magnetometer's last reading; -1 before the first.
        mag: What it read [µT].
        wobble: How the boards swing.
    """

    index: int
    last_us: int | None
    walk: Float[Array, "s 6"]
    reading: int
    mag: Float[Array, "s 3"]
    wobble: Wobble


@dataclass(frozen=True, slots=True, eq=False)
class Sensed:
    """Instants of all sensors.

    Attributes:
        counts: Accelerometer, gyroscope, magnetometer; x y z each, as the wire has them.
        samples: In SI: what a host decodes from the counts; where quantisation is off, what was
            read before counting.
        fresh: The magnetometer's reading is new.
        answering: The sensor gave a reading; where it did not, counts are 0.
        celsius: Temperature of every sensor.
        time_s: True instant of every stamp [s].
        worn: Whose these are.
        segments: Where the segments were then.
        sensors: Where the sensors were, none of them late.
    """

    counts: Int16[Array, "n s 9"]
    samples: ImuSamples
    fresh: Bool[Array, "n s"]
    answering: Bool[Array, "n s"]
    celsius: Float[Array, "n s"]
    time_s: Float[Array, " n"]
    worn: Worn
    segments: Moving
    sensors: Moving

    @property
    def truth(self) -> Truth:
        """What was true at the true instant of every stamp; computed anew whenever asked for."""
        return truth_of(
            self.worn.subject, self.samples.time_us, self.segments, self.sensors, self.worn.world
        )


def wear(
    subject: Subject,
    layout: Layout,
    imperfections: Imperfections,
    seed: int,
    *,
    world: World | None = None,
    nominal: Mounting | None = None,
    occasion: int = 0,
) -> Worn:
    """Put a glove on: a seed is one glove and one room.

    An occasion is one donning and switching on of it: other occasions have other tilts and turn-on
    biases, and the same sensors, skin and room. Strengths scale errors and draw no others.
    ``nominal`` is how the maker means the sensors to sit, `nominal_mounting` unless given.

    Raises:
        LayoutError: a sensor sits on something that is not a segment of the hand.
    """
    on = tuple(segment_indices(layout))
    nominal = nominal_mounting(layout, subject.skeleton) if nominal is None else nominal
    donning = seed + (occasion << 32)
    mounting = donned(nominal, donning, subject.side, imperfections.mounting)
    return Worn(
        subject=subject,
        layout=layout,
        world=disturbed(World() if world is None else world, imperfections, seed),
        mounting=mounting,
        imperfections=imperfections,
        seed=seed,
        drawn=draw(imperfections, len(on), seed, occasion),
        timing=timing_of(imperfections, len(on), seed),
        skin=skin_of(imperfections, subject.skeleton, mounting, on, seed=seed, occasion=occasion),
        dying=outages(imperfections.dying_sensor, len(on), seed),
    )


def begin(worn: Worn) -> WornState:
    """The state before the first instant: switched on just now, boards hanging still."""
    s = len(worn.layout.sensors)
    return WornState(0, None, np.zeros((s, 6)), -1, np.zeros((s, 3)), settled(worn.skin))


def sense(
    worn: Worn,
    state: WornState,
    trajectory: Trajectory,
    time_us: Int64[Array, " n"],
    rate_hz: int,
) -> tuple[Sensed, WornState]:
    """Read consecutive instants, at least one, that follow those already read.

    Args:
        worn: Who wears what.
        state: Where the stream stands.
        trajectory: The motion; another one may follow where the first comes to rest.
        time_us: Stamps: the device's clock since the motion began.
        rate_hz: How often the device reads: the bandwidth of the noise.
    """
    time_s = true_time_s(worn.timing, state.index, time_us, rate_hz)
    felt, segments, sensors, wobble = _felt(worn, state.wobble, trajectory, time_s, rate_hz)
    kelvin = -worn.drawn.warm_up * np.exp(time_us * -1e-6 / WARM_UP_S)[:, None]
    noise = _noise(worn, state.index, len(time_us))
    walk = _walk(worn, state, time_us)
    white = np.sqrt(rate_hz) * noise[:6]  # of a density Q of 1, sampled so often
    inertial = _inertial(worn.drawn, felt, kelvin, walk, white)
    value = np.concatenate([inertial, _magnetic(worn, felt, noise)])
    reading, new = _readings(worn.imperfections.mag_hold, state.reading, time_us)
    mag = _held(vectors_last(value[6:]), new, state.mag)
    value[6:] = planes_first(mag)
    heard = answering(value.shape[2], worn.dying, time_us)
    counts, samples = _counted(worn.imperfections, value, time_us, heard & new[:, None], heard)
    sensed = Sensed(
        counts=counts,
        samples=samples,
        fresh=samples.fresh,
        answering=heard,
        celsius=WARM_CELSIUS + kelvin,
        time_s=time_s,
        worn=worn,
        segments=segments,
        sensors=sensors,
    )
    index = state.index + len(time_us)
    return sensed, WornState(index, int(time_us[-1]), walk[-1], reading, mag[-1], wobble)


_WHITE, _WALK = 30, 31  # which of a seed's streams


def _felt(
    worn: Worn, wobble: Wobble, trajectory: Trajectory, time_s: Array, rate_hz: int
) -> tuple[Felt, Moving, Moving, Wobble]:
    """What every sensor feels at its own instant; segments and sensors at those of the stamps.

    A reading's age of up to 1 ms is taken off along the straight line through the stamp's instant
    and one a little before: off by at most 1e-6 s² / 8 of the signal's second derivative, and at
    1000 Hz, where the line is half as long, three times that. For a hand that swings at 3 Hz with
    500 deg/s that is 0.02 deg/s.
    """
    back_s = step_back_s(worn.timing, rate_hz)
    grid_s = (time_s[:, None] - [back_s, 0.0]).ravel() if back_s else time_s
    joints, segments = hand_at(worn.subject, trajectory, grid_s, worn.world)
    beneath = picked(segments, list(worn.skin.on))
    if worn.skin.is_rigid:
        mounting = worn.mounting
        sensors = beneath.carrying(mounting.q_segment_sensor, mounting.t_segment_sensor)
    else:
        sensors, wobble = on_skin(worn.skin, wobble, grid_s, joints, beneath)
    felt = feel(sensors, worn.world)
    if not back_s:
        return felt, segments, sensors, wobble
    share = (worn.timing.age_s / back_s)[:, None]
    at_own = [
        now + share * (before - now)
        for before, now in ((x[0::2], x[1::2]) for x in (felt.gyr, felt.acc, felt.mag))
    ]
    return Felt(*at_own), segments[1::2], sensors[1::2], wobble


def _noise(worn: Worn, first: int, n: int) -> Array:
    """Standard normals, (9, n, s): accelerometer, gyroscope, magnetometer."""
    s = len(worn.layout.sensors)
    if not (worn.drawn.noise.any() or worn.drawn.mag_noise):
        return np.zeros((9, n, s))
    return planes_first(normals(worn.seed, _WHITE, first, n, (s, 9)))


def _walk(worn: Worn, state: WornState, time_us: Array) -> Array:
    """Where the biases are, (n, s, 6): steps of ``K sqrt(dt)``."""
    n, (s, _) = len(time_us), worn.drawn.walk.shape
    if not worn.drawn.walk.any():
        return np.zeros((n, s, 6))
    before_us = time_us[0] if state.last_us is None else state.last_us
    root = np.sqrt(np.diff(time_us, prepend=before_us) * 1e-6)[:, None, None]
    steps = root * worn.drawn.walk * normals(worn.seed, _WALK, state.index, n, (s, 6))
    # the sum runs on from the state, so that it rounds the same however it is cut
    walk: Array = np.cumsum(np.concatenate([state.walk[None], steps]), axis=0)[1:]
    return walk


def _inertial(drawn: Drawn, felt: Felt, kelvin: Array, walk: Array, white: Array) -> Array:
    """Accelerometer and gyroscope, (6, n, s); white noise of a density of 1 comes in."""
    out = _mixed(drawn.inertial, [*_planes(felt.acc), *_planes(felt.gyr)])
    for i in range(6):
        out[i] += drawn.bias[:, i]
        out[i] += drawn.per_kelvin[:, i] * kelvin
        out[i] += walk[..., i]
        out[i] += drawn.noise[:, i] * white[i]
    return out


def _magnetic(worn: Worn, felt: Felt, noise: Array) -> Array:
    """Magnetometer, (3, n, s), as if it read at every instant."""
    out = _mixed(worn.drawn.magnetic, _planes(felt.mag))
    for i in range(3):
        out[i] += worn.drawn.hard_iron[:, i]
        out[i] += worn.drawn.mag_noise * noise[6 + i]
    return out


def _planes(vectors: Array) -> list[Array]:
    return list(planes_first(vectors))


def _mixed(matrix: Array, planes: list[Array]) -> Array:
    """Every sensor's own matrix times what it feels, (i, n, s)."""
    # not ``@``: its digits depend on how many instants are asked for at once
    out = np.empty((len(planes), *planes[0].shape))
    for i in range(len(planes)):
        np.multiply(matrix[:, i, i], planes[i], out=out[i])
        for j, plane in enumerate(planes):
            if j != i and matrix[:, i, j].any():
                out[i] += matrix[:, i, j] * plane
    return out


def _readings(hold: float, last: int, time_us: Array) -> tuple[int, Array]:
    """Number of the magnetometer's last reading, and at which instants there is a new one."""
    if not hold:
        return last, np.ones(len(time_us), dtype=bool)
    reading = np.floor(time_us * (MPU9250.mag_rate_hz / hold) / 1e6).astype(np.int64)
    return int(reading[-1]), np.diff(reading, prepend=last) != 0


def _held(mag: Array, new: Array, before: Array) -> Array:
    """Repeat each new reading until the next; ``before`` until the first."""
    held: Array = np.concatenate([before[None], mag[new]])[np.cumsum(new)]
    return held


def _counted(
    what: Imperfections, value: Array, time_us: Array, fresh: Array, heard: Array
) -> tuple[Array, ImuSamples]:
    """Counts, and what a host makes of them."""
    ranges = MPU9250.ranges
    full = np.repeat([ranges.acc, ranges.gyr, ranges.mag], 3)
    si = np.ascontiguousarray(vectors_last(value))
    saturated: Array = np.zeros(heard.shape, dtype=bool)
    if what.saturation:
        limit = full / what.saturation
        highest = limit * (1.0 - 1.0 / FULL_SCALE)
        saturated = np.asarray(((si <= -limit) | (si >= highest))[..., :6].any(axis=-1))
        si = np.clip(si, -limit, highest)
    step = what.quantisation or 1.0
    steps = step * np.rint(si * (FULL_SCALE / full / step))
    counts = np.clip(steps, -FULL_SCALE, FULL_SCALE - 1).astype(np.int16)
    counts[~heard] = 0
    if what.quantisation:
        si = counts / FULL_SCALE * full
        inertial = counts[..., :6]
        at_limit = (inertial <= -FULL_SCALE + 1) | (inertial >= FULL_SCALE - 1)
        saturated = np.asarray(at_limit.any(axis=-1))
    else:
        si[~heard] = 0.0
    return counts, ImuSamples(
        time_us=time_us,
        gyr=si[..., 3:6],
        acc=si[..., 0:3],
        mag=si[..., 6:9],
        fresh=fresh,
        valid=heard,
        saturated=saturated & heard,
    )
