"""Opposition of the thumb after Kapandji, 0 to 10, from the pose: what the thumb's tip touches.

A. Kapandji, Ann. Chir. Main 5 (1986) 67. Ten places, from the radial side of the index finger over
the fingertips and down the little finger to the distal palmar crease; the score is the highest that
the pulp of the thumb touches. Kapandji himself notes that it counts only with the thumb's
pronation, which stands beside it.

A place is touched where the axes of the two bones come as near as flesh allows. Half thicknesses
are shares of hand length (ours, from adult finger depths of 12 to 20 mm), so is where the creases
lie; both are the largest part of its uncertainty beside that of the fingertips.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.analysis.extremes import running_median
from handstudio.analysis.measure import Measure, missing
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import FINGERS, SEGMENTS, HandSide
from handstudio.maths import so3

STAGES = 10

TOLERANCE_M = 0.005
"""How near still counts as touching: about as well as fingertips in the hand are known
(docs/accuracy.md)."""

_PULP = (0.55, 1.0)  # of the distal phalanx, from its joint
_SAMPLES = 4
_THUMB_HALF, _PALM_HALF = 0.045, 0.055  # of hand length: bone axis to the skin of the palm side
_HALF = {"proximal": 0.048, "intermediate": 0.044, "distal": 0.040}
_CREASE = 0.4  # of the little finger's proximal phalanx: where its palmar crease is


@dataclass(frozen=True, slots=True)
class _Place:
    """A stretch of a bone's axis, as shares of its length, and how thick the flesh is there."""

    segment: str
    span: tuple[float, float]
    half: float
    radial: bool = False


def _places() -> tuple[_Place, ...]:
    tips = [_Place(f"{finger}_distal", _PULP, _HALF["distal"]) for finger in FINGERS[1:]]
    return (
        _Place("index_proximal", (0.3, 0.8), _HALF["proximal"], radial=True),
        _Place("index_intermediate", (0.2, 0.8), _HALF["intermediate"], radial=True),
        *tips,
        _Place("little_distal", (0.0, 0.0), _HALF["distal"]),
        _Place("little_intermediate", (0.0, 0.0), _HALF["intermediate"]),
        _Place("little_proximal", (_CREASE, _CREASE), _HALF["proximal"]),
        _Place("little_proximal", (0.0, 0.0), _PALM_HALF),
    )


PLACES = _places()
"""What stages 1 to 10 touch."""


def clearances(
    pose: Pose, length_m: Float[Array, " k"], hand_length_m: float, side: HandSide
) -> Float[Array, "n 10"]:
    """How far the thumb's pulp is from each place [m], skin to skin; negative: pressed together.

    Args:
        pose: The placed hand.
        length_m: Of every segment.
        hand_length_m: Wrist to the tip of the middle finger.
        side: Which hand.
    """
    thumb = _points(pose, "thumb_distal", _PULP, length_m)
    out = np.empty((len(pose.t_world_joint), STAGES))
    for stage, place in enumerate(PLACES):
        points = _points(pose, place.segment, place.span, length_m)
        half = place.half * hand_length_m
        if place.radial:  # the thumb lies on the side: half a finger's breadth from the axis
            x = np.array([-1.0 if side == "right" else 1.0, 0.0, 0.0])
            q = pose.q_world_segment[:, SEGMENTS.index(place.segment)]
            points = points + (half * so3.rotate(q, x))[:, None]
            half = 0.0
        apart = np.linalg.norm(thumb[:, :, None] - points[:, None], axis=-1)
        out[:, stage] = apart.min(axis=(1, 2)) - half - _THUMB_HALF * hand_length_m
    return out


def kapandji_measures(
    time_s: Float[Array, " n"],
    clearance_m: Float[Array, "n 10"],
    rotation: Float[Array, " n"],
    rotation_sd: Float[Array, " n"],
) -> list[Measure]:
    """The score, and the thumb's pronation [deg] in the moment that made it.

    Args:
        time_s: From the take's first instant.
        clearance_m: As `clearances`; NaN where the pose is in doubt.
        rotation: The thumb's pronation at its base [rad].
        rotation_sd: And how well it is known [rad].
    """
    smooth = np.stack([running_median(time_s, column) for column in clearance_m.T], axis=1)
    if not np.isfinite(smooth).any():
        return [missing("kapandji", "thumb", "", "in_doubt")]
    nearest = np.nanmin(smooth, axis=0)
    score = _highest(nearest, TOLERANCE_M)
    details = {f"stage_{n + 1}_mm": float(1e3 * gap) for n, gap in enumerate(nearest)}
    at = int(np.nanargmin(smooth[:, max(score, 1) - 1]))
    out = [
        Measure(
            "kapandji",
            "thumb",
            float(score),
            "",
            norm=float(STAGES),
            low=float(_highest(nearest, 0.0)),
            high=float(_highest(nearest, 2.0 * TOLERANCE_M)),
            at_s=float(time_s[at]) if score else None,
            details=details,
        )
    ]
    if score and np.isfinite(rotation[at]):
        value, sd = float(np.rad2deg(rotation[at])), float(np.rad2deg(rotation_sd[at]))
        out.append(Measure("pronation", "thumb", value, "deg", sd=sd, at_s=float(time_s[at])))
    return out


def _highest(nearest: Array, tolerance: float) -> int:
    touched = np.flatnonzero(nearest <= tolerance)
    return int(touched[-1]) + 1 if len(touched) else 0


def _points(
    pose: Pose, segment: str, span: tuple[float, float], length_m: Array
) -> Float[Array, "n s 3"]:
    """Points along a bone's axis in the world."""
    k = SEGMENTS.index(segment)
    shares = np.linspace(*span, _SAMPLES if span[0] != span[1] else 1)
    start = pose.t_world_joint[:, k]
    if segment.endswith("_distal"):
        end = pose.t_world_tip[:, FINGERS.index(segment.removesuffix("_distal"))]
    else:
        y = np.array([0.0, float(length_m[k]), 0.0])
        end = start + so3.rotate(pose.q_world_segment[:, k], y)
    points: Array = start[:, None] + shares[None, :, None] * (end - start)[:, None]
    return points
