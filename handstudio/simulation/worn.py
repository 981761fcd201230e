"""A glove on a person in a room: what its sensors read while the person moves.

Everything but the motion is decided once (`wear`); `sense` then reads the instants of a motion, in
pieces of any size, and hands the state on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int16, Int64

from handstudio.arrays import Array
from handstudio.layout import Layout
from handstudio.samples import FULL_SCALE, ImuSamples
from handstudio.simulation.imperfections.drawn import WARM_CELSIUS, Drawn, draw
from handstudio.simulation.imperfections.noise import normals
from handstudio.simulation.imperfections.readout import MPU9250
from handstudio.simulation.imperfections.strengths import Imperfections
from handstudio.simulation.mounting import Mounting, donned, nominal_mounting, segment_indices
from handstudio.simulation.moving import Moving
from handstudio.simulation.rig import Truth, feel, hand_at, truth_of
from handstudio.simulation.subject import Subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.world import World


@dataclass(frozen=True, slots=True, eq=False)
class Worn:
    """A glove on a person in a room: everything but the motion.

    Attributes:
        world: With what disturbs it.
        mounting: With what donning made of it.
        drawn: Errors of the sensors.
        on: Index of every sensor's segment.
    """

    subject: Subject
    layout: Layout
    world: World
    mounting: Mounting
    imperfections: Imperfections
    seed: int
    drawn: Drawn
    on: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class WornState:
    """Where a stream stands.

    Attributes:
        index: Instants read so far.
        reading: Number of the magnetometer's last reading; -1 before the first.
        mag: What it read [µT].
    """

    index: int
    reading: int
    mag: Float[Array, "s 3"]


@dataclass(frozen=True, slots=True, eq=False)
class Sensed:
    """Instants of all sensors.

    Attributes:
        counts: Accelerometer, gyroscope, magnetometer; x y z each, as the wire has them.
        samples: In SI: what a host decodes from the counts; where quantisation is off, what was
            read before counting.
        fresh: The magnetometer's reading is new.
        answering: The sensor gave a reading.
        celsius: Temperature of every sensor.
    """

    counts: Int16[Array, "n s 9"]
    samples: ImuSamples
    fresh: Bool[Array, "n s"]
    answering: Bool[Array, "n s"]
    celsius: Float[Array, "n s"]
    worn: Worn
    segments: Moving
    sensors: Moving

    @property
    def truth(self) -> Truth:
        """What was true when the sensors were read; computed anew whenever asked for."""
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
) -> Worn:
    """Put a glove on: a seed is one glove, one donning and one room.

    Raises:
        LayoutError: a sensor sits on something that is not a segment of the hand.
    """
    nominal = nominal_mounting(layout, subject.skeleton)
    return Worn(
        subject=subject,
        layout=layout,
        world=World() if world is None else world,
        mounting=donned(nominal, seed, subject.side, imperfections.mounting),
        imperfections=imperfections,
        seed=seed,
        drawn=draw(imperfections, len(layout.sensors), seed),
        on=tuple(segment_indices(layout)),
    )


def begin(worn: Worn) -> WornState:
    """The state before the first instant."""
    return WornState(0, -1, np.zeros((len(worn.on), 3)))


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
        trajectory: The motion.
        time_us: Stamps: the device's clock since the motion began.
        rate_hz: How often the device reads: the noise's bandwidth.
    """
    _, segments = hand_at(worn.subject, trajectory, time_us * 1e-6, worn.world)
    sensors = segments[:, list(worn.on)].carrying(
        worn.mounting.q_segment_sensor, worn.mounting.t_segment_sensor
    )
    felt = feel(sensors, worn.world)
    n, s = felt.gyr.shape[:2]
    drawn, ranges = worn.drawn, MPU9250.ranges
    white = normals(worn.seed, _WHITE, state.index, n, (s, 9))
    band = np.sqrt(rate_hz)
    inertial = np.concatenate([felt.acc, felt.gyr], axis=-1)
    inertial = inertial + drawn.bias + band * drawn.noise * white[..., :6]
    mag = felt.mag + drawn.mag_noise * white[..., 6:]
    reading = time_us * MPU9250.mag_rate_hz // 1_000_000
    new = np.diff(reading, prepend=state.reading) != 0
    mag = np.concatenate([state.mag[None], mag[new]])[np.cumsum(new)]
    fresh = np.repeat(new[:, None], s, axis=1)
    answering = np.ones((n, s), dtype=bool)
    limits = np.repeat([ranges.acc, ranges.gyr, ranges.mag], 3)
    value = np.concatenate([inertial, mag], axis=-1)
    steps = np.rint(value * (FULL_SCALE / limits))
    counts = np.clip(steps, -FULL_SCALE, FULL_SCALE - 1).astype(np.int16)
    if worn.imperfections.quantisation:
        value = counts / FULL_SCALE * limits
    at_limit = (counts[..., :6] <= -FULL_SCALE + 1) | (counts[..., :6] >= FULL_SCALE - 1)
    samples = ImuSamples(
        time_us,
        gyr=value[..., 3:6],
        acc=value[..., 0:3],
        mag=value[..., 6:9],
        fresh=fresh,
        valid=answering,
        saturated=np.asarray(at_limit.any(axis=-1)),
    )
    celsius = np.full((n, s), WARM_CELSIUS)
    sensed = Sensed(counts, samples, fresh, answering, celsius, worn, segments, sensors)
    return sensed, WornState(state.index + n, int(reading[-1]), mag[-1])


_WHITE = 30  # which of a seed's streams
