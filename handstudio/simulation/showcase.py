"""A loop of about forty seconds that shows what a hand can do, in clinical angle names.

Degrees here, as in a script that a person would follow; zero is the flat hand, palm down. Reach
stays within the normal active ranges of CONVENTIONS.md, speed under 500 deg/s.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np

from handstudio.arrays import Array
from handstudio.hand.angles import hand_angles, joint_index, sign_of
from handstudio.hand.skeleton import FINGERS, JOINTS, HandSide
from handstudio.simulation.trajectory import Trajectory

Posture: TypeAlias = Mapping[str, float]
"""Angles [deg] by clinical name; whatever is not named is at the flat hand."""

Script: TypeAlias = Iterable[tuple[float, Posture]]
"""Seconds to take, and the posture to be in then; the same posture again is a hold."""


def trajectory(script: Script, side: HandSide, periodic: bool = False) -> Trajectory:
    """Turn a script, played from the flat hand, into joint turns of one side.

    Raises:
        ValueError: a posture names an angle that a hand does not have.
    """
    steps = list(script)
    ends = np.cumsum([0.0, *(seconds for seconds, _ in steps)])
    postures = [_FLAT, *(posture for _, posture in steps)]
    turns = np.stack([_turns(posture, side) for posture in postures])
    # whole microseconds, as a device's clock counts, so that sums of tenths stay tenths
    return Trajectory(np.round(ends, 6), turns, periodic)


def showcase(side: HandSide) -> Trajectory:
    """The loop; it begins and ends flat, at rest, and repeats."""
    return trajectory(_SHOWCASE, side, periodic=True)


def _turns(posture: Posture, side: HandSide) -> Array:
    turns = np.zeros((len(JOINTS), 3))
    for name, degrees in posture.items():
        if name not in _ANGLES:
            raise ValueError(f"{name} is not an angle of the hand; see hand.angles.hand_angles.")
        angle = _ANGLES[name]
        # a sign is +1 or -1: multiplying takes it off as well as on
        turn = sign_of(angle, side) * np.deg2rad(degrees)
        turns[joint_index(angle.joint), angle.turn] = turn
    return turns


def _finger(finger: str, mcp: float, pip: float, abduction: float = 0.0) -> dict[str, float]:
    # the last joint cannot be bent alone: it follows the one before (0.6, ours; 2/3 is usual)
    return {
        f"{finger}_mcp_flexion": mcp,
        f"{finger}_mcp_abduction": abduction,
        f"{finger}_pip_flexion": pip,
        f"{finger}_dip_flexion": 0.6 * pip,
    }


def _thumb(flexion: float, abduction: float, mcp: float, ip: float) -> dict[str, float]:
    return {
        "thumb_cmc_flexion": flexion,
        "thumb_cmc_abduction": abduction,
        "thumb_mcp_flexion": mcp,
        "thumb_ip_flexion": ip,
    }


_ANGLES = {angle.name: angle for angle in hand_angles()}

_FLAT: Posture = {}
_RAISED = {"elbow_flexion": 35.0}
_CURLED = _RAISED | {k: v for f in FINGERS[1:] for k, v in _finger(f, 80.0, 95.0).items()}
# Thumbs found by search on the nominal skeleton: over the middle phalanges of index and middle
# finger, a thumb's thickness outside; tip to tip with the index, pads 10 mm apart (bone to bone).
_FIST = _CURLED | _thumb(flexion=1.0, abduction=11.0, mcp=50.0, ip=61.0)
_PINCH = _RAISED | _finger("index", 45.0, 45.0) | _thumb(8.0, 4.0, 33.0, 26.0)
_THUMB_BENT = _RAISED | _thumb(flexion=10.0, abduction=15.0, mcp=45.0, ip=60.0)
_SPREAD = _RAISED | _thumb(flexion=-18.0, abduction=0.0, mcp=0.0, ip=0.0)
_SPREAD |= _finger("index", 0.0, 0.0, 16.0) | _finger("ring", 0.0, 0.0, 10.0)
_SPREAD |= _finger("little", 0.0, 0.0, 20.0)

_FIST_AND_OPEN: Script = [
    (0.9, _CURLED),  # the thumb comes last and leaves first, or it would be caught inside
    (0.6, _FIST),
    (0.4, _FIST),
    (0.5, _CURLED),
    (0.9, _RAISED),
    (0.3, _RAISED),
]

_SHOWCASE: Script = [
    (3.5, _FLAT),  # long enough to find rest and initialise
    (1.2, _RAISED),
    (0.3, _RAISED),
    *_FIST_AND_OPEN,
    *_FIST_AND_OPEN,
    (0.6, _THUMB_BENT),
    (0.6, _RAISED),
    *(
        step
        for finger in FINGERS[1:]
        for step in ((0.6, _RAISED | _finger(finger, 70.0, 80.0)), (0.6, _RAISED))
    ),
    (0.3, _RAISED),
    (1.0, _PINCH),
    (1.3, _PINCH),
    (0.9, _RAISED),
    (0.9, _RAISED | {"wrist_flexion": 60.0}),
    (1.4, _RAISED | {"wrist_flexion": -50.0}),
    (0.9, _RAISED),
    (0.6, _RAISED | {"wrist_deviation_ulnar": 25.0}),
    (0.9, _RAISED | {"wrist_deviation_ulnar": -15.0}),
    (0.6, _RAISED),
    (0.9, _RAISED | {"forearm_pronation": -75.0}),  # thumb up
    (0.3, _RAISED | {"forearm_pronation": -75.0}),
    (0.9, _RAISED | {"forearm_pronation": -150.0}),  # palm up
    (0.4, _RAISED | {"forearm_pronation": -150.0}),
    (1.5, _RAISED),
    (1.0, {"elbow_flexion": 90.0}),
    (0.3, {"elbow_flexion": 90.0}),
    (1.0, _RAISED),
    (0.8, _SPREAD),
    (1.2, _SPREAD),
    (0.8, _RAISED),
    (1.4, _FLAT),
    (2.5, _FLAT),
]
