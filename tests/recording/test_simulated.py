"""Takes of a virtual glove: what any take is, and the truth of every instant beside them."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from handstudio.errors import TakeError
from handstudio.hand.angles import hand_angles, joint_angles
from handstudio.hand.pose import posed
from handstudio.maths import so3
from handstudio.process import process
from handstudio.recording import writer
from handstudio.recording.notes import load_notes
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.recording.truth import load_truth, truth_path
from handstudio.setup import HandModel
from handstudio.simulation.imperfections.strengths import parse


@pytest.mark.parametrize(("side", "rate_hz"), [("right", 100), ("left", 200)])
def test_a_simulated_take_has_its_truth_beside_it(tmp_path, side, rate_hz):
    hand = HandModel(hand_length_m=0.17)
    path = simulate(
        tmp_path,
        rehearse(seed=4, side=side, hand_length_m=hand.hand_length_m),
        seconds=1.5,
        rate_hz=rate_hz,
    )
    take = open_take(path)
    setup = take.header.setup
    assert (setup.layout.side, setup.rate_hz, setup.hand) == (side, rate_hz, hand)
    assert take.summary.missing == 0
    motion = process(take)
    n = round(1.5 * rate_hz) + 1
    assert len(motion) == n == take.summary.packets
    truth = load_truth(path)
    np.testing.assert_array_equal(truth.time_us, motion.time_us)
    assert truth.sensors == setup.layout.names
    assert truth.angles.shape == (n, len(hand_angles()))
    assert truth.t_world_tip.shape == (n, 5, 3)
    error = so3.angle_between(motion.q_world_sensor, truth.q_world_sensor)
    assert np.rad2deg(error[rate_hz:].max()) < 3.0  # it rests here, and was placed


def test_a_seed_is_one_glove(tmp_path):
    def recorded(seed: int) -> list[bytes]:
        path = simulate(tmp_path, rehearse(seed=seed), seconds=0.3)
        return [data for _, data in open_take(path).chunks()]

    assert recorded(1) == recorded(1)
    assert recorded(1) != recorded(2)


def test_a_seed_and_a_start_are_one_file(tmp_path, monkeypatch):
    def simulated(folder: str, start: datetime) -> bytes:
        worn = rehearse(7, "open_close", parse("typical"), 3)
        return simulate(tmp_path / folder, worn, seconds=1.0, start=start).read_bytes()

    start = datetime(2026, 3, 4, 12, 30, 0, 250_000, tzinfo=UTC)
    one = simulated("one", start)
    monkeypatch.setattr(writer, "FLUSH_S", 0.0)  # as on a machine that is very slow
    assert simulated("two", start.astimezone(timezone(timedelta(hours=9)))) == one
    assert simulated("three", start + timedelta(seconds=1)) != one
    (path,) = (tmp_path / "two").rglob("*.mcap")
    assert path.parent.name == "2026-03-04"


def test_labels_and_losses_of_a_person_at_work_stand_beside_the_take(tmp_path):
    worn = rehearse(7, "quick_start+open_close", parse("typical,lost_packets=4"), 3)
    path = simulate(tmp_path, worn)
    take, truth = open_take(path), load_truth(path)
    assert path.parent.parent == tmp_path / "virtual-7"
    assert take.header.setup.hand.hand_length_m == worn.subject.hand_length_m
    labels = [label.label for label in load_notes(path).labels]
    assert labels == ["static", "heading_rotation", "static", "work"]
    summary = take.summary
    assert summary.missing > 0
    assert summary.packets + summary.missing == len(truth.time_us)
    np.testing.assert_array_equal(truth.q_segment_sensor, worn.worn.mounting.q_segment_sensor)
    facts = json.loads(truth.facts)
    assert (facts["person"], facts["seed"], facts["motion"]) == (7, 3, "quick_start+open_close")
    assert parse(facts["imperfections"]) == parse("typical,lost_packets=4")
    heard = process(take)
    assert set(heard.time_us) < set(truth.time_us)


def test_the_truth_of_an_instant_is_single_but_close(tmp_path):
    worn = rehearse(7, "showcase", seed=3)
    path = simulate(tmp_path, worn, seconds=8.0)
    truth = load_truth(path)
    start = np.broadcast_to(truth.q_world_start, (len(truth.time_us), 4))
    skeleton = worn.subject.skeleton
    angles = joint_angles(skeleton, truth.q_world_segment.astype(float), start)
    np.testing.assert_allclose(truth.angles, angles, atol=2e-6)
    tips = posed(skeleton, truth.q_world_segment.astype(float)).t_world_tip
    assert np.linalg.norm(tips - truth.t_world_tip, axis=-1).max() < 0.006  # joints roll


def test_a_file_that_holds_no_truth_is_told(tmp_path):
    path = simulate(tmp_path, seconds=0.2)
    truth_path(path).write_bytes(b"PK\x03\x04 broken")
    with pytest.raises(TakeError, match="truth of a take"):
        load_truth(path)
    truth_path(path).unlink()
    with pytest.raises(TakeError, match="truth of a take"):
        load_truth(path)


def test_things_in_the_hand_are_part_of_the_truth(tmp_path):
    worn = rehearse(3, "static+grasp:power_sphere", seed=5)
    truth = load_truth(simulate(tmp_path, worn, rate_hz=50))
    (ball,) = json.loads(truth.facts)["held"]
    assert (ball["name"], ball["shape"], ball["radius_m"]) == (
        "grasp:power_sphere",
        "sphere",
        0.0375,
    )
    now = (truth.time_us >= ball["start_s"] * 1e6) & (truth.time_us <= ball["end_s"] * 1e6)
    known = np.isfinite(truth.t_world_held).all(axis=1)
    assert (known != now).sum() <= 2  # where a span ends on an instant
    assert not truth.pen_down.any()
    # it lies in the palm: the fingertips' bones are around it, a finger's half depth outside
    off = np.linalg.norm(truth.t_world_tip[known] - truth.t_world_held[known][:, None], axis=-1)
    assert 0.035 < off.min() < off.max() < 0.065
