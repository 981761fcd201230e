"""What is written and held, where it stands in the picture."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from app.shown import review as reviewing
from app.shown.comparison import compared
from app.shown.look import FIELD_RAD
from app.shown.review import Review
from app.state import State
from app.views.comparison import compared_ghost
from app.views.held import held_view
from app.views.page import HandView, camera_of, caption_of, scene_of
from app.views.room import stand_of, standing
from app.views.written import trace_view
from handstudio.analysis.grasps import GraspSegment, Recognised
from handstudio.analysis.object_size import ObjectSize
from handstudio.analysis.pen_tip import Plane
from handstudio.analysis.take_grasps import TakenGrasp
from handstudio.analysis.writing import Writing
from handstudio.arrays import Array
from handstudio.finds import Found
from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3
from handstudio.recording.take import Take
from handstudio.way import Way

HAND = SEGMENTS.index("hand")


@pytest.fixture
def state(take: Take, review: Review) -> State:
    return State(take.path.parents[2], review=review)


def holding(state: State, size: ObjectSize | None, at_s: float) -> State:
    known = Recognised("power_sphere", "Power Sphere", 0.97, 0.4, "tripod")
    grasp = TakenGrasp(GraspSegment(known, 1.0, 2.0, 6.0, 7.0), size)
    assert state.review is not None
    review = reviewing.sought(replace(state.review, found=Found((), (grasp,))), at_s)
    return replace(state, review=review)


def in_the_hand(state: State) -> tuple[Array, Array]:
    """The middle of what is held and its z, seen from the hand."""
    hand = scene_of(state)
    view = held_view(state, hand)
    assert view is not None
    assert isinstance(hand, HandView)
    back = so3.conjugate(hand.pose.q_world_segment[HAND])
    middle = so3.rotate(back, view.t_world_held - hand.pose.t_world_joint[HAND])
    return middle, so3.rotate(so3.multiply(back, view.q_world_held), np.array([0.0, 0.0, 1.0]))


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.6, 0.0, -0.8], [0.0, 0.0, 1.0]])
def test_what_is_held_goes_where_the_hand_goes(state: State, axis: list[float]) -> None:
    middle = np.array([0.01, 0.08, -0.05])
    bar = ObjectSize("cylinder", 0.05, 0.0, 0.0, middle, np.array(axis))
    for at_s in (2.0, 3.3, 5.0):
        there, along = in_the_hand(holding(state, bar, at_s))
        np.testing.assert_allclose(there, middle, atol=1e-9)
        np.testing.assert_allclose(abs(along @ axis), 1.0, atol=1e-9)
        view = held_view(holding(state, bar, at_s), scene_of(holding(state, bar, at_s)))
        assert view is not None
        assert (view.radius_m, view.length_m > 0.1) == (0.025, True)


def test_nothing_is_held_before_and_after_nor_without_a_size(state: State) -> None:
    ball = ObjectSize("sphere", 0.075, 0.0, 0.0, np.zeros(3), np.array([1.0, 0.0, 0.0]))
    for at_s, size in ((1.5, ball), (6.5, ball), (3.0, None)):
        now = holding(state, size, at_s)
        assert held_view(now, scene_of(now)) is None
    now = holding(state, ball, 3.0)
    view = held_view(now, scene_of(now))
    assert view is not None
    assert view.length_m == 0.0


def test_desk_and_page_lie_on_the_plane_that_was_found_before_anything_is_written(
    state: State,
) -> None:
    time_s, flat = np.linspace(3.0, 5.0, 9), np.linspace([-0.02, 0.0], [0.02, 0.01], 9)
    normal = np.array([0.0, 0.6, 0.8])
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, -0.6]])
    plane, origin = Plane(normal, -0.05), -0.05 * normal
    tip = origin + flat @ axes
    wrote = Writing(
        *(time_s, tip, tip, np.ones(9, dtype=bool), plane, axes, flat, origin),
        *(0.0, 0.0, np.zeros(3)),
    )
    assert state.review is not None
    review = replace(state.review, found=Found((wrote,), ()))
    before = trace_view(replace(state, review=reviewing.sought(review, 1.0)))
    after = trace_view(replace(state, review=reviewing.sought(review, 6.0)))
    assert before is not None
    assert after is not None
    assert (before.count, after.count) == (0, 8)
    for corners in (before.desk, before.page):
        np.testing.assert_allclose(plane.height(corners), 0.0, atol=1e-12)
    wide = np.linalg.norm(before.desk[1] - before.desk[0])
    assert wide > np.linalg.norm(before.page[1] - before.page[0]) > 0.04


def in_a_room(state: State) -> State:
    """The elbow goes to the right by a metre in 8 s, from 4 s on nobody knows where it is."""
    review = state.review
    assert review is not None
    rows = np.zeros((len(review.time_s), 8))
    rows[:, 0], rows[:, 4] = 1.0, np.minimum(review.time_s / 8.0, 0.5)
    rows[:, 7] = review.time_s < 4.0
    way = Way(rows, rows[:, 4:7].min(axis=0), rows[:, 4:7].max(axis=0))
    return replace(state, review=replace(review, way=way), yaw=np.pi / 2)


def at(state: State, at_s: float) -> State:
    assert state.review is not None
    return replace(state, review=reviewing.sought(state.review, at_s))


def test_in_a_room_the_hand_goes_where_the_tracker_saw_it_and_ink_stays(state: State) -> None:
    roomy = in_a_room(state)
    for at_s, away_m in ((0.0, 0.0), (2.0, 0.25), (6.0, 0.5)):
        there = stand_of(at(roomy, at_s)).t_still_elbow
        np.testing.assert_allclose(there, [0.0, away_m, 0.0], atol=0.002)  # turned as the picture
    assert caption_of(at(roomy, 2.0)).endswith("in the tracker's room")
    assert caption_of(at(roomy, 6.0)).endswith("place unknown, held")
    time_s, flat = np.linspace(1.0, 3.0, 9), np.linspace([-0.02, 0.0], [0.02, 0.01], 9)
    plane, axes = Plane(np.array([0.0, 0.0, 1.0]), 0.0), np.eye(3)[:2]
    wrote = Writing(
        *(time_s, flat @ axes, flat @ axes, np.ones(9, dtype=bool), plane, axes, flat),
        *(np.zeros(3), 0.0, 0.0, np.zeros(3)),
    )
    assert roomy.review is not None
    roomy = replace(roomy, review=replace(roomy.review, found=Found((wrote,), ())))
    for at_s in (0.0, 6.0):
        trace = trace_view(at(roomy, at_s))
        assert trace is not None
        np.testing.assert_allclose(trace.stand.t_still_elbow, [0.0, 0.25, 0.0], atol=0.005)
    shown = msgspec.structs.replace(roomy.settings.shown, room=False)
    kept = msgspec.structs.replace(roomy.settings, shown=shown)
    without = at(replace(roomy, settings=kept), 2.0)
    np.testing.assert_array_equal(stand_of(without).t_still_elbow, 0.0)
    assert "room" not in caption_of(without)


def test_in_a_room_a_hand_to_compare_with_stands_where_the_first_does(state: State) -> None:
    roomy = at(in_a_room(state), 6.0)
    review = roomy.review
    assert review is not None
    second = compared("raw", review.setup, review.motion)
    roomy = replace(roomy, review=replace(review, comparison=second))
    ghost, hand = compared_ghost(roomy), scene_of(roomy)
    assert ghost is not None
    assert isinstance(hand, HandView)
    first = standing(hand.pose, stand_of(roomy))
    np.testing.assert_allclose(ghost.pose.t_world_joint, first.t_world_joint, atol=1e-9)


def test_from_the_desk_the_whole_way_is_seen(state: State) -> None:
    roomy = in_a_room(state)
    camera = camera_of(roomy, scene_of(roomy))
    ahead = (camera.target - camera.place) / np.linalg.norm(camera.target - camera.place)
    for at_s in (0.0, 2.0, 6.0):
        now = at(roomy, at_s)
        hand = scene_of(now)
        assert isinstance(hand, HandView)
        towards = standing(hand.pose, stand_of(now)).t_world_tip - camera.place
        off = np.arccos(towards @ ahead / np.linalg.norm(towards, axis=1))
        assert off.max() < 0.5 * FIELD_RAD
