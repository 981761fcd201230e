"""Takes of a virtual glove: what any take is, and the truth of every instant beside them."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.hand.angles import hand_angles
from handstudio.maths import so3
from handstudio.process import process
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.recording.truth import load_truth
from handstudio.setup import HandModel


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
