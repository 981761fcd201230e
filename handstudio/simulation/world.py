"""Where a subject sits: gravity, the Earth's field, and what disturbs it.

World: z up, x along the horizontal field (magnetic north); the elbow's place at the start is the
origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY

_DIPOLE_UT_M3 = 0.1  # mu0 / 4 pi, for moments in A m² and fields in µT


@dataclass(frozen=True, slots=True)
class Dipole:
    """A magnet, or a piece of steel that the Earth has magnetised, seen from afar.

    Attributes:
        place_m: In the world.
        moment_am2: [A m²].
    """

    place_m: tuple[float, float, float]
    moment_am2: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class World:
    """Where the forearm starts, and what it feels there.

    Attributes:
        heading_rad: Direction the forearm points to at the start, palm down: anticlockwise from
            magnetic north, seen from above.
        field_ut: The Earth's field, pointing down in the north. Kyoto by the IGRF, rounded.
        gradient_ut_m: How the field of the building changes with place: dB_i/dx_j [µT/m].
        dipoles: Magnets and steel nearby.
        gravity_mps2: Its size.
    """

    heading_rad: float = 0.6
    field_ut: tuple[float, float, float] = (31.0, 0.0, -35.0)
    gradient_ut_m: tuple[tuple[float, float, float], ...] = ()
    dipoles: tuple[Dipole, ...] = ()
    gravity_mps2: float = STANDARD_GRAVITY

    @property
    def q_world_start(self) -> Float[Array, "4"]:
        """Attitude of the forearm at the start: along the heading, dorsal side up."""
        return so3.about_z(self.heading_rad - 0.5 * np.pi)

    def field_at(self, place_m: Float[Array, "*n 3"]) -> Float[Array, "*#n 3"]:
        """Magnetic field [µT] at places in the world [m]."""
        field = np.asarray(self.field_ut)
        if self.gradient_ut_m:
            field = field + _times(np.asarray(self.gradient_ut_m), place_m)
        for dipole in self.dipoles:
            field = field + _of_dipole(dipole, place_m)
        return field


def _times(gradient: Array, place_m: Array) -> Array:
    # not ``@``: its digits depend on how many places are asked for at once
    x, y, z = place_m[..., 0], place_m[..., 1], place_m[..., 2]
    return np.stack([row[0] * x + row[1] * y + row[2] * z for row in gradient], axis=-1)


def _of_dipole(dipole: Dipole, place_m: Array) -> Array:
    x, y, z = (place_m[..., i] - dipole.place_m[i] for i in range(3))
    a, b, c = dipole.moment_am2
    # nothing comes nearer to the middle of a magnet than its own size
    square = np.maximum(x * x + y * y + z * z, 0.005**2)
    falling = _DIPOLE_UT_M3 / (square * np.sqrt(square))
    along = 3.0 * (a * x + b * y + c * z) / square
    parts = ((x, a), (y, b), (z, c))
    return np.stack([falling * (along * away - moment) for away, moment in parts], axis=-1)
