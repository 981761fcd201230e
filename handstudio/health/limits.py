"""Where good ends: every number with its reason.

Data sheet: InvenSense PS-MPU-9250A-01 rev. 1.0, tables 1 and 2, the glove's sensor. VQF: Laidig
and Seel, Information Fusion 91 (2023) 187, with its authors' defaults.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handstudio.health.findings import Kind
from handstudio.samples import STANDARD_GRAVITY

WINDOW_S = 0.5
"""What is judged at a time: as long as the rest that places a sensor, and twice a second."""

LEAST_INSTANTS = 20
"""In a window: fewer tell nothing of noise or shares. Slow devices get longer windows."""

RECENT_WINDOWS = 10
"""Shares and spreads of a stream are over 5 s: at 100 Hz one lost instant is then 0.2 %."""

OFF_S = 2.0
"""Well for so long before a finding goes: a person must have time to read it."""

KEEP = 0.8
"""A finding that is on stays while its value is above this share of its limit."""


@dataclass(frozen=True, slots=True)
class Limit:
    """Beyond ``note`` or ``act`` something is wrong, after ``hold`` windows in a row."""

    note: float
    act: float
    hold: int = 1


NEVER = float("inf")

LIMITS: dict[Kind, Limit] = {
    # Single instants are bridged without harm. One in a hundred is where the page always warned:
    # gaps then come every second at 100 Hz and reach into every gesture.
    Kind.LOSS: Limit(0.1, 1.0),
    # A sound cable damages nothing in hours, so any damage is worth a word; from one in a hundred
    # it costs what loss costs.
    Kind.DAMAGED: Limit(0.0, 1.0),
    Kind.DROPPED: Limit(0.0, 1.0),
    Kind.RESTARTED: Limit(0.0, NEVER),
    # A microcontroller's crystal keeps 0.01 %, the sensor's own clock 1 %; twice that is not a
    # tolerance any more. Speeds are wrong by as much; at 10 % so is what a clinician reads.
    Kind.RATE: Limit(2.0, 10.0, hold=2),
    # The protocol asks devices for 50 ms of buffer: beyond it instants begin to be dropped. A
    # quarter of a second is as long as a gap that can be bridged.
    Kind.JITTER: Limit(50.0, 250.0, hold=2),
    # The target is 10 ms; 100 ms is where a hand is seen to follow late, half of it is a warning.
    Kind.LATE: Limit(50.0, 100.0, hold=2),
    # Two poor crystals differ by 200 ppm; 500 ppm are 1.8 s in an hour.
    Kind.DRIFT: Limit(500.0, NEVER, hold=4),
    # A hiccup on a bus now and then is held over; half of the instants gone is no sensor.
    Kind.SILENT: Limit(1.0, 50.0),
    # At rest a sensor of the data sheet moves by 0.8 (gyroscope) and 10 counts (accelerometer)
    # at 100 Hz: six axes that stay for half a second do not happen. The last step of a window is
    # in the next one, hence a little less.
    Kind.STUCK: Limit(0.45, 0.45),
    # One instant at the limit is an angle of unknown size lost; a twentieth is a range too small.
    Kind.SATURATED: Limit(0.0, 5.0),
    # Real units of one kind differ by a quarter (12 and 20 units), mounting and supply by less
    # than two; 3 is a fault, and at 10 the attitude at rest is wrong by degrees.
    Kind.NOISY: Limit(3.0, 10.0, hold=4),
    # VQF sets readings aside beyond 10 % in size or 10 deg in dip, which is 17 %; between them,
    # as a window's mean has less noise than its readings. At 40 % heading can be anything.
    Kind.MAGNETIC: Limit(15.0, 40.0, hold=2),
    # Data sheet: zero of the gyroscope +-30 deg/s over 125 degrees, up to 0.24 deg/s a degree.
    # 5 degrees may be 1.2 deg/s, as much as the bias of a new sensor.
    Kind.WARMED: Limit(5.0, NEVER),
}

TYPICAL_GYR_DENSITY = float(np.deg2rad(0.01))
"""White noise of the data sheet's gyroscope [rad/s/sqrt(Hz)]."""
TYPICAL_ACC_DENSITY = 300e-6 * STANDARD_GRAVITY
"""The same of its accelerometer [m/s²/sqrt(Hz)]."""

STILL_GYR = float(np.deg2rad(3.0))
"""Peak to peak within a window [rad/s], noise apart: as in `calibration.rest`."""
STILL_ACC = 1.0
"""The same of the accelerometer [m/s²]."""
STILL_NOISE = 10.0
"""Peak to peak of white noise, in standard deviations: 8.5 over 500 instants and 3 axes, and a
little more."""
STILL_SHARE = 0.8
"""So many of the sensors must be still for the hand to count as resting: a broken one may not
forbid to judge the others."""

DRIFT_BINS = 30
"""Seconds of arrivals before drift is judged: uneven delays of 5 ms look like 100 ppm then."""

FIELD_LEAST = 5
"""Compass readings a window's mean needs: 0.6 µT of one become 0.6 % of the Earth's 45 µT."""
FIELD_PEERS = 3
"""With so many compasses or more the first idea of the field is their median."""
FIELD_TAU_S = 60.0
"""How fast a sensor's own field is followed while it is undisturbed: a room changes slowly."""
FIELD_TAU_DISTURBED_S = 600.0
"""While it is disturbed: somebody who moved to another room gets used to it within minutes."""

EPISODES = 200
"""Kept in a take; the rest is counted. A bad hour has no use for more, and a take stays small."""
