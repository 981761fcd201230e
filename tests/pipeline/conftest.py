"""A short performance of a few sensors that read as real ones do, and its truth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from handstudio.hand.skeleton import FINGERS
from handstudio.layout import glove
from handstudio.samples import FULL_SCALE, ImuSamples
from handstudio.setup import Setup
from handstudio.simulation.imperfections import MPU9250, read, switched_on
from handstudio.simulation.postures import Script, scripted
from handstudio.simulation.rig import Truth, signals
from handstudio.simulation.subject import ideal_subject

RATE_HZ = 100.0
PERIOD_US = 10_000
SENSORS = ("SN1", "SN11", "SN15", "SN16")

_FIST = {f"{finger}_{joint}_flexion": 80.0 for finger in FINGERS[1:] for joint in ("mcp", "pip")}
_UP = {"elbow_flexion": 40.0, "wrist_flexion": 30.0, "forearm_pronation": -40.0}
_SCRIPT: Script = [
    (1.2, {}),  # at rest
    (0.7, _FIST | _UP),
    (0.2, _FIST | _UP),
    (0.7, {}),
    (0.7, _FIST | _UP),  # no rest long enough until here
    (1.5, _FIST | _UP),
    (0.7, {}),
    (1.3, {}),
]


@dataclass(frozen=True, repr=False)
class Performance:
    """What the sensors read, and what was true."""

    setup: Setup
    samples: ImuSamples
    truth: Truth


@pytest.fixture(scope="session")
def performance() -> Performance:
    """Seven seconds of `SENSORS`: rest until 1.2 s, from 3.5 to 5.0 s, and at the end."""
    return _performed(None)


@pytest.fixture(scope="session")
def perfect() -> Performance:
    """The same, read by sensors without any error."""
    return _performed(0)


def _performed(errors: int | None) -> Performance:
    layout, subject = glove("right", SENSORS), ideal_subject("right")
    time_us = np.arange(0, 7_000_000, PERIOD_US)
    exact, truth = signals(subject, layout, scripted(_SCRIPT, "right"), time_us)
    setup = Setup(layout, RATE_HZ, magnetometer_rate_hz=100.0)
    if errors == 0:
        return Performance(setup, exact, truth)
    readings, _ = read(MPU9250, 2, round(RATE_HZ), switched_on(len(SENSORS)), exact)
    si, ranges = readings.counts / FULL_SCALE, MPU9250.ranges
    samples = replace(
        exact,
        acc=si[..., 0:3] * ranges.acc,
        gyr=si[..., 3:6] * ranges.gyr,
        mag=si[..., 6:9] * ranges.mag,
        fresh=readings.fresh,
    )
    return Performance(setup, samples, truth)


_ALL = ImuSamples.__slots__


@pytest.fixture(scope="session")
def without() -> Callable[[ImuSamples, int, int], ImuSamples]:
    """``without(samples, first, last)``: those instants were lost."""

    def lose(samples: ImuSamples, first: int, last: int) -> ImuSamples:
        parts = (
            [getattr(part, name) for part in (samples[:first], samples[last:])] for name in _ALL
        )
        return ImuSamples(*map(np.concatenate, parts))

    return lose
