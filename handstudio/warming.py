"""Compiling the whole-hand filter before anybody waits for it; what is compiled is kept on disk.

Compiled code fits the kinds of arrays it is given, so this takes the way of a live stream, and of
a recorded take that is smoothed.
"""

from __future__ import annotations

import numpy as np

from handstudio import pipeline
from handstudio.fusion.tree_filter import TreeFilter
from handstudio.layout import glove
from handstudio.samples import STANDARD_GRAVITY, ImuSamples
from handstudio.setup import Setup, smoothing
from handstudio.smoothing import Smoother

_INSTANTS = 3
_RATE_HZ = 100.0


def warm() -> None:
    """Compile filter and smoother, or load what was compiled; takes seconds to a minute."""
    setup = Setup(glove(), _RATE_HZ, filter=TreeFilter())
    samples = _at_rest(len(setup.layout.sensors))
    pipeline.run(setup, pipeline.begin(setup), [samples])
    smooth = smoothing(setup)
    smoother = Smoother(smooth)
    smoother.run(pipeline.begin(smooth), [samples])
    smoother.rest()


def _at_rest(sensors: int) -> ImuSamples:
    still = np.zeros((_INSTANTS, sensors, 3))
    yes, no = (np.full((_INSTANTS, sensors), value) for value in (True, False))
    return ImuSamples(
        time_us=(np.arange(_INSTANTS) * (1e6 / _RATE_HZ)).astype(np.int64),
        gyr=still,
        acc=still + np.array([0.0, 0.0, STANDARD_GRAVITY]),
        mag=still + np.array([30.0, 0.0, -30.0]),
        fresh=yes,
        valid=yes,
        saturated=no,
    )
