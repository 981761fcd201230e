"""What is written and held, where it stands in the picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from app import review as reviewing
from app.review import Review
from app.state import State
from app.views.held import held_view
from app.views.page import HandView, scene_of
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
