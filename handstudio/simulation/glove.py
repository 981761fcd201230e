"""A glove on a hand that performs: its twenty sensors' readings, as long as anyone asks."""

from __future__ import annotations

import numpy as np
from jaxtyping import Int64

from handstudio.arrays import Array
from handstudio.hand.skeleton import ADULT_HAND_LENGTH_M, HandSide
from handstudio.layout import glove
from handstudio.protocol.codec import VERSION
from handstudio.protocol.packets import Description
from handstudio.samples import STANDARD_GRAVITY
from handstudio.simulation.imperfections import MPU9250, Readings, read, switched_on
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject
from handstudio.simulation.trajectory import Trajectory

SENSORS = tuple(range(1, 21))
MAX_RATE_HZ = 1000


class WornGlove:
    """Readings of the glove's sensors during a motion; a seed is one glove.

    Instants may be asked for in pieces of any size; the noise goes on from piece to piece.
    """

    def __init__(
        self,
        side: HandSide = "right",
        seed: int = 0,
        hand_length_m: float = ADULT_HAND_LENGTH_M,
        trajectory: Trajectory | None = None,
    ) -> None:
        self._layout = glove(side)
        self._subject = ideal_subject(side, hand_length_m)
        self._trajectory = showcase(side) if trajectory is None else trajectory
        self._seed = seed
        self._state = switched_on(len(self._layout.sensors))

    def read(self, time_us: Int64[Array, " n"], rate_hz: int) -> Readings:
        """Read the next instants, given in time since the motion began [µs]."""
        exact, _ = signals(self._subject, self._layout, self._trajectory, time_us)
        readings, self._state = read(MPU9250, self._seed, rate_hz, self._state, exact)
        return readings


def description(side: HandSide, seed: int, rate_hz: int, epoch: int, name: str) -> Description:
    """How such a glove describes itself."""
    ranges = MPU9250.ranges
    return Description(
        protocol=VERSION,
        epoch=epoch,
        name=name,
        serial_number=f"VG-{seed}",
        firmware="virtual 1",
        side=side,
        sensors=SENSORS,
        rate_hz=rate_hz,
        max_rate_hz=MAX_RATE_HZ,
        magnetometer_rate_hz=MPU9250.mag_rate_hz,
        accelerometer_range_g=ranges.acc / STANDARD_GRAVITY,
        gyroscope_range_dps=float(np.rad2deg(ranges.gyr)),
        magnetometer_range_ut=ranges.mag,
    )
