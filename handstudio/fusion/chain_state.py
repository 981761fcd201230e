"""State of the filters over chains: a filter a chain, as published, and what all sensors share."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import msgspec
import numpy as np
from jaxtyping import Bool, Float

from handstudio.arrays import Array
from handstudio.errors import SetupError
from handstudio.fusion import euler
from handstudio.fusion.chain_links import Chains, padded


@dataclass(frozen=True, slots=True, eq=False)
class ChainState:
    """State of all chains and sensors; each sensor's heading is in its own compass's world.

    Attributes:
        period_s: Nominal time between samples.
        magnetometer_period_s: A fresh reading speaks for so much time.
        chains: Sensors of each chain.
        angles: phi, theta, psi [rad] of each sensor in each chain; they run on past pi.
        covariance: Of all angles of a chain, and its elbow's acceleration last.
        elbow: Acceleration of the elbow at the newest instant [m/s²], in the world.
        level_ut: Level part of the field at each sensor, from the static interval [µT] ...
        levels: ... and from how many readings.
        gyr_bias: Of each sensor [rad/s].
        rate: As it turned at the newest instant [rad/s].
        begun: An attitude was found.
        headed: And a heading.
        rated: ``rate`` was read.
    """

    period_s: float
    magnetometer_period_s: float
    chains: Chains
    angles: Float[Array, "c l 3"]
    covariance: Float[Array, "c a a"]
    elbow: Float[Array, "c 3"]
    level_ut: Float[Array, "c l"]
    levels: Float[Array, "c l"]
    gyr_bias: Float[Array, "s 3"]
    rate: Float[Array, "s 3"]
    begun: Bool[Array, " s"]
    headed: Bool[Array, " s"]
    rated: Bool[Array, " s"]


def blank(sensors: int, period_s: float, magnetometer_period_s: float) -> ChainState:
    """Nothing is known, and nothing joins the sensors."""
    zeros, nobody = np.zeros((sensors, 3)), np.zeros(sensors, dtype=bool)
    return ChainState(
        period_s,
        magnetometer_period_s,
        tuple((sensor,) for sensor in range(sensors)),
        np.zeros((sensors, 1, 3)),
        np.zeros((sensors, 6, 6)),
        zeros,
        np.zeros((sensors, 1)),
        np.zeros((sensors, 1)),
        zeros,
        zeros,
        nobody,
        nobody,
        nobody,
    )


def regrouped(state: ChainState, chains: Chains) -> ChainState:
    """The state of other chains: what is known of each sensor, and of nothing in common."""
    if state.chains == chains:
        return state
    known = averaged(state.angles[None], state.chains)[0]
    copies = copies_of(state.chains)
    count, links = padded(chains).shape
    angles, level, levels = (
        np.zeros((count, links, 3)),
        np.zeros((count, links)),
        np.zeros((count, links)),
    )
    covariance = np.zeros((count, 3 * links + 3, 3 * links + 3))
    for c, chain in enumerate(chains):
        for k, sensor in enumerate(chain):
            old_c, old_k = copies[sensor][0]
            angles[c, k] = known[sensor]
            level[c, k], levels[c, k] = state.level_ut[old_c, old_k], state.levels[old_c, old_k]
            old = state.covariance[old_c][block(old_k), block(old_k)]
            covariance[c][block(k), block(k)] = old
    return replace(
        state,
        chains=chains,
        angles=angles,
        covariance=covariance,
        elbow=np.zeros((count, 3)),
        level_ut=level,
        levels=levels,
    )


def block(k: int) -> slice:
    """Where the angles of a chain's k-th sensor stand in its covariance."""
    return slice(3 * k, 3 * k + 3)


def averaged(angles: Float[Array, "n c l 3"], chains: Chains) -> Float[Array, "n s 3"]:
    """One orientation a sensor: circular means, angle by angle, over the chains that share it.

    The mean of copies is that of their differences to the first, each the shorter way round.
    As published: near theta = +-90 deg phi and psi of one attitude are anything, and so is a mean.
    """
    copies = copies_of(chains)
    means = np.empty((len(angles), len(copies), 3))
    for sensor, ((c, k), *others) in enumerate(copies):
        means[:, sensor] = angles[:, c, k]
        to = angles[:, c, k].T
        for d, m in others:
            means[:, sensor] += euler.difference(angles[:, d, m].T, to).T / (1 + len(others))
    return means


def copies_of(chains: Chains) -> list[list[tuple[int, int]]]:
    """Where each sensor stands: chain, and place in it."""
    count = 1 + max((sensor for chain in chains for sensor in chain), default=-1)
    copies: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for c, chain in enumerate(chains):
        for k, sensor in enumerate(chain):
            copies[sensor].append((c, k))
    return copies


class _Packed(msgspec.Struct):
    kind: str
    period_s: float
    magnetometer_period_s: float
    sensors: int
    chains: Chains
    numbers: dict[str, bytes]
    flags: dict[str, list[bool]]


_FLAGS = ("begun", "headed", "rated")
_NUMBERS = tuple(f.name for f in fields(ChainState) if f.name not in _FLAGS)[3:]


def pack(state: ChainState, kind: str) -> bytes:
    """Serialise a state, to the last bit."""
    return msgspec.msgpack.encode(
        _Packed(
            kind,
            state.period_s,
            state.magnetometer_period_s,
            len(state.begun),
            state.chains,
            {name: getattr(state, name).tobytes() for name in _NUMBERS},
            {name: getattr(state, name).tolist() for name in _FLAGS},
        )
    )


def unpack(packed: bytes, kind: str) -> ChainState:
    """Inverse of `pack`.

    Raises:
        SetupError: these bytes are not a state of this kind.
    """
    try:
        got = msgspec.msgpack.decode(packed, type=_Packed)
        if got.kind != kind:
            raise ValueError(got.kind)  # noqa: TRY301 - told as what else is wrong with it
        numbers = {name: _array(got, name) for name in _NUMBERS}
        flags = {name: np.array(got.flags[name], dtype=bool) for name in _FLAGS}
    except (msgspec.MsgspecError, KeyError, ValueError) as error:
        raise SetupError(
            "The saved filter state is not one of {filter} ({reason}).",
            "Process the take again from its start: handstudio process --from-start.",
            filter=kind,
            reason=error,
        ) from error
    return ChainState(got.period_s, got.magnetometer_period_s, got.chains, **numbers, **flags)


def _array(got: _Packed, name: str) -> Array:
    count, links = padded(got.chains).shape
    shapes = {
        "angles": (count, links, 3),
        "covariance": (count, 3 * links + 3, 3 * links + 3),
        "elbow": (count, 3),
        "level_ut": (count, links),
        "levels": (count, links),
    }
    return np.frombuffer(got.numbers[name]).reshape(shapes.get(name, (got.sensors, 3))).copy()
