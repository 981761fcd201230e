"""How sensors sit on segments, as long as nobody has calibrated them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS, ULNAR, Skeleton
from handstudio.layout import Layout
from handstudio.maths import so3


def nominal_mounting(layout: Layout) -> Float[Array, "s 4"]:
    """``q_sensor_segment`` of a nominally mounted glove: sensor axes along the segment's axes."""
    return np.tile(so3.IDENTITY, (len(layout.sensors), 1))


def nominal_places(layout: Layout, skeleton: Skeleton) -> Float[Array, "s 3"]:
    """Where the sensors of a hand sit in their segments [m]: on the back, half way along."""
    far = skeleton.t_far_end
    places = [
        WHERE_ALONG.get(p.sensor, 0.5) * far[SEGMENTS.index(p.segment)] for p in layout.sensors
    ]
    if layout.hand_type != 3:
        for sensor, place in enumerate(layout.sensors):
            if place.segment == ULNAR or (place.segment == "hand" and place.second):
                places[sensor] = _FROM_WRIST * far[SEGMENTS.index(ULNAR)]
    placed: Array = np.stack(places) + _ABOVE
    return placed


_FROM_WRIST = 0.69
"""Where the sensor of the ulnar block sits on the way from the wrist to the ring finger's MCP."""

WHERE_ALONG = {"SN1": 0.70, "SN2": 0.78, "SN3": 0.86, "Tip": 1.0}
"""Sensors that do not sit half way: share of the segment's length."""

_ABOVE = np.array([0.0, 0.0, 0.013])  # half the thickness of a finger, and the board
