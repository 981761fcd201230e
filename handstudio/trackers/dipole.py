"""The field of three crossed coils, and what three crossed coils hear of it.

Transmitter and receiver are small against their distance: dipoles (seed, 0027). A coil with moment
m along its axis makes the field ``B = (k / r³) (3 r r^T / r² - 1) m``, so the nine signals of three
transmitter and three receiver coils are (F. H. Raab et al., IEEE Trans. Aerosp. Electron. Syst. 15
(1979) 709, with the coupling written once, not as rotations by azimuth and elevation)

    S = R^T (3 u u^T - 1) k / r³

with u from transmitter to receiver, and R turning the receiver's frame into the transmitter's.
Rows are the receiver's coils, columns the transmitter's.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3

MU0_4PI = 1e-7  # [T m/A]


def coupling(t_room_terminal: Float[Array, "*n 3"]) -> Float[Array, "*n 3 3"]:
    """``(3 u u^T - 1) / r³`` [1/m³]: fields along the room's axes of unit coils along them."""
    t = t_room_terminal
    r = np.linalg.norm(t, axis=-1)[..., None, None]
    u = t[..., None] / r
    return np.asarray((3.0 * u * np.swapaxes(u, -1, -2) - np.eye(3)) / r**3)


def signals(
    t_room_terminal: Float[Array, "*n 3"],
    q_room_terminal: Float[Array, "*n 4"],
    gain: float = 1.0,
) -> Float[Array, "*n 3 3"]:
    """What the receiver hears: row a receiver coil, column a transmitter coil.

    Args:
        t_room_terminal: Place of the receiver in the transmitter's frame [m].
        q_room_terminal: Its attitude.
        gain: Of both together: signal at 1 m broadside, the sign reversed. For fields in tesla of
            moments of 1 A m² it is `MU0_4PI`.
    """
    turned = np.swapaxes(so3.to_matrix(q_room_terminal), -1, -2)
    return np.asarray(gain * (turned @ coupling(t_room_terminal)))
