"""The second motion of the open take: its hand and its name. Pure."""

from __future__ import annotations

import numpy as np

from app.shown.comparison import SMOOTHED, Comparison
from app.state import State
from app.views.course import GhostView
from app.views.filters import filter_words
from app.views.room import stand_of, standing
from app.words import _
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import SEGMENTS
from handstudio.kinematics import pose_of

_NONE = np.zeros(len(SEGMENTS), dtype=bool)


def choices() -> dict[str, str]:
    """What can be compared with, by name, in words; the empty name: nothing."""
    return {"": _("Nothing"), **filter_words(), SMOOTHED: _("Smoothed take")}


def compared_ghost(state: State) -> GhostView | None:
    """The second hand, pale and in the place of the first; None: there is none."""
    review = state.review
    if review is None or review.comparison is None or review.comparison.fit is None:
        return None
    second, fit = review.comparison, review.comparison.fit
    pose = pose_of(second.setup, second.at(float(review.time_s[review.index])).q_world_sensor, fit)
    single = Pose(pose.q_world_segment[0], pose.t_world_joint[0], pose.t_world_tip[0])
    words = _("pale: {name}").format(name=choices()[second.name])
    return GhostView(fit.skeleton, standing(single, stand_of(state)), _NONE, words, beside=False)


def comparison_words(comparison: Comparison) -> str:
    """What is pale in the picture and dashed in the plots."""
    name = comparison.take or choices()[comparison.name]
    return _("pale and dashed: {name}").format(name=name)
