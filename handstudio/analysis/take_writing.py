"""What was written in a take: from a motion of sensors to traces of a pen."""

from __future__ import annotations

import numpy as np

from handstudio.analysis.pen_grip import HOLDING, PenHand, pen_hand
from handstudio.analysis.writing import Writing, writings
from handstudio.errors import TakeError
from handstudio.hand_fit import HandFit, fit_of
from handstudio.kinematics import pose_of
from handstudio.layout import Layout
from handstudio.pipeline import Motion
from handstudio.setup import Setup

_BLOCK = 8192  # instants placed at a time: a whole hand takes more memory than what is kept of it
_NEEDED = tuple(f"{f}_{p}" for f in HOLDING for p in ("proximal", "intermediate", "distal"))


def can_tell_writing(layout: Layout) -> bool:
    """Whether a pen can be followed: every phalanx of the fingers that hold it has a sensor."""
    wanted = {"forearm", "hand", *(name for name in _NEEDED if name != "thumb_intermediate")}
    return layout.is_hand and wanted <= set(layout.drivers)


def writings_in(
    setup: Setup, motion: Motion, start_us: int | None = None, fit: HandFit | None = None
) -> list[Writing]:
    """Everything that was written; times in seconds from ``start_us``, or from the first instant.

    Raises:
        TakeError: the layout lacks sensors to tell.
    """
    if not can_tell_writing(setup.layout):
        raise TakeError(
            "A pen cannot be followed: sensors on thumb, index or middle finger are missing.",
            "Record with a layout that has a sensor on every segment of these.",
        )
    if len(motion) == 0:
        return []
    begin_us = int(motion.time_us[0]) if start_us is None else start_us
    return writings(_hand(setup, motion, begin_us, fit_of(setup) if fit is None else fit))


def _hand(setup: Setup, motion: Motion, start_us: int, fit: HandFit) -> PenHand:
    parts = []
    for at in range(0, len(motion), _BLOCK):
        part = motion[at : at + _BLOCK]
        time_s = (part.time_us - start_us) * 1e-6
        pose = pose_of(setup, part.q_world_sensor, fit)
        parts.append(pen_hand(fit.skeleton, setup.hand.hand_length_m, time_s, pose))
    return PenHand(
        np.concatenate([part.time_s for part in parts]),
        np.concatenate([part.attitude for part in parts]),
        np.concatenate([part.place for part in parts]),
        np.concatenate([part.knuckle for part in parts]),
        parts[0].pads,
    )
