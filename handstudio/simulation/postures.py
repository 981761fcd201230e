"""Postures in clinical angle names: degrees here, as in a script that a person would follow.

Zero is the flat hand, palm down, the elbow where it was at the start.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.hand.angles import hand_angles, joint_index, sign_of
from handstudio.hand.skeleton import FINGERS, HandSide
from handstudio.simulation.trajectory import CHANNELS, Trajectory, through_stops

Posture: TypeAlias = Mapping[str, float]
"""Angles [deg] by clinical name, and `ELBOW` places [mm]; what is not named is at the flat hand."""

Script: TypeAlias = Iterable[tuple[float, Posture]]
"""Seconds to take, and the posture to be in then; the same posture again is a hold."""

ELBOW = ("elbow_north_mm", "elbow_west_mm", "elbow_up_mm")
"""Where the elbow is against the start, in the world."""

FLAT: Posture = {}

DIP_PER_PIP = 2.0 / 3.0
"""The last joint cannot be bent alone: H. Rijpkema and M. Girard, Computer Graphics 25 (1991) 339.
A subject's own is in `subject.Subject.dip_per_pip`."""


def channels(posture: Posture, side: HandSide) -> Float[Array, " c"]:
    """A posture as a trajectory has it.

    Raises:
        ValueError: it names an angle that a hand does not have.
    """
    out = np.zeros(CHANNELS)
    for name, value in posture.items():
        if name in _CHANNEL:
            channel, sign = _CHANNEL[name]
            out[channel] = (sign[side] * np.deg2rad(value)) if sign else value * 1e-3
        else:
            raise ValueError(f"{name} is not an angle of the hand; see hand.angles.hand_angles.")
    return out


def channel_of(name: str) -> int:
    """Index of a named angle among a trajectory's channels; its sign is `hand.angles.sign_of`."""
    return _CHANNEL[name][0]


def scripted(script: Script, side: HandSide, periodic: bool = False) -> Trajectory:
    """A script, played from the flat hand.

    Raises:
        ValueError: a posture names an angle that a hand does not have.
    """
    steps = list(script)
    ends = np.cumsum([0.0, *(seconds for seconds, _ in steps)])
    postures = np.stack([channels(p, side) for p in (FLAT, *(posture for _, posture in steps))])
    # whole microseconds, as a device's clock counts, so that sums of tenths stay tenths
    return through_stops(np.round(ends, 6), postures, periodic)


def finger(
    name: str, mcp: float, pip: float, abduction: float = 0.0, dip: float | None = None
) -> dict[str, float]:
    """One finger [deg]; the last joint follows the one before unless told."""
    return {
        f"{name}_mcp_flexion": mcp,
        f"{name}_mcp_abduction": abduction,
        f"{name}_pip_flexion": pip,
        f"{name}_dip_flexion": DIP_PER_PIP * pip if dip is None else dip,
    }


def fingers(mcp: float, pip: float) -> dict[str, float]:
    """All four alike [deg]."""
    return {k: v for name in FINGERS[1:] for k, v in finger(name, mcp, pip).items()}


def thumb(
    flexion: float, abduction: float, mcp: float, ip: float, rotation: float = 0.0
) -> dict[str, float]:
    """The thumb [deg]."""
    return {
        "thumb_cmc_flexion": flexion,
        "thumb_cmc_abduction": abduction,
        "thumb_cmc_rotation": rotation,
        "thumb_mcp_flexion": mcp,
        "thumb_ip_flexion": ip,
    }


def _channels() -> dict[str, tuple[int, dict[HandSide, float]]]:
    sides: tuple[HandSide, HandSide] = ("right", "left")
    known: dict[str, tuple[int, dict[HandSide, float]]] = {
        angle.name: (
            3 * joint_index(angle.joint) + angle.turn,
            # a sign is +1 or -1: multiplying takes it off as well as on
            {side: sign_of(angle, side) for side in sides},
        )
        for angle in hand_angles()
    }
    known["elbow_rotation"] = (1, {"right": 1.0, "left": -1.0})
    known["thumb_mcp_abduction"] = (
        3 * joint_index("thumb_mcp") + 1,
        {"right": 1.0, "left": -1.0},
    )
    return known | {name: (CHANNELS - 3 + i, {}) for i, name in enumerate(ELBOW)}


_CHANNEL = _channels()
