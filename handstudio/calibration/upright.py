"""How a glove sits: whether gravity is felt where the flat hand lets expect it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration import demands
from handstudio.calibration.heard import angle_between, live_ones, mean_while
from handstudio.calibration.verdict import Reading
from handstudio.hand.skeleton import PARENTS, SEGMENTS, HandSide, nominal_skeleton
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.samples import ImuSamples

_NAN = float("nan")


def upright_of(samples: ImuSamples, layout: Layout) -> list[Reading]:
    """The sensor that lies least as the flat hand lets expect; nothing without a hand."""
    if not layout.is_hand:
        return []
    live = live_ones(samples)
    if not len(live):
        return [Reading("upright", _NAN, demands.UPRIGHT_DEG, "deg", at_least=False)]
    segments = [layout.sensors[index].segment for index in live]
    q_world_segment = _flat("left" if layout.side == "left" else "right", segments)
    up_segment = so3.rotate(so3.conjugate(q_world_segment), np.array([0.0, 0.0, 1.0]))
    off = np.rad2deg(angle_between(mean_while(samples.acc, samples.valid)[live], up_segment))
    limit = np.where(
        ["thumb" in name for name in segments], demands.UPRIGHT_THUMB_DEG, demands.UPRIGHT_DEG
    )
    worst = int(np.argmax(off / limit))
    value, most = float(off[worst]), float(limit[worst])
    about = layout.names[live[worst]] if value > most else ""
    return [Reading("upright", value, most, "deg", at_least=False, about=about)]


def _flat(side: HandSide, segments: list[str]) -> Float[Array, "s 4"]:
    """Attitudes of segments while the hand lies flat, the fingers to the north."""
    rest, world = nominal_skeleton(side).q_parent_rest, list[Array]()
    for index, parent in enumerate(PARENTS):
        world.append(rest[index] if parent < 0 else so3.multiply(world[parent], rest[index]))
    return np.stack([world[SEGMENTS.index(name)] for name in segments])
