"""A hand that is followed in a tracker's room as it comes, against what was simulated."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from handstudio.device.following import Following, RootPhase
from handstudio.device.orders import Moved
from handstudio.kinematics import pose_of
from handstudio.maths import so3
from handstudio.process import process
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.recording.tracker_message import Poses, TrackerFacts
from handstudio.recording.truth import load_truth
from handstudio.samples import ImuSamples
from handstudio.simulation.imperfections.strengths import IDEAL
from handstudio.simulation.moving import Moving
from handstudio.simulation.streamed import LEVER_M, STRENGTHS, Terminal, standing_of
from handstudio.trackers.late_faults import Fate

SEED, SENSOR, SECONDS = 3, "SN4", 18.0
FACTS = TrackerFacts("lsl:vt", "hand", SENSOR, LEVER_M)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A take, its motion, and what a terminal on the hand's sensor told meanwhile."""
    sessions = tmp_path_factory.mktemp("sessions")
    start = datetime(2026, 3, 4, 12, tzinfo=UTC)
    rehearsed = rehearse(0, "tissue+ball_throw&elbow_moving:all 20", IDEAL, SEED)
    path = simulate(sessions, rehearsed, seconds=SECONDS, start=start)
    take, truth = open_take(path), load_truth(path)
    k = truth.sensors.index(SENSOR)
    t, q = truth.t_world_sensor.astype(float), truth.q_world_sensor.astype(float)
    v = np.gradient(t, truth.time_us * 1e-6, axis=0)
    terminal, told = Terminal(k, STRENGTHS["plain"], SEED), []
    for at in range(0, len(t), 10):
        part = slice(at, at + 10)
        still = np.zeros_like(v[part])
        terminal.saw(truth.time_us[part], Moving(q[part], t[part], still, v[part], still, still))
        told += terminal.due(int(truth.time_us[part][-1]))
    us = np.array([pose.told_us for pose in told])
    arrival_ns = take.header.start_utc_ns + 1000 * us
    places = np.array([pose.t_room_terminal for pose in told])
    turns = np.array([pose.q_room_terminal for pose in told])
    poses = Poses(arrival_ns, arrival_ns // 1000, places, turns, np.ones(len(us)))
    return take, process(take), truth, poses


def followed(scene, poses, facts=FACTS, *, skip_s=(0.0, 0.0)):
    """Step by step, chunk by chunk; what was known after each."""
    take, motion, _, _ = scene
    following, count, known, told = Following(facts), 0, [], 0
    for arrival_ns, _packets, events in take.decoded():
        runs = tuple(event for event in events if isinstance(event, ImuSamples))
        size = sum(map(len, runs))
        part = motion[count : count + size]
        count += size
        until = int(np.searchsorted(poses.arrival_ns, arrival_ns))
        moves = [Moved(arrival_ns, take.header.setup, part, runs)] if size else []
        known.append(following.step(moves, [poses[told:until]] if until > told else []))
        told = until
    return known


def off_m(scene, known):
    """How far the wrist is off, where it is known, by the instant [s]."""
    take, motion, truth, _ = scene
    places = [now for now in known if now.t_room_elbow is not None]
    k = np.searchsorted(motion.time_us, [now.time_us for now in places])
    wrist = pose_of(take.header.setup, motion.q_world_sensor[k]).t_world_joint[:, 1]
    room = standing_of(SEED)
    q = np.array([now.q_room_world for now in places])
    mine = np.array([now.t_room_elbow for now in places]) + so3.rotate(q, wrist)
    true = truth.t_world_joint[k, 1].astype(float)
    true = room.t_room_world + so3.rotate(room.q_room_world, true)
    return motion.time_us[k] * 1e-6, np.linalg.norm(mine - true, axis=-1)


def test_it_is_found_and_followed_within_4_mm(scene):
    known = followed(scene, scene[3])
    assert known[-1].phase is RootPhase.FOLLOWING
    assert known[-1].delay_s == pytest.approx(0.05, abs=0.005)
    at_s, off = off_m(scene, known)
    assert at_s[0] < 12.0
    assert np.sqrt(np.mean(off[at_s > at_s[0] + 2.0] ** 2)) < 0.004


def test_while_it_is_not_seen_the_last_place_holds_and_then_it_is_back(scene):
    poses = scene[3]
    seconds = (poses.arrival_ns - poses.arrival_ns[0]) * 1e-9
    away = (seconds > 12.0) & (seconds < 14.5)
    unseen = replace(
        poses,
        t_room_terminal=np.where(away[:, None], np.nan, poses.t_room_terminal),
        q_room_terminal=np.where(away[:, None], np.nan, poses.q_room_terminal),
    )
    known = followed(scene, unseen)
    assert any(now.trouble is Fate.LOST and now.sd_m > 0.05 for now in known)
    at_s, off = off_m(scene, known)
    assert off[at_s > 15.5].max() < 0.02


def test_a_tracker_that_jumps_away_and_back_moves_nothing(scene):
    poses = scene[3]
    seconds = (poses.arrival_ns - poses.arrival_ns[0]) * 1e-9
    jumped = poses.t_room_terminal + ((seconds > 13.0) & (seconds < 13.6))[:, None] * 0.7
    known = followed(scene, replace(poses, t_room_terminal=jumped))
    assert any(now.trouble is Fate.JUMPED for now in known)
    at_s, off = off_m(scene, known)
    assert off[at_s > 12.0].max() < 0.1


def test_on_the_wrong_sensor_it_is_not_followed_and_the_right_one_is_named(scene):
    known = followed(scene, scene[3], TrackerFacts("lsl:vt", "hand", "SN1"))
    assert known[-1].phase is RootPhase.LOOKING
    assert "does not stay with SN1" in known[-1].why.what


def test_a_frozen_tracker_is_not_followed(scene):
    poses = scene[3]
    same = np.zeros(len(poses), dtype=int)
    known = followed(
        scene,
        replace(
            poses,
            t_room_terminal=poses.t_room_terminal[same],
            q_room_terminal=poses.q_room_terminal[same],
        ),
    )
    assert {now.phase for now in known[-100:]} == {RootPhase.LOOKING}
    assert known[-1].why is not None


def test_a_glove_that_begins_anew_is_found_anew(scene):
    take, motion, _, _ = scene
    following = Following(FACTS)
    setup = take.header.setup
    early, late = motion[:10], motion[1000:1010]
    run = take.runs()[0]
    for part in (late, early):
        moved = Moved(take.header.start_utc_ns, setup, part, (run[:10],))
        following.step([moved], [])
    assert following._moves.seconds < 1.0
