"""A loop of about forty seconds that shows what a hand can do.

Reach stays within the normal active ranges of CONVENTIONS.md, speed under 500 deg/s.
"""

from __future__ import annotations

from handstudio.hand.skeleton import FINGERS, HandSide
from handstudio.simulation.postures import FLAT, Script, scripted, thumb
from handstudio.simulation.postures import finger as _any_finger
from handstudio.simulation.trajectory import Trajectory


def showcase(side: HandSide) -> Trajectory:
    """The loop; it begins and ends flat, at rest, and repeats."""
    return scripted(_SHOWCASE, side, periodic=True)


def _finger(name: str, mcp: float, pip: float, abduction: float = 0.0) -> dict[str, float]:
    return _any_finger(name, mcp, pip, abduction, dip=0.6 * pip)


_RAISED = {"elbow_flexion": 35.0}
_CURLED = _RAISED | {k: v for f in FINGERS[1:] for k, v in _finger(f, 80.0, 95.0).items()}
# Thumbs found by search on the nominal skeleton: over the middle phalanges of index and middle
# finger, a thumb's thickness outside; tip to tip with the index, pads 10 mm apart (bone to bone).
_FIST = _CURLED | thumb(flexion=1.0, abduction=11.0, mcp=50.0, ip=61.0)
_PINCH = _RAISED | _finger("index", 45.0, 45.0) | thumb(8.0, 4.0, 33.0, 26.0)
_THUMB_BENT = _RAISED | thumb(flexion=10.0, abduction=15.0, mcp=45.0, ip=60.0)
_SPREAD = _RAISED | thumb(flexion=-18.0, abduction=0.0, mcp=0.0, ip=0.0)
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
    (3.5, FLAT),  # long enough to find rest and initialise
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
    (1.4, FLAT),
    (2.5, FLAT),
]
