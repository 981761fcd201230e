"""Bad tracks: each fault is recognised, said with what to do, and survived or refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.findings import checked, checked_pair
from handstudio.trackers.methods import METHODS
from handstudio.trackers.said import said
from handstudio.trackers.study import JointStudy, study
from handstudio.trackers.track import Track

from .hinges import Hinge

PLANE = (METHODS["plane"], METHODS["symmetric"])


def _study(upper: Track, lower: Track) -> JointStudy:
    return study(upper, lower, methods=PLANE)


def _kinds(found: JointStudy) -> set[str]:
    return {finding.kind for finding in found.findings}


def _near(found: JointStudy, hinge: Hinge) -> None:
    """The joint is found all the same, but along the hinge."""
    off = found.found["plane"].estimate.p_upper - hinge.centre_upper
    off = off - hinge.axis_upper * (hinge.axis_upper @ off)
    assert np.linalg.norm(off) < 3e-4


def test_a_good_track_has_nothing_wrong(noisy: Hinge) -> None:
    found = _study(noisy.upper, noisy.lower)
    assert found.findings == ()
    assert found.ok
    _near(found, noisy)


def test_a_frozen_tracker_is_told_and_its_frames_left_out(noisy: Hinge) -> None:
    t, q = noisy.lower.t_room_terminal.copy(), noisy.lower.q_room_terminal.copy()
    t[400:520], q[400:520] = t[400], q[400]
    found = _study(noisy.upper, replace(noisy.lower, t_room_terminal=t, q_room_terminal=q))
    assert _kinds(found) == {"frozen"}
    assert found.findings[0].amount == pytest.approx(119 / 60.0, abs=0.02)
    assert found.frames == len(t) - 180 - 120
    _near(found, noisy)
    assert "plug" in said(found.findings[0]).remedy


def test_a_tracker_that_froze_for_good_is_refused(noisy: Hinge) -> None:
    t, q = noisy.lower.t_room_terminal.copy(), noisy.lower.q_room_terminal.copy()
    t[:], q[:] = t[0], q[0]
    with pytest.raises(TrackError, match="same pose"):
        _study(noisy.upper, replace(noisy.lower, t_room_terminal=t, q_room_terminal=q))


def test_a_jump_to_the_other_hemisphere_is_put_back(noisy: Hinge) -> None:
    t = noisy.lower.t_room_terminal.copy()
    t[300:390] *= -1.0
    t[700:] *= -1.0
    bad = replace(noisy.lower, t_room_terminal=t)
    mended = checked(bad).track.t_room_terminal
    np.testing.assert_array_equal(mended, noisy.lower.t_room_terminal)
    found = _study(noisy.upper, bad)
    assert _kinds(found) == {"hemisphere"}
    assert found.findings[0].amount == 3
    assert found.findings[0].made_good
    _near(found, noisy)


def test_a_terminal_upside_down_is_said_and_the_joint_found(noisy: Hinge) -> None:
    over = so3.from_axis_angle(np.array([0.0, 1.0, 0.0]), np.pi)
    bad = replace(noisy.upper, q_room_terminal=so3.multiply(noisy.upper.q_room_terminal, over))
    found = _study(bad, noisy.lower)
    assert _kinds(found) == {"upside_down"}
    place = so3.rotate(over, found.found["plane"].estimate.p_upper)
    off = place - noisy.centre_upper
    assert np.linalg.norm(off - noisy.axis_upper * (noisy.axis_upper @ off)) < 3e-4


@pytest.mark.parametrize("time", ["zero", "backwards"])
def test_a_track_without_a_clock_is_refused_and_told_why(noisy: Hinge, time: str) -> None:
    time_us = noisy.upper.time_us
    bad = np.zeros_like(time_us) if time == "zero" else time_us[::-1].copy()
    upper, lower = (replace(track, time_us=bad) for track in (noisy.upper, noisy.lower))
    with pytest.raises(TrackError, match="not later") as told:
        _study(upper, lower)
    assert "time column" in told.value.remedy


def test_swapped_terminals_are_told_and_the_joint_is_the_same(noisy: Hinge) -> None:
    right, swapped = _study(noisy.upper, noisy.lower), _study(noisy.lower, noisy.upper)
    assert _kinds(swapped) == {"swapped"}
    for name in ("plane", "symmetric"):
        one, other = right.found[name].estimate, swapped.found[name].estimate
        off = one.p_upper - other.p_lower
        off = off - noisy.axis_upper * (noisy.axis_upper @ off)
        assert np.linalg.norm(off) < 3e-4


def test_terminals_that_exchange_places_midway_are_exchanged_back(noisy: Hinge) -> None:
    def crossed(a: Track, b: Track) -> Track:
        t, q = a.t_room_terminal.copy(), a.q_room_terminal.copy()
        t[500:640], q[500:640] = b.t_room_terminal[500:640], b.q_room_terminal[500:640]
        return replace(a, t_room_terminal=t, q_room_terminal=q)

    one, other, found = checked_pair(
        crossed(noisy.upper, noisy.lower), crossed(noisy.lower, noisy.upper)
    )
    assert [finding.kind for finding in found] == ["exchanged"]
    np.testing.assert_array_equal(one.track.t_room_terminal, noisy.upper.t_room_terminal)
    np.testing.assert_array_equal(other.track.q_room_terminal, noisy.lower.q_room_terminal)


def test_drop_outs_are_told_and_survived(noisy: Hinge) -> None:
    t, quality = noisy.lower.t_room_terminal.copy(), noisy.lower.quality.copy()
    gone = np.arange(len(t)) % 7 == 3
    t[gone], quality[gone] = np.nan, 0.0
    found = _study(noisy.upper, replace(noisy.lower, t_room_terminal=t, quality=quality))
    assert _kinds(found) == {"drop_outs"}
    assert found.findings[0].amount == pytest.approx(1 / 7, abs=0.01)
    _near(found, noisy)


def test_a_terminal_that_was_never_seen_is_refused(noisy: Hinge) -> None:
    t = np.full_like(noisy.lower.t_room_terminal, np.nan)
    with pytest.raises(TrackError, match="never seen"):
        _study(noisy.upper, replace(noisy.lower, t_room_terminal=t))


def test_metal_that_bends_the_room_is_told_where_the_arm_moves(noisy: Hinge) -> None:
    """Two terminals in a field that stretches the room by a tenth across 10 cm."""

    def bent(track: Track) -> Track:
        t = track.t_room_terminal
        return replace(track, t_room_terminal=t + 1.5 * (t - t[0]) ** 2 * [1.0, -1.0, 1.0])

    assert "metal" not in _kinds(_study(noisy.upper, noisy.lower))
    far = 0.1 * np.sin(1e-6 * noisy.upper.time_us[:, None] * [1.9, 2.3, 3.1])
    moved = [
        replace(track, t_room_terminal=track.t_room_terminal + far)
        for track in (noisy.upper, noisy.lower)
    ]
    assert "metal" not in _kinds(_study(*moved))
    found = _study(*(bent(track) for track in moved))
    assert "metal" in _kinds(found)


def test_tracks_of_two_streams_are_refused(noisy: Hinge) -> None:
    with pytest.raises(TrackError, match="different instants"):
        _study(noisy.upper, replace(noisy.lower, time_us=noisy.lower.time_us + 1))
