"""A take's motion beside the one that is shown: by another filter, or smoothed."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from jaxtyping import Float

from app.channels import values_of
from handstudio.arrays import Array
from handstudio.hand_fit import HandFit, fit_of
from handstudio.pipeline import Doubt, Motion
from handstudio.setup import Setup, filter_named, smoothing

SMOOTHED = "smoothed"
"""What a comparison is called that is with the smoothed take; others are names of filters."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """The second motion, and how far it is from the first.

    Attributes:
        name: Of the filter, or `SMOOTHED`.
        setup: What it was computed by.
        motion: It.
        time_s: Its time axis, from its first instant.
        fit: Its hand, where there is one.
        values: Its curves at the instants that are plotted [deg].
        rms_deg: Of each curve's difference, over the plotted instants at which every sensor was
            placed in both; NaN where there are none.
    """

    name: str
    setup: Setup
    motion: Motion
    time_s: Float[Array, " n"]
    fit: HandFit | None
    values: Float[Array, "p c"]
    rms_deg: Float[Array, " c"]

    def at(self, at_s: float) -> Motion:
        """The instant at a time of the take."""
        index = int(_nearest(self.time_s, np.array([at_s]))[0])
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


def compared(
    name: str, setup: Setup, motion: Motion, first: Motion, values: Float[Array, "p c"]
) -> Comparison:
    """A second motion beside a first, of which the plotted instants and their curves are given."""
    time_s, wanted_s = seconds_of(motion), seconds_of(first)
    second = picked(motion, _nearest(time_s, wanted_s))
    mine = values_of(setup, second)
    placed = ((first.doubt | second.doubt) & np.uint8(Doubt.UNPLACED) == 0).all(axis=1)
    off = (mine - values + 180.0) % 360.0 - 180.0  # a turn more is no difference
    rms = np.full(values.shape[1], np.nan)
    if placed.any():
        rms = np.sqrt(np.mean(np.square(off[placed]), axis=0))
    fit = fit_of(setup) if setup.layout.is_hand else None
    return Comparison(name, setup, motion, time_s, fit, mine, rms)


def seconds_of(motion: Motion) -> Float[Array, " n"]:
    """Time from the first instant [s]."""
    return np.asarray((motion.time_us - motion.time_us[0]) * 1e-6)


def picked(motion: Motion, index: Array) -> Motion:
    """Some instants of a motion."""
    return Motion(*(getattr(motion, name)[index] for name in Motion.__slots__))


def _nearest(time_s: Array, wanted_s: Array) -> Array:
    after = np.clip(np.searchsorted(time_s, wanted_s), 1, max(len(time_s) - 1, 1))
    late = wanted_s - time_s[after - 1] > time_s[np.minimum(after, len(time_s) - 1)] - wanted_s
    return np.minimum(np.where(late, after, after - 1), len(time_s) - 1)
