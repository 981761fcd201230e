"""How sensors sit on segments, as long as nobody has calibrated them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.layout import Layout
from handstudio.maths import so3


def nominal_mounting(layout: Layout) -> Float[Array, "s 4"]:
    """``q_sensor_segment`` of a nominally mounted glove: sensor axes along the segment's axes."""
    return np.tile(so3.IDENTITY, (len(layout.sensors), 1))
