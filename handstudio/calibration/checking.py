"""Whether a calibration still holds after the glove was put on again.

Two things are held against it: how segments lie at the flat hand, and about which axes fingers
bend. Both move when a sensor sits otherwise than it did.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.axes import flexion_axis
from handstudio.calibration.heard import ROOT
from handstudio.calibration.subject import Segment, SubjectCalibration
from handstudio.calibration.swings import Swing, Swings
from handstudio.calibration.verdict import Reading, Verdict
from handstudio.hand.skeleton import JOINTS, PARENTS, SEGMENTS, ULNAR
from handstudio.maths import so3

LIMIT_DEG = 6.5
"""How far a segment may have moved. Of checks with the glove left on 98 % stay below at every
segment: virtual people 1 to 4, who bend each joint by 1.5 degrees (ours) otherwise from one flat
hand to the next (`benchmarks.calibration --development`, its ``check``)."""

LIMIT_UNCALIBRATED_DEG = 8.0
"""The same of sensors whose own errors are not known; people 1 to 3."""


def check(
    lying: Swings,
    bending: Swings,
    grasp: slice,
    calibration: SubjectCalibration,
    limit_deg: float = LIMIT_DEG,
) -> Verdict:
    """Hold a flat hand and a grasp against a calibration, one reading a segment.

    Args:
        lying: A recording with a flat hand in it, prepared.
        bending: One in which the hand was opened and closed; the same one, or another.
        grasp: Where in that it was.
        calibration: The one in question.
        limit_deg: How far a segment may have moved.

    Returns:
        For each segment with a sensor the larger of two angles [deg]: between how it lies in the
        one before it at the flat hand and how it lay then, and between the axis it bends about and
        the axis then. NaN where its sensor does not answer.
    """
    offs = lying_off(lying, calibration), bending_off(bending, grasp, calibration)
    readings = []
    for segment in calibration.segments:
        if not segment.sensor or segment.name == ROOT[1]:
            continue
        seen = [off[segment.name] for off in offs if segment.name in off]
        value = float(np.rad2deg(max(seen))) if seen else float("nan")
        readings.append(
            Reading("against", value, limit_deg, "deg", at_least=False, about=segment.name)
        )
    return Verdict("check", tuple(readings))


def lying_off(swings: Swings, calibration: SubjectCalibration) -> dict[str, float]:
    """By how much [rad] each segment lies otherwise in the one before it, the hand being flat."""
    turns = lying_turns(swings, calibration)
    return {segment: float(np.linalg.norm(turn)) for segment, turn in turns.items()}


def lying_turns(swings: Swings, calibration: SubjectCalibration) -> dict[str, Array]:
    """The same as rotation vectors [rad], in the segments' frames."""
    known = {segment.name: segment for segment in calibration.segments}
    out = {}
    # a rigid palm is one block, with one frame
    shared = {SEGMENTS.index(ULNAR): SEGMENTS.index("hand")} if calibration.hand_type == 1 else {}
    for index, above in enumerate(PARENTS):
        parent = shared.get(above, above)
        if parent < 0:
            continue
        pair = [known.get(SEGMENTS[k]) for k in (parent, index)]
        base, mine = (None if one is None else _attitude(swings, one) for one in pair)
        if base is not None and mine is not None and pair[1] is not None:
            now = so3.multiply(so3.conjugate(base), mine)
            then = np.array(pair[1].q_parent_rest)
            out[SEGMENTS[index]] = so3.log(so3.multiply(so3.conjugate(then), now))
    return out


def bending_off(swings: Swings, grasp: slice, calibration: SubjectCalibration) -> dict[str, float]:
    """By how much [rad] the axes lie otherwise that segments bend about in a grasp."""
    then = {axis.joint: np.array(axis.axis) for axis in calibration.axes}
    out = {}
    for joint in JOINTS:
        driver = swings.drivers(joint.name)[1]
        if joint.name not in then or driver is None or not _bends(joint.name):
            continue
        swing = Swing(f"{joint.name}:flexion", joint.name, "flexion", grasp, grasp)
        now = flexion_axis(replace(swings, swings=(swing,)), joint.name)
        if now is not None:
            cosine = abs(float(now.seen_from(swings, driver) @ then[joint.name]))
            out[joint.child] = float(np.arccos(min(1.0, cosine)))
    return out


def _attitude(swings: Swings, segment: Segment) -> Array | None:
    """Of a segment at the flat hand by its own sensor, sitting as it sat then."""
    names = swings.layout.names
    if segment.sensor not in names or names.index(segment.sensor) not in swings.alive:
        return None
    q_world_sensor = swings.q_flat(names.index(segment.sensor))
    return so3.multiply(q_world_sensor, np.array(segment.q_sensor_segment))


def _bends(joint: str) -> bool:
    """Whether a grasp turns it about one axis."""
    return joint.endswith(("_pip", "_dip", "_mcp")) and not joint.startswith("thumb")
