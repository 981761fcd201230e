"""A motion beside the one that is shown: by another filter, smoothed, or of another take."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.hand_fit import HandFit, fit_of
from handstudio.pipeline import Motion
from handstudio.setup import Setup, filter_named, smoothing

SMOOTHED = "smoothed"
"""What a comparison is called that is with the smoothed take; others are names of filters."""


OF_TAKE = "take:"
"""Begins what a comparison is called that is with another take; its path follows."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """The second motion.

    Attributes:
        name: Of the filter, or `SMOOTHED`, or what the other take is asked for by.
        setup: What it was computed by.
        motion: It.
        time_s: Its time axis, from its first instant.
        fit: Its hand, where there is one.
        take: Name of the other take; empty: it is the same one.
        later_s: How much later than the first take's the other's begin is laid.
    """

    name: str
    setup: Setup
    motion: Motion
    time_s: Float[Array, " n"]
    fit: HandFit | None
    take: str = ""
    later_s: float = 0.0

    def at(self, at_s: float) -> Motion:
        """The instant at a time of the take."""
        index = int(nearest(self.time_s, np.array([at_s - self.later_s]))[0])
        return self.motion[index : index + 1]


def setup_of(name: str, own: Setup) -> Setup:
    """What to compute a take by whose own setup this is.

    Raises:
        SetupError: no filter is called so.
    """
    if name == SMOOTHED:
        return smoothing(own)
    chosen = filter_named(name)
    kept = own.filter if isinstance(own.filter, type(chosen)) else chosen
    return msgspec.structs.replace(own, filter=kept, smooth=False)


def compared(name: str, setup: Setup, motion: Motion, take: str = "") -> Comparison:
    """A second motion beside the one that is shown; ``take`` names the other take, if it is one."""
    fit = fit_of(setup) if setup.layout.is_hand else None
    return Comparison(name, setup, motion, seconds_of(motion), fit, take)


def seconds_of(motion: Motion) -> Float[Array, " n"]:
    """Time from the first instant [s]."""
    return np.asarray((motion.time_us - motion.time_us[0]) * 1e-6)


def nearest(time_s: Float[Array, " n"], wanted_s: Float[Array, " m"]) -> Int64[Array, " m"]:
    """The instants that are nearest to some times."""
    after = np.clip(np.searchsorted(time_s, wanted_s), 1, max(len(time_s) - 1, 1))
    late = wanted_s - time_s[after - 1] > time_s[np.minimum(after, len(time_s) - 1)] - wanted_s
    return np.minimum(np.where(late, after, after - 1), len(time_s) - 1)
