"""Flesh around the bones: how thick an average hand is, and where its skin is.

Half a segment's thickness, from the middle of the bone to the skin of the palm side, as a share of
hand length; ours, from adult finger depths of 12 to 20 mm and a palm of 28 mm.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS, HandSide

_HALF_DEPTH = {"forearm": 0.16, "hand": 0.075, "hand_ulnar": 0.070, "thumb_metacarpal": 0.065}
_HALF_DEPTH_OF_PHALANX = {"proximal": 0.048, "intermediate": 0.044, "distal": 0.040}


def half_depths(hand_length_m: float) -> Float[Array, " k"]:
    """Of every segment of an average hand of this length [m]."""
    shares = [
        _HALF_DEPTH.get(name) or _HALF_DEPTH_OF_PHALANX[name.rpartition("_")[2]]
        for name in SEGMENTS
    ]
    return np.array(shares) * hand_length_m


def outwards(side: HandSide, towards_deg: float = 0.0) -> Float[Array, "3"]:
    """Out of the skin of a segment, in its frame: from the palm side round to the radial side."""
    radial = -1.0 if side == "right" else 1.0
    angle = np.deg2rad(towards_deg)
    return np.array([radial * np.sin(angle), 0.0, -np.cos(angle)])
