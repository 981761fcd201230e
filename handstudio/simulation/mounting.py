"""How sensors sit on their segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.calibration.mounting import WHERE_ALONG
from handstudio.errors import LayoutError
from handstudio.hand.skeleton import SEGMENTS, HandSide, Skeleton
from handstudio.layout import Layout
from handstudio.maths import so3

# Bone centre to the chip, ours: half the thickness of an adult's segment and 3 mm of board.
_HEIGHT_M = {"forearm": 0.025, "hand": 0.016, "hand_ulnar": 0.015, "thumb_metacarpal": 0.014}
_HEIGHT_OF_PHALANX_M = {"proximal": 0.012, "intermediate": 0.011, "distal": 0.009}

# How a glove sits on a person, on every donning; ours, judged by eye.
_TILT_DEG = (4.0, 6.0, 4.0)  # about the segment's x, y and z: skin slopes, boards twist
_SHIFT_M = (0.002, 0.003, 0.001)


@dataclass(frozen=True, slots=True, eq=False)
class Mounting:
    """Attitude and place [m] of every sensor of a layout in its segment's frame."""

    q_segment_sensor: Float[Array, "s 4"]
    t_segment_sensor: Float[Array, "s 3"]


def nominal_mounting(layout: Layout, skeleton: Skeleton) -> Mounting:
    """Sensors as the glove's maker means them: axes of the segment, on its back, half way along.

    The three of the forearm follow one another towards the wrist; Tip sits over the fingertip.

    Raises:
        LayoutError: a sensor sits on something that is not a segment of the hand.
    """
    far = skeleton.t_far_end
    places = []
    for place, segment in zip(layout.sensors, segment_indices(layout), strict=True):
        height = np.array([0.0, 0.0, _height_m(place.segment)])
        places.append(WHERE_ALONG.get(place.sensor, 0.5) * far[segment] + height)
    return Mounting(np.tile(so3.IDENTITY, (len(places), 1)), np.array(places))


def donned(nominal: Mounting, seed: int, side: HandSide, strength: float = 1.0) -> Mounting:
    """A glove put on: every sensor a little turned and shifted; a seed is one donning.

    A strength of 0 leaves all where the maker meant it, 2 is twice as crooked. The same donning on
    the other hand is the mirror image.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_DONNING,)))
    normal = strength * rng.standard_normal((len(nominal.t_segment_sensor), 6))
    tilt, shift = np.deg2rad(_TILT_DEG) * normal[:, :3], np.asarray(_SHIFT_M) * normal[:, 3:]
    if side == "left":
        tilt, shift = tilt * [1.0, -1.0, -1.0], shift * [-1.0, 1.0, 1.0]
    return Mounting(
        so3.multiply(nominal.q_segment_sensor, so3.exp(tilt)), nominal.t_segment_sensor + shift
    )


_DONNING = 11  # which of a seed's streams


def segment_indices(layout: Layout) -> list[int]:
    """Index of every sensor's segment.

    Raises:
        LayoutError: a sensor sits on something that is not a segment of the hand.
    """
    for place in layout.sensors:
        if place.segment not in SEGMENTS:
            raise LayoutError(
                "{sensor} sits on {segment}, which a simulated hand does not have.",
                "Put it on one of: {segments}.",
                sensor=place.sensor,
                segment=place.segment,
                segments=", ".join(SEGMENTS),
            )
    return [SEGMENTS.index(place.segment) for place in layout.sensors]


def _height_m(segment: str) -> float:
    return _HEIGHT_M.get(segment) or _HEIGHT_OF_PHALANX_M[segment.rpartition("_")[2]]
