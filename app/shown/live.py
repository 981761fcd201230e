"""The last seconds of the live hand, thinned to what a plot can show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from app.shown.channels import OF_TAKES, OVERVIEW, sds_of, sets_of, values_of
from handstudio.arrays import Array
from handstudio.pipeline import Motion, empty, join
from handstudio.setup import Setup

SPAN_S = 10.0
_STEP_US = 25_000  # one plotted instant every so often


@dataclass(frozen=True, slots=True, eq=False)
class LiveHistory:
    """Curves of the last seconds; times count from the first instant seen."""

    setup: Setup
    start_us: int
    next_us: int
    time_s: Float[Array, " n"]
    values: Float[Array, "n c"]
    sds: Float[Array, "n c"]  # [deg], inf where the filter does not tell
    chosen: str = OVERVIEW


def extended(
    history: LiveHistory | None, setup: Setup, motions: Sequence[Motion], chosen: str = OVERVIEW
) -> LiveHistory:
    """Add what came since; begins anew with another setup, or other curves.

    Speeds and signals are of takes: in their place comes the overview.
    """
    live = chosen in sets_of(setup.layout) and chosen not in OF_TAKES
    chosen = chosen if live else OVERVIEW
    if history is None or history.setup is not setup or history.chosen != chosen:
        history = _begun(setup, chosen)
    if not motions:
        return history
    motion = join(list(motions))
    start = history.start_us if len(history.time_s) else int(motion.time_us[0])
    kept = _thinned(motion, history.next_us)
    if len(kept) == 0:
        return history
    time_s = np.concatenate([history.time_s, (kept.time_us - start) * 1e-6])
    values = np.concatenate([history.values, values_of(setup, kept, chosen)])
    sds = np.concatenate([history.sds, sds_of(setup, kept, chosen)])
    recent = time_s >= time_s[-1] - SPAN_S
    return replace(
        history,
        start_us=start,
        next_us=(int(kept.time_us[-1]) // _STEP_US + 1) * _STEP_US,
        time_s=time_s[recent],
        values=values[recent],
        sds=sds[recent],
    )


def _begun(setup: Setup, chosen: str) -> LiveHistory:
    nothing = empty(len(setup.layout.sensors))
    curves = values_of(setup, nothing, chosen), sds_of(setup, nothing, chosen)
    return LiveHistory(setup, 0, np.iinfo(np.int64).min, np.empty(0), *curves, chosen)


def _thinned(motion: Motion, next_us: int) -> Motion:
    # the first instant in every step of a fixed raster
    raster = motion.time_us // _STEP_US
    first = np.concatenate([[True], np.diff(raster) > 0]) & (motion.time_us >= next_us)
    return Motion(*(getattr(motion, name)[first] for name in Motion.__slots__))
