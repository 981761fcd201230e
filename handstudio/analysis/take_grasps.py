"""The grasps of a take: from a motion of sensors to which, when, and of what size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from handstudio.analysis.grasp_prototypes import ANGLES
from handstudio.analysis.grasps import GraspSegment, grasp_segments
from handstudio.analysis.object_size import ObjectSize, object_size
from handstudio.analysis.writing import Writing
from handstudio.arrays import Array
from handstudio.errors import TakeError
from handstudio.hand.angles import Angle, hand_angles
from handstudio.hand_fit import HandFit, fit_of
from handstudio.kinematics import angles_of, measured_angles, pose_of
from handstudio.layout import Layout
from handstudio.pipeline import Motion
from handstudio.setup import Setup

_BLOCK = 8192  # instants at a time
_LEAST = 0.7  # of the angles that tell grasps apart: with fewer, guessing


@dataclass(frozen=True, slots=True)
class TakenGrasp:
    """A grasp in a take.

    Attributes:
        segment: Which, and when, in seconds from the take's first instant.
        size: Of what was held, where that can be told.
    """

    segment: GraspSegment
    size: ObjectSize | None


def can_tell_grasps(layout: Layout) -> bool:
    """Whether enough of the fingers' angles are measured."""
    return sum(angle is not None for angle in _wanted(layout)) >= _LEAST * len(ANGLES)


def grasps_in(
    setup: Setup,
    motion: Motion,
    start_us: int | None = None,
    fit: HandFit | None = None,
    writings: Sequence[Writing] = (),
) -> list[TakenGrasp]:
    """Every grasp of a motion; times in seconds from ``start_us``, or from the first instant.

    While something is written (``writings``, on the same time axis) the pen is what is held: that
    is none of these classes.

    Raises:
        TakeError: the layout lacks sensors to tell.
    """
    if not can_tell_grasps(setup.layout):
        raise TakeError(
            "Grasps cannot be told: too many fingers are without sensors.",
            "Record with a layout that has sensors on the segments of all fingers.",
        )
    if len(motion) == 0:
        return []
    fit = fit_of(setup) if fit is None else fit
    begin_us = int(motion.time_us[0]) if start_us is None else start_us
    time_s = (motion.time_us - begin_us) * 1e-6
    segments = grasp_segments(time_s, _postures(setup, motion, fit))
    writes = [(float(w.time_s[0]), float(w.time_s[-1])) for w in writings]
    return [
        TakenGrasp(one, _size(setup, motion, time_s, fit, one))
        for one in segments
        if not any(one.hold_s < end and one.release_s > start for start, end in writes)
    ]


def _wanted(layout: Layout) -> list[Angle | None]:
    """The measured ones of `ANGLES`, None for the others."""
    known = set(measured_angles(layout)) if layout.is_hand else set()
    by_name = {angle.name: angle for angle in hand_angles() if angle in known}
    return [by_name.get(name) for name in ANGLES]


def _postures(setup: Setup, motion: Motion, fit: HandFit) -> Array:
    wanted = _wanted(setup.layout)
    columns = [index for index, angle in enumerate(wanted) if angle is not None]
    asked = [angle for angle in wanted if angle is not None]
    out = np.full((len(motion), len(ANGLES)), np.nan)
    for at in range(0, len(motion), _BLOCK):
        part = slice(at, at + _BLOCK)
        out[part, columns] = angles_of(setup, motion[part], asked, fit)
    return out


def _size(
    setup: Setup, motion: Motion, time_s: Array, fit: HandFit, grasp: GraspSegment
) -> ObjectSize | None:
    first, last = np.searchsorted(time_s, [grasp.hold_s, grasp.release_s])
    # what it is told by in the end is a handful of instants
    at = np.unique(np.linspace(first, last, 40).astype(int))
    pose = pose_of(setup, motion.q_world_sensor[at], fit)
    return object_size(grasp.found.name, fit.skeleton, setup.hand.hand_length_m, pose)
