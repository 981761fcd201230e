"""What a step of a calibration asks for, in numbers: how far, how fast, how still.

Degrees and seconds, as people read them. A demand is what a guided person does without effort, the
hand on the page showing how; joint centres need no more than half a joint's range, but need it
about the asked axis, at a pace that is felt in the accelerations, and nothing else moving.
"""

from __future__ import annotations

import msgspec

from handstudio.calibration.course import SWINGS, Step
from handstudio.hand.skeleton import FINGERS

ANSWERING_PCT = 95.0
"""Of a sensor's instants; the line itself loses half a per cent on an ordinary day."""

UPRIGHT_DEG = 40.0
"""Between gravity as a sensor feels it and as the flat hand lets expect. A glove sits 5 to 10
degrees crooked and backs of fingers slope; a sensor on its side is far off."""

UPRIGHT_THUMB_DEG = 55.0
"""Thumbs lie beside the flat hand as they please."""

RESTING_DEG_S = 1.0
"""Of a hand on a table. A sensor's own noise makes 0.15 at 100 Hz."""

HELD_STILL_DEG_S = 1.5
"""Of a hand in the air that keeps still before it swings: healthy fingers tremble by 0.5 to 1, and
half as much again still gives a bias good to 0.1 deg/s."""

BIAS_DEG_S = 5.0
"""The most that a resting gyroscope reads; more is a turn."""

RESTED_SHARE = 0.75
"""Of the rest before a swing that must be there."""

TURN_DEG = 42.0
"""That the arm is lifted by. Less, and noise and compasses weigh more in the headings."""

TURN_PACE = 0.4
"""Lifts a second, up and down again; 0.5 is asked. A slow one lets the biases in."""

TOGETHER_DEG = 10.0
"""That a joint may give while the arm is lifted stiffly; skin alone makes some five of it."""

STIFF_DEG_S = 1.0
"""Tremor of a hand that is lifted stiffly, at some 10 Hz; the lift itself makes a tenth of it."""

GRASP_DEG = 35.0
"""That every finger bends by at MCP and PIP in a grasp: half of a fist."""

SIDEWAYS = 0.35
"""How much a joint may bend while it is moved to a side, and the like, as a share. A sensor that
sits crooked by 10 degrees makes half of it."""

DIRECTIONS = 12
"""That a board lies still in: nine are what scale, offset and skew of three axes take."""

APART_DEG = 20.0
"""Directions nearer than this are one."""

UNSTEADY_DEG = 5.0
"""That a joint nobody thinks of wanders by while another one swings."""

SLOW_SHARE, FAST_SHARE = 0.8, 1.8
"""Of the pace that is asked, and shown: slower, and accelerations drown in what skin and noise
make; faster, and boards swing on the skin."""


class Demand(msgspec.Struct, frozen=True):
    """What one swing asks for.

    Attributes:
        range_deg: How far to and fro, at least, about the asked axis.
        pace: Swings to and fro a second that are asked, and that the page shows.
        others: How far another joint may move along, as a share of the joint's own movement.
        natural: Joints that move along whether one wants it or not.
    """

    range_deg: float
    pace: float
    others: float = 0.18
    natural: frozenset[str] = frozenset()

    @property
    def slowest(self) -> float:
        """Swings a second, at least."""
        return SLOW_SHARE * self.pace

    @property
    def fastest(self) -> float:
        """Swings a second, at most."""
        return FAST_SHARE * self.pace


def _of_finger(finger: str) -> dict[str, Demand]:
    mcp, pip, dip = (f"{finger}_{joint}" for joint in ("mcp", "pip", "dip"))
    return {
        f"{mcp}:flexion": Demand(50.0, 1.05),
        f"{mcp}:abduction": Demand(12.5, 1.2),
        # tendons bend the last joint with the one before
        f"{pip}:flexion": Demand(54.0, 1.2, natural=frozenset({dip})),
        # held by the other hand, the joint before gives a tenth to a sixth
        f"{dip}:flexion": Demand(29.0, 1.3, 0.27),
    }


_DEMANDS: dict[str, Demand] = {
    "elbow:flexion": Demand(42.0, 0.7),
    "elbow:rotation": Demand(48.0, 0.7),
    "wrist:flexion": Demand(70.0, 0.95),
    "wrist:deviation": Demand(25.0, 1.0),
    # the palm folds with the last two fingers
    "ulnar_cmc:flexion": Demand(
        9.5, 1.1, natural=frozenset({"little_mcp", "ring_mcp", "little_dip"})
    ),
    "thumb_cmc:flexion": Demand(24.0, 1.05),
    "thumb_cmc:abduction": Demand(29.0, 1.05),
    "thumb_mcp:flexion": Demand(28.0, 1.1),
    "thumb_mcp:abduction": Demand(11.0, 1.2),
    "thumb_ip:flexion": Demand(48.0, 1.25),
    **{name: demand for finger in FINGERS[1:] for name, demand in _of_finger(finger).items()},
}
assert _DEMANDS.keys() == {step.name for step in SWINGS}


def demand_of(step: Step) -> Demand:
    """What a swing asks for."""
    return _DEMANDS[step.name]
