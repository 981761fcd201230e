"""Finding a joint, guided: hold straight, bend, verdict; cutting poses changes nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.maths import so3
from handstudio.simulation.bending import bending
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.subject import subject
from handstudio.simulation.trackers import TrackerErrors, tracked
from handstudio.trackers.methods import METHODS
from handstudio.trackers.track import Track
from handstudio.wizards.joint_course import (
    Begin,
    JointCourse,
    JointPhase,
    Leave,
    Poses,
    advance,
)

METHOD = (METHODS["rolling"], METHODS["steady"])


@pytest.fixture(scope="module")
def told() -> tuple[Track, Track]:
    someone = subject(2)
    trajectory = bending(Actor(someone), "index_dip", 9.0)
    segments = ("index_intermediate", "index_distal")
    upper, lower = tracked(
        someone, trajectory, segments, TrackerErrors(), 2, skin=parse("ideal,slide"), base="hand",
        rate_hz=60.0,
    ).tracks  # fmt: skip
    return upper, lower


def _part(track: Track, part: slice) -> Track:
    return Track(
        track.name,
        track.time_us[part],
        track.t_room_terminal[part],
        track.q_room_terminal[part],
        track.quality[part],
    )


def _run(told: tuple[Track, Track], chunk: int) -> tuple[JointCourse, list[JointPhase]]:
    course = advance(JointCourse(methods=METHOD, bend_s=8.0), Begin())
    phases = [course.phase]
    for start in range(0, len(told[0].time_us), chunk):
        part = slice(start, start + chunk)
        course = advance(course, Poses(*(_part(track, part) for track in told)))
        phases.append(course.phase)
    return course, phases


def test_straight_then_bent_then_a_joint(told: tuple[Track, Track]) -> None:
    course, phases = _run(told, 10)
    assert list(dict.fromkeys(phases)) == [
        JointPhase.STRAIGHT,
        JointPhase.BENDING,
        JointPhase.VERDICT,
    ]
    assert course.study is not None
    assert course.study.ok, course.study.poor
    assert course.moved == 0


def test_cutting_the_poses_otherwise_changes_no_digit(told: tuple[Track, Track]) -> None:
    one, other = _run(told, 7)[0].study, _run(told, 1000)[0].study
    assert one is not None
    assert other is not None
    a, b = one.found["rolling"].estimate, other.found["rolling"].estimate
    np.testing.assert_array_equal(a.p_upper, b.p_upper)
    np.testing.assert_array_equal(one.class_counts, other.class_counts)


def test_a_finger_that_moves_while_held_straight_is_begun_anew(told: tuple[Track, Track]) -> None:
    upper, lower = told
    q = lower.q_room_terminal.copy()
    q[60:90] = so3.multiply(q[60:90], so3.exp(np.array([0.3, 0.0, 0.0])))
    course = advance(JointCourse(methods=METHOD, bend_s=8.0), Begin())
    course = advance(
        course,
        Poses(_part(upper, slice(185)), _part(replace(lower, q_room_terminal=q), slice(185))),
    )
    assert course.phase is JointPhase.STRAIGHT
    assert course.moved == 2
    assert course.done_s == pytest.approx((185 - 1 - 90) / 60.0, abs=0.02)


def test_a_finger_that_is_never_bent_is_refused_with_what_to_do(told: tuple[Track, Track]) -> None:
    rest = [_part(track, slice(175)) for track in told]
    course = advance(JointCourse(methods=METHOD, bend_s=2.0), Begin())
    for turn in range(3):
        later = [replace(each, time_us=each.time_us + turn * 3_000_000) for each in rest]
        course = advance(course, Poses(*later))
    assert course.phase is JointPhase.VERDICT
    assert course.study is None
    assert course.refused is not None
    assert "Bend it further" in course.refused.remedy


def test_it_can_be_left_and_begun_anew(told: tuple[Track, Track]) -> None:
    course, _ = _run(told, 100)
    assert advance(course, Leave()).phase is JointPhase.INTRO
    again = advance(course, Begin())
    assert again.phase is JointPhase.STRAIGHT
    assert again.study is None
    assert advance(JointCourse(), Poses(*told)).phase is JointPhase.INTRO
