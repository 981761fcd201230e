"""How honest a filter is about its errors: how many are within two of the deviations it told."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand_fit import mechanism_of
from handstudio.maths import so3
from handstudio.pipeline import Motion
from handstudio.setup import Setup


def inside_two_sd(
    setup: Setup, motion: Motion, q_world_sensor: Float[Array, "n s 4"]
) -> tuple[float, float] | None:
    """Shares of errors, axis by axis, of orientations and of those relative to the neighbour.

    Errors are rotations in the world, after the heading that all have in common; None of a filter
    that does not tell.
    """
    if not np.isfinite(motion.sd_rad).all():
        return None
    e = so3.multiply(q_world_sensor, so3.conjugate(motion.q_world_sensor))
    common = np.angle(np.mean(np.exp(1j * so3.heading(e))))
    own = so3.log(so3.multiply(so3.about_z(-common), e))
    parent = mechanism_of(setup).parent
    joined = np.flatnonzero(parent >= 0)
    relative = own[:, joined] - own[:, parent[joined]]
    limit = 2.0 * motion.sd_rad[..., None]
    return (
        float(np.mean(np.abs(own) < limit[:, :, 0])),
        float(np.mean(np.abs(relative) < limit[:, joined, 1])),
    )
