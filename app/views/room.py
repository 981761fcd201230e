"""Where the hand of the open take stands in the picture: at its elbow, or in a room. Pure.

The picture is the world that stands still in the tracker's room (`handstudio.way`), turned about
the vertical.
"""

from __future__ import annotations

import numpy as np

from app.shown.look import Camera
from app.shown.review import Review
from app.state import State
from app.words import _
from handstudio.analysis.writing import Writing
from handstudio.hand.pose import Pose
from handstudio.maths import so3
from handstudio.way import Stand, Way

_ROOM_ENOUGH = 1.1  # of the way's extent, by which the desk is seen from farther away


def stand_of(state: State) -> Stand:
    """Where the hand stands now."""
    way = _way(state.review, state)
    if way is None or state.review is None:
        return _turned(Stand(so3.IDENTITY, np.zeros(3)), state)
    return _turned(way.at(state.review.index), state)


def stand_of_writing(state: State, writing: Writing) -> Stand:
    """Where the elbow rested while something was written: ink stays where it was put."""
    way = _way(state.review, state)
    if way is None or state.review is None:
        return stand_of(state)
    first, last = np.searchsorted(state.review.time_s, writing.time_s[[0, -1]])
    return _turned(way.middle(int(first), int(last)), state)


def standing(pose: Pose, stand: Stand) -> Pose:
    """A single pose where it stands."""
    q, t = stand.q_still_world, stand.t_still_elbow
    return Pose(
        so3.multiply(q, pose.q_world_segment),
        so3.rotate(q, pose.t_world_joint) + t,
        so3.rotate(q, pose.t_world_tip) + t,
    )


def floor_m(state: State) -> float:
    """How much lower than else the floor lies: nothing of the way goes through it."""
    way = _way(state.review, state)
    return 0.0 if way is None else float(min(way.low[2], 0.0))


def overlooking(camera: Camera, state: State) -> Camera:
    """A camera that sees where the elbow is at first, so that it sees the whole way."""
    way = _way(state.review, state)
    if way is None:
        return camera
    middle = so3.rotate(so3.about_z(state.yaw or 0.0), 0.5 * (way.low + way.high))
    towards = camera.place - camera.target
    near = float(np.linalg.norm(towards))
    extent = 0.5 * float(np.linalg.norm(way.high - way.low))
    farther = 1.0 + _ROOM_ENOUGH * extent / near
    target = camera.target + middle
    return Camera(target + farther * towards, target, camera.up)


def room_words(state: State) -> str:
    """That the hand is seen in a room, and whether its place there is known."""
    review = state.review
    way = _way(review, state)
    if way is None or review is None:
        return ""
    if way.at(review.index).known:
        return _("in the tracker's room")
    return _("place unknown, held")


def _way(review: Review | None, state: State) -> Way | None:
    return review.way if review is not None and state.settings.shown.room else None


def _turned(stand: Stand, state: State) -> Stand:
    turn = so3.about_z(state.yaw or 0.0)
    return Stand(
        so3.multiply(turn, stand.q_still_world),
        so3.rotate(turn, stand.t_still_elbow),
        stand.known,
    )
