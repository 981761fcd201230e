"""Chains of sensors, root to leaf, and the vectors along them (the thesis's 3.6 and 4.3).

Filters over chains see a hand as one chain a finger, table 3.6; a sensor that several chains share
stands in each. Sensors beyond the end of a chain that is shorter than others are `NOBODY`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from jaxtyping import Float, Int

from handstudio.arrays import Array
from handstudio.fusion.mechanism import Mechanism, bare
from handstudio.maths import so3

NOBODY = -1

Chains: TypeAlias = tuple[tuple[int, ...], ...]
"""Sensors of each chain, root first."""


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """What filters over chains know of the hand.

    Attributes:
        chains: Sensors of each chain, root first.
        t_joint_sensor: From a sensor's own (proximal) joint to it, in its frame [m], ``P_Sj^Jj``.
        t_joint_next: From that joint to the chain's next one, in the same frame [m], ``V``; 0 where
            the chain ends.
        heading_rad: By how much each one's heading is turned (4.21).
    """

    chains: Chains
    t_joint_sensor: Float[Array, "c l 3"]
    t_joint_next: Float[Array, "c l 3"]
    heading_rad: Float[Array, "c l"]


@lru_cache(maxsize=16)
def links_of(mechanism: Mechanism) -> Links:
    """Chains of a mechanism, kept for the mechanisms asked about last."""
    chains = chains_of(mechanism)
    index = padded(chains)
    to_sensor = np.where((index == NOBODY)[..., None], 0.0, -mechanism.t_sensor_joint[index])
    to_next = np.zeros_like(to_sensor)
    for c, chain in enumerate(chains):
        for k, (sensor, following) in enumerate(pairwise(chain)):
            to_next[c, k] = _to_next(mechanism, sensor, following)
    heading = np.where(index == NOBODY, 0.0, mechanism.heading_rad[index])
    return Links(chains, to_sensor, to_next, heading)


@lru_cache(maxsize=16)
def single(sensors: int) -> Links:
    """Links of sensors that nothing joins: each is a chain."""
    return links_of(bare(sensors))


def chains_of(mechanism: Mechanism) -> Chains:
    """A chain to each sensor that is nobody's parent, and to each that is in none of these."""
    leaves = np.setdiff1d(np.arange(mechanism.sensors), mechanism.parent)
    paths = {int(leaf): _path(mechanism, int(leaf)) for leaf in leaves}
    stand_in = {path[0] for path in paths.values() if len(path) > 1}
    # a leaf that another chain begins with (a second sensor of the forearm) needs none of its own
    kept = [path for leaf, path in paths.items() if leaf not in stand_in]
    covered = {sensor for path in kept for sensor in path}
    rest = [_plain_path(mechanism, s) for s in range(mechanism.sensors) if s not in covered]
    return tuple(kept + rest)


def padded(chains: Chains) -> Int[Array, "c l"]:
    """Sensors of each chain in a row, `NOBODY` where it has ended."""
    longest = max((len(chain) for chain in chains), default=0)
    return np.array([[*chain, *[NOBODY] * (longest - len(chain))] for chain in chains])


def _path(mechanism: Mechanism, sensor: int) -> tuple[int, ...]:
    path = _plain_path(mechanism, sensor)
    root = int(mechanism.chain_root[sensor])
    return (root, *path[1:]) if root != NOBODY and len(path) > 1 else path


def _plain_path(mechanism: Mechanism, sensor: int) -> tuple[int, ...]:
    path = [sensor]
    while (parent := int(mechanism.parent[path[-1]])) != NOBODY:
        path.append(parent)
    return tuple(reversed(path))


def _to_next(mechanism: Mechanism, sensor: int, following: int) -> Array:
    """From a sensor's own joint to that of the next in the chain, in the sensor's frame [m].

    The next one's joint is known in its parent. A sensor that stands in for the parent is on the
    same segment, whose frame both have.
    """
    parent = int(mechanism.parent[following])
    to_next: Array = mechanism.t_parent_joint[following] - mechanism.t_sensor_joint[parent]
    if parent == sensor:
        return to_next
    q_sensor_parent = so3.multiply(
        mechanism.q_sensor_joint[sensor], so3.conjugate(mechanism.q_sensor_joint[parent])
    )
    return so3.rotate(q_sensor_parent, to_next)
