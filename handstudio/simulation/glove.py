"""A glove on a person who performs: its sensors' readings, as long as anyone asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Int64

from handstudio.arrays import Array
from handstudio.hand.skeleton import HandSide
from handstudio.layout import glove
from handstudio.protocol.codec import VERSION
from handstudio.protocol.packets import Description
from handstudio.samples import STANDARD_GRAVITY
from handstudio.simulation.firmware import Readings
from handstudio.simulation.imperfections.readout import MPU9250
from handstudio.simulation.imperfections.strengths import PLAIN, Imperfections
from handstudio.simulation.line import LineState, line_of, passed
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.moving import Moving
from handstudio.simulation.subject import Subject, ideal_subject
from handstudio.simulation.trajectory import Trajectory, turned_to
from handstudio.simulation.worn import Worn, begin, sense, wear

SENSORS = tuple(range(1, 21))
MAX_RATE_HZ = 1000


class Wire:
    """The way of a device's frames to the host, lossy as the imperfections have it."""

    def __init__(self, imperfections: Imperfections, seed: int) -> None:
        self._line, self._state = line_of(imperfections, seed), LineState()

    def carry(self, frame: bytes) -> bytes:
        """What arrives of a frame."""
        arrived, self._state = passed(self._line, self._state, [frame])
        return b"".join(arrived)


class WornGlove:
    """What a glove's sensors read while its wearer performs.

    Instants may be asked for in pieces of any size; whatever drifts goes on from piece to piece.
    When time begins anew at 0, so does the motion.
    """

    def __init__(self, worn: Worn, motion: Trajectory) -> None:
        self._worn, self._first = worn, motion
        self._state = begin(worn)
        self._motion = motion
        self._asked: Trajectory | None = None
        self._witness: Callable[[Int64[Array, " n"], Moving], None] = lambda _us, _sensors: None
        self._next_us, self._began_us = 0, 0  # on the time axis that never begins anew

    def turn_to(self, motion: Trajectory) -> None:
        """Perform something else from the next instants on. May be called from another thread."""
        self._asked = motion

    def watched_by(self, witness: Callable[[Int64[Array, " n"], Moving], None]) -> None:
        """Tell somebody beside where the sensors were at the instants that are read."""
        self._witness = witness

    def read(self, time_us: Int64[Array, " n"], rate_hz: int) -> Readings:
        """Read the next instants, given in time since the motion began [µs]."""
        if self._began_us + time_us[0] < self._next_us:
            self._began_us = self._next_us - int(time_us[0])
            self._motion = replace(self._first, begins_s=self._began_us * 1e-6)
        ours_us = time_us + self._began_us
        asked, self._asked = self._asked, None
        if asked is not None:
            self._motion = turned_to(self._motion, float(ours_us[0]) * 1e-6, asked)
        sensed, self._state = sense(self._worn, self._state, self._motion, ours_us, rate_hz)
        self._next_us = int(ours_us[-1]) + 1
        self._witness(time_us, sensed.sensors)
        return Readings(sensed.counts, sensed.fresh, sensed.answering, sensed.celsius[-1])


def plain_glove(
    side: HandSide = "right",
    seed: int = 0,
    motion: Trajectory | None = None,
    *,
    subject: Subject | None = None,
    imperfections: Imperfections = PLAIN,
) -> WornGlove:
    """A glove on the ideal hand with nothing but noise and bias, in the showcase unless told."""
    someone = ideal_subject(side) if subject is None else subject
    worn = wear(someone, glove(side), imperfections, seed)
    return WornGlove(worn, showcase(side) if motion is None else motion)


def description(side: HandSide, seed: int, rate_hz: int, epoch: int, name: str) -> Description:
    """How such a glove describes itself."""
    ranges = MPU9250.ranges
    return Description(
        protocol=VERSION,
        epoch=epoch,
        name=name,
        serial_number=f"VG-{seed}",
        firmware="virtual 2",
        side=side,
        sensors=SENSORS,
        rate_hz=rate_hz,
        max_rate_hz=MAX_RATE_HZ,
        magnetometer_rate_hz=MPU9250.mag_rate_hz,
        accelerometer_range_g=ranges.acc / STANDARD_GRAVITY,
        gyroscope_range_dps=float(np.rad2deg(ranges.gyr)),
        magnetometer_range_ut=ranges.mag,
    )
