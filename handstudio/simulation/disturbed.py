"""Rooms with steel, magnets and a field that changes with place.

That reinforced concrete, desks and devices bend the field indoors by several µT, and more the
nearer they are, is known (W. H. K. de Vries et al., Gait & Posture 29 (2009) 535, in a laboratory);
the sizes here are ours.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handstudio.arrays import Array
from handstudio.simulation.imperfections.noise import generator
from handstudio.simulation.imperfections.strengths import Imperfections
from handstudio.simulation.world import Dipole, World

GRADIENT_UT_M = 3.0  # sd of its five free components
EDGE_PIECES, EDGE_SPACING_M, EDGE_BELOW_M = 9, 0.15, 0.08
EDGE_AM2 = 0.15  # sd of a piece's remanent moment, each axis
MAGNET_AM2 = 0.4  # a neodymium disk of 10 mm across and 4 mm high
MAGNET_AWAY_M = (0.15, 0.25)  # no finger gets as near as its own breadth


def disturbed(world: World, what: Imperfections, seed: int) -> World:
    """A room with what disturbs the field in it; a seed is one room.

    Strengths scale gradient and moments and leave everything where it is.
    """
    gradient = np.reshape(world.gradient_ut_m or np.zeros((3, 3)), (3, 3))
    gradient = gradient + building(seed, what.magnetic_gradient)
    dipoles = world.dipoles
    if what.desk_edge:
        dipoles += desk_edge(world.heading_rad, seed, what.desk_edge)
    if what.magnet:
        dipoles += (magnet(world.heading_rad, seed, what.magnet),)
    return replace(
        world,
        gradient_ut_m=tuple(map(tuple, gradient.tolist())) if gradient.any() else (),
        dipoles=dipoles,
    )


def building(seed: int, strength: float = 1.0) -> Array:
    """Gradient of the field [µT/m]: symmetric and without a trace, as in air it must be."""
    xx, yy, xy, xz, yz = generator(seed, _BUILDING).standard_normal(5)
    gradient = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, -xx - yy]])
    return strength * GRADIENT_UT_M * gradient


def desk_edge(heading_rad: float, seed: int, strength: float = 1.0) -> tuple[Dipole, ...]:
    """A steel rail under the edge of the desk, across the forearm, below the elbow.

    The Earth's field along an even rail would be felt at its ends only; what is felt is that every
    piece of it is magnetised differently.
    """
    moments = generator(seed, _DESK).normal(0.0, strength * EDGE_AM2, (EDGE_PIECES, 3))
    across = np.array([-np.sin(heading_rad), np.cos(heading_rad), 0.0])
    places = (np.arange(EDGE_PIECES) - (EDGE_PIECES - 1) / 2)[:, None] * EDGE_SPACING_M * across
    places[:, 2] = -EDGE_BELOW_M
    return tuple(_dipole(*pair) for pair in zip(places, moments, strict=True))


def magnet(heading_rad: float, seed: int, strength: float = 1.0) -> Dipole:
    """A magnet on the desk, beside the hand as it lies at the start, turned anyhow."""
    rng = generator(seed, _MAGNET)
    moment = rng.standard_normal(3)
    aside = rng.choice([-1.0, 1.0]) * rng.uniform(*MAGNET_AWAY_M)
    forth = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0])
    across = np.array([-forth[1], forth[0], 0.0])
    place = 0.35 * forth + aside * across - [0.0, 0.0, 0.03]
    return _dipole(place, strength * MAGNET_AM2 * moment / np.linalg.norm(moment))


_BUILDING, _DESK, _MAGNET = 50, 51, 52  # which of a seed's streams


def _dipole(place_m: Array, moment_am2: Array) -> Dipole:
    (x, y, z), (a, b, c) = place_m.tolist(), moment_am2.tolist()
    return Dipole((x, y, z), (a, b, c))
