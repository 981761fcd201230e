"""A pen followed through the true segments of virtual hands, and its parts on made-up numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from handstudio.analysis.pen_down import pen_down, strokes
from handstudio.analysis.pen_grip import PenMotion, held, pen_hand, placements
from handstudio.analysis.pen_tip import pen_tip
from handstudio.analysis.trace_error import trace_error
from handstudio.analysis.writing import Writing, writings
from handstudio.hand.pose import Pose
from handstudio.maths import so3
from handstudio.recording.material import material
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.rig import hand_at
from handstudio.simulation.subject import Subject, subject
from handstudio.simulation.things import Things, things_held
from handstudio.simulation.world import World

RATE_HZ = 100


@dataclass(frozen=True)
class Performed:
    someone: Subject
    time_s: np.ndarray
    pose: Pose
    things: Things
    true: np.ndarray


@cache
def performed(motion: str, side: str = "right") -> Performed:
    someone = subject(2, side)
    trajectory = perform(motion, Actor(someone, 2, material()))
    time_s = np.arange(0.0, trajectory.duration_s, 1.0 / RATE_HZ)
    _, segments = hand_at(someone, trajectory, time_s, World())
    time_us = np.round(time_s * 1e6).astype(int)
    things = things_held(trajectory, time_us, segments.q, segments.t)
    tips = np.zeros((len(time_s), 5, 3))
    pose = Pose(segments.q, segments.t, tips)
    return Performed(someone, time_s, pose, things, things.t_world_held - segments.t[:, 0])


def found(performed: Performed, pose: Pose | None = None) -> list[Writing]:
    someone = performed.someone
    pose = performed.pose if pose is None else pose
    return writings(pen_hand(someone.skeleton, someone.hand_length_m, performed.time_s, pose))


def error_mm(performed: Performed, writing: Writing) -> float:
    at = np.searchsorted(performed.time_s, writing.time_s)
    down = performed.things.pen_down[at]
    return 1e3 * trace_error(writing.flat[down], performed.true[at][down, :2]).rmse_m


def test_a_character_is_found_where_it_was_written():
    truth = performed("writing:大")
    (writing,) = found(truth)
    at = np.searchsorted(truth.time_s, writing.time_s)
    down = truth.things.pen_down[at]
    assert error_mm(truth, writing) < 0.8
    assert len(writing.strokes) == 3
    assert (down & ~writing.down).sum() < 0.03 * down.sum()
    assert (writing.down & ~down).sum() < 0.15 * writing.down.sum()
    assert np.rad2deg(np.arccos(writing.plane.normal[2])) < 1.5
    assert abs(trace_error(writing.flat[down], truth.true[at][down, :2]).scale - 1.0) < 0.06


def test_the_pen_points_to_its_end_and_its_tip_lies_on_the_plane():
    truth = performed("writing:大")
    (writing,) = found(truth)
    at = np.searchsorted(truth.time_s, writing.time_s)
    end = so3.rotate(truth.things.q_world_held[at], np.array([0.0, 0.0, 1.0]))
    off = np.rad2deg(np.arccos(np.sum(writing.direction * end, axis=-1)))
    assert np.nanmedian(off) < 20.0  # its direction hangs on three points 10 mm apart
    assert np.ptp(off[np.isfinite(off)]) < 8.0
    np.testing.assert_allclose(writing.plane.height(writing.on_plane), 0.0, atol=1e-12)


def test_on_a_desk_at_a_slope_the_trace_is_the_same():
    truth = performed("writing:大")
    (level,) = found(truth)
    turn = so3.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.deg2rad(20.0))
    sloping = Pose(
        so3.multiply(turn, truth.pose.q_world_segment),
        so3.rotate(turn, truth.pose.t_world_joint),
        so3.rotate(turn, truth.pose.t_world_tip),
    )
    (writing,) = found(truth, sloping)
    # of 20 mm of page the slope itself is hard to tell from where the tip is in the pen
    assert np.rad2deg(np.arccos(writing.plane.normal[2])) > 5.0
    assert error_mm(truth, writing) < 1.5
    assert len(writing.strokes) == len(level.strokes)


@pytest.mark.parametrize("motion", ["open_close", "scissors"])
def test_nothing_is_read_into_what_is_no_writing(motion):
    assert found(performed(motion)) == []


def test_a_pen_that_is_held_still_writes_nothing():
    truth = performed("writing:大")
    pose, still = truth.pose, np.full(len(truth.time_s), len(truth.time_s) // 2)
    held_still = Pose(pose.q_world_segment[still], pose.t_world_joint[still], pose.t_world_tip)
    assert found(truth, held_still) == []


def test_fingers_that_go_to_and_fro_along_a_line_write_nothing():
    truth = performed("writing:大")
    pose, still = truth.pose, np.full(len(truth.time_s), len(truth.time_s) // 2)
    rng = np.random.default_rng(0)
    along = 0.04 * np.sin(4.0 * truth.time_s)[:, None] * np.array([0.6, 0.8, 0.0])
    shaking = 0.0003 * rng.standard_normal((len(still), 3))
    joints = pose.t_world_joint[still].copy()
    joints[:, 1:] += (along + shaking)[:, None]  # from the elbow
    moved = Pose(pose.q_world_segment[still], joints, pose.t_world_tip)
    assert found(truth, moved) == []


def test_no_instant_holds_no_pen():
    truth = performed("writing:大")
    hand = pen_hand(truth.someone.skeleton, 0.187, truth.time_s, truth.pose)
    assert held(hand.part(slice(0, 0))) == []
    assert held(hand.part(slice(0, 1))) == []


def wobbling(seed: int, count: int = 600) -> PenMotion:
    """A pen of known tip that writes on a known plane, lifted a third of the time."""
    rng = np.random.default_rng(seed)
    time = np.arange(count) / RATE_HZ
    turns = sum(
        np.outer(np.sin(rng.uniform(3, 9) * time + rng.uniform(0, 6)), rng.normal(0, 0.12, 3))
        for _ in range(4)
    )
    attitude = so3.to_matrix(so3.exp(turns))
    normal = so3.rotate(so3.exp(np.array([0.15, -0.2, 0.0])), np.array([0.0, 0.0, 1.0]))
    flat = np.stack([0.05 * np.sin(1.3 * time), 0.3 + 0.02 * np.sin(5.0 * time)], axis=-1)
    z = (-0.03 - flat @ normal[:2]) / normal[2]
    tip = np.concatenate([flat, z[:, None]], axis=1)
    tip += 0.005 * np.maximum(np.sin(4.0 * time) - 0.5, 0.0)[:, None] * normal
    own = np.array([0.001, -0.003, -0.029])
    return PenMotion(attitude, tip - attitude @ own, np.array([0.0, 0.0, -1.0]), 0.0)


def test_tip_and_plane_come_from_the_height_alone():
    for seed in range(5):
        motion = wobbling(seed)
        tip = pen_tip(motion)
        np.testing.assert_allclose(tip.own, [0.001, -0.003, -0.029], atol=0.0015)
        tilt = np.rad2deg(np.arccos(tip.plane.normal[2]))
        assert tilt == pytest.approx(np.rad2deg(np.hypot(0.15, 0.2)), abs=1.0)
        assert np.median(np.abs(tip.height_m)) < 2e-4
        assert (tip.own_sd_m > 0.0).all()


def test_lifting_ends_a_stroke_and_resting_on_paper_is_none():
    time = np.arange(400) / RATE_HZ
    height = np.where((time > 1.0) & (time < 1.3), 0.005, 0.0)
    height = height + 0.0008 * np.sin(0.8 * time)  # drifts
    along = np.stack([0.02 * np.clip(time, 0.0, 3.0), np.zeros(400)], axis=-1)
    down = pen_down(height, along, 1.0 / RATE_HZ)
    first, second = strokes(down)
    assert first.start == 0
    assert first.stop == pytest.approx(100, abs=3)
    assert second.start == pytest.approx(130, abs=3)
    # a touch that goes nowhere
    height[(time > 3.2) & (time < 3.4)] = 0.005
    down = pen_down(height, along, 1.0 / RATE_HZ)
    assert len(strokes(down)) == 2


def test_a_rigid_body_is_placed_where_its_points_are():
    rng = np.random.default_rng(0)
    own = rng.normal(size=(3, 3))
    own -= own.mean(axis=0)
    q, t = so3.normalize(rng.normal(size=(20, 4))), rng.normal(size=(20, 3))
    points = so3.rotate(q[:, None], own) + t[:, None]
    attitude, middle = placements(points, own)
    np.testing.assert_allclose(attitude, so3.to_matrix(q), atol=1e-12)
    np.testing.assert_allclose(middle, t, atol=1e-12)


def test_the_error_of_a_trace_is_blind_to_similarities_only():
    rng = np.random.default_rng(0)
    true = rng.normal(size=(50, 2))
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    same = trace_error(1.7 * true @ turn.T + [3.0, -1.0], true)
    assert same.rmse_m < 1e-12
    assert same.scale == pytest.approx(1.0 / 1.7)
    assert trace_error(true * [1.0, -1.0], true).rmse_m > 0.5  # mirrored is not similar
    moved = true.copy()
    moved[0] += 1.0
    assert trace_error(moved, true).rmse_m > 0.05


def test_a_line_of_a_left_hand_is_set_level():
    truth = performed("writing:一", "left")
    (writing,) = found(truth)
    assert error_mm(truth, writing) < 0.8
    stroke = writing.flat[writing.down]
    slope = np.polyfit(stroke[:, 0], stroke[:, 1], 1)[0]
    assert abs(np.rad2deg(np.arctan(slope))) < 3.0
    assert stroke[-1, 0] > stroke[0, 0]  # written to the right
    way = np.ptp(truth.true[truth.things.pen_down], axis=0)
    assert writing.length_m == pytest.approx(np.linalg.norm(way), abs=0.003)
