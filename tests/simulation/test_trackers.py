"""Virtual trackers: true without errors, and each error what it says."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.hand.skeleton import SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.bending import bending, hinge_only
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.subject import subject, with_fixed_axes
from handstudio.simulation.trackers import (
    Metal,
    Tracked,
    TrackerErrors,
    bent_by_metal,
    terminals_on,
    tracked,
)
from handstudio.trackers.poses import placed

PAIR = ("index_intermediate", "index_distal")
NONE = TrackerErrors(noise_m=0.0, noise_rad=0.0)


def _tracked(errors: TrackerErrors = NONE, **how: object) -> Tracked:
    someone = subject(3)
    trajectory = bending(Actor(someone), "index_dip", 4.0)
    return tracked(someone, trajectory, PAIR, errors, 3, rate_hz=60.0, **how)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def true() -> Tracked:
    return _tracked(skin=parse("ideal,mounting"))


def test_without_errors_terminals_are_where_they_were_put(true: Tracked) -> None:
    mounting = terminals_on(subject(3), PAIR, 3)
    for index, name in enumerate(PAIR):
        segment = SEGMENTS.index(name)
        q = true.q_room_segment[:, segment]
        t = placed(q, true.t_room_joint[:, segment], mounting.t_segment_sensor[index])
        np.testing.assert_allclose(true.tracks[index].t_room_terminal, t, atol=1e-12)
        expected = so3.multiply(q, mounting.q_segment_sensor[index])
        assert so3.angle_between(true.tracks[index].q_room_terminal, expected).max() < 1e-7


def test_a_seed_is_one_tracker_on_one_person() -> None:
    errors = TrackerErrors(lost=0.1, knocked=0.1)
    one, same = _tracked(errors), _tracked(errors)
    np.testing.assert_array_equal(one.tracks[0].t_room_terminal, same.tracks[0].t_room_terminal)
    other = _tracked(errors, performance=1)
    assert not np.array_equal(
        one.tracks[0].t_room_terminal, other.tracks[0].t_room_terminal, equal_nan=True
    )


def test_where_the_transmitter_is_does_not_change_how_terminals_lie_to_one_another(
    true: Tracked,
) -> None:
    carried = _tracked(skin=parse("ideal,mounting"), base="hand")
    for here, there in ((true, carried),):
        a = np.linalg.norm(np.subtract(*(t.t_room_terminal for t in here.tracks)), axis=1)
        b = np.linalg.norm(np.subtract(*(t.t_room_terminal for t in there.tracks)), axis=1)
        np.testing.assert_allclose(a, b, atol=1e-12)
    # on the palm, fingers are within the reach of a small transmitter
    assert np.linalg.norm(carried.tracks[1].t_room_terminal, axis=1).max() < 0.25


def test_noise_is_as_large_as_it_says(true: Tracked) -> None:
    noisy = _tracked(TrackerErrors(2e-4, 0.003), skin=parse("ideal,mounting"))
    off = noisy.tracks[0].t_room_terminal - true.tracks[0].t_room_terminal
    assert np.std(off) == pytest.approx(2e-4, rel=0.1)
    turned = so3.angle_between(noisy.tracks[0].q_room_terminal, true.tracks[0].q_room_terminal)
    assert np.sqrt(np.mean(turned**2) / 3.0) == pytest.approx(0.003, rel=0.1)


def test_a_late_tracker_tells_the_same_later(true: Tracked) -> None:
    late = _tracked(TrackerErrors(0.0, 0.0, late_s=0.05), skin=parse("ideal,mounting"))
    np.testing.assert_array_equal(late.tracks[0].time_us - true.tracks[0].time_us, 50_000)
    np.testing.assert_array_equal(late.tracks[0].t_room_terminal, true.tracks[0].t_room_terminal)


def test_drop_outs_take_the_share_of_time_that_they_should() -> None:
    shares = []
    for performance in range(8):
        track = _tracked(TrackerErrors(lost=0.2, lost_for_s=0.1), performance=performance).tracks[0]
        gone = np.isnan(track.t_room_terminal).any(axis=1)
        np.testing.assert_array_equal(gone, track.quality == 0.0)
        shares.append(gone.mean())
    assert 0.12 < np.mean(shares) < 0.28


def test_knocks_take_a_tenth_of_the_time_and_leave_the_rest_alone(true: Tracked) -> None:
    errors = TrackerErrors(0.0, 0.0, knocked=0.1)
    off = []
    for performance in range(4):
        knocked = _tracked(errors, skin=parse("ideal,mounting"), performance=performance)
        for told, was in zip(knocked.tracks, true.tracks, strict=True):
            off.append(np.linalg.norm(told.t_room_terminal - was.t_room_terminal, axis=1))
    assert 0.02 < np.mean(np.concatenate(off) > 1e-3) < 0.25
    assert np.median(np.concatenate(off)) < 1e-4


def test_metal_far_away_bends_little_and_near_much() -> None:
    rng = np.random.default_rng(1)
    t = np.array([0.15, 0.0, 0.05]) + 0.02 * rng.standard_normal((50, 3))
    q = so3.normalize(rng.standard_normal((50, 4)))
    near, far = (
        np.linalg.norm(bent_by_metal(t, q, (Metal((0.2, y, 0.0), 0.02),))[0] - t, axis=1).max()
        for y in (0.1, 0.4)
    )
    assert near > 1e-4
    assert far < 0.02 * near


def test_a_hinge_of_wood_turns_about_one_axis() -> None:
    someone = with_fixed_axes(subject(3))
    trajectory = hinge_only(bending(Actor(someone), "index_dip", 4.0), "index_dip")
    told = tracked(someone, trajectory, PAIR, NONE, 3, rate_hz=60.0, base="hand")
    upper, lower = (SEGMENTS.index(name) for name in PAIR)
    relative = so3.multiply(
        so3.conjugate(told.q_room_segment[:, upper]), told.q_room_segment[:, lower]
    )
    turn = so3.log(so3.multiply(relative, so3.conjugate(relative[:1])))
    singular = np.linalg.svd(turn, compute_uv=False)
    assert singular[1] < 1e-9 * singular[0]
    assert np.ptp(told.q_room_segment[:, upper], axis=0).max() < 1e-12


def test_the_straight_finger_comes_first_and_its_spans_are_named(true: Tracked) -> None:
    names = [name for _, _, name in true.spans]
    assert names == ["straight", "index_dip:flexion"]
    assert true.spans[0][:2] == (0.0, 3.0)
