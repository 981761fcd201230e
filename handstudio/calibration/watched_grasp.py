"""Whether a hand was opened and closed, every finger far enough."""

from __future__ import annotations

import numpy as np

from handstudio.calibration import demands
from handstudio.calibration.heard import seconds_of
from handstudio.calibration.movement import STEP_S, main_axes, moved_since
from handstudio.calibration.verdict import Reading
from handstudio.hand.skeleton import FINGERS
from handstudio.layout import Layout
from handstudio.samples import ImuSamples

_BENDING = tuple(f"{finger}_{joint}" for finger in FINGERS[1:] for joint in ("mcp", "pip"))
_EDGES = (5.0, 95.0)  # percentiles between which a joint counts as moved


def watch_grasp(done: ImuSamples, layout: Layout) -> list[Reading]:
    """The joint of a finger that was bent least."""
    if seconds_of(done) < STEP_S:
        return [Reading("range", 0.0, demands.GRASP_DEG, "deg")]
    moved = moved_since(None, done, layout)
    here = [i for i, joint in enumerate(moved.joints) if joint in _BENDING]
    if not here:
        return [Reading("range", float("nan"), demands.GRASP_DEG, "deg")]
    axes = main_axes(moved.turned)[here]
    along = np.einsum("mjk,jk->mj", moved.turned[:, here], axes)
    low, high = np.rad2deg(np.percentile(along, _EDGES, axis=0))
    worst = int(np.argmin(high - low))
    joint = moved.joints[here[worst]]
    return [Reading("range", float((high - low)[worst]), demands.GRASP_DEG, "deg", about=joint)]
