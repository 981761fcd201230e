import numpy as np
import pytest

from handstudio.layout import glove
from handstudio.protocol.packets import sensor_name
from handstudio.samples import FULL_SCALE, Ranges
from handstudio.simulation.glove import description, plain_glove
from handstudio.simulation.imperfections import MPU9250
from handstudio.simulation.imperfections.strengths import PLAIN
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject
from handstudio.simulation.worn import wear

RANGES = Ranges.of(description("right", 4, 100, 1, "x"))


def gyro(counts: np.ndarray) -> np.ndarray:
    return counts[..., 3:6] / FULL_SCALE * RANGES.gyr


@pytest.mark.parametrize("side", ["right", "left"])
def test_it_reads_what_its_wearer_does(side):
    time_us = np.arange(5_000_000, 7_000_000, 10_000)
    counts = plain_glove(side, seed=4).read(time_us, 100).counts / FULL_SCALE
    exact, _ = signals(ideal_subject(side), glove(side), showcase(side), time_us)
    bias = wear(ideal_subject(side), glove(side), PLAIN, 4).drawn.bias
    assert np.abs(counts[..., 0:3] * RANGES.acc - exact.acc - bias[:, :3]).max() < 0.2
    assert np.abs(counts[..., 3:6] * RANGES.gyr - exact.gyr - bias[:, 3:]).max() < 0.01
    assert np.abs(counts[..., 6:9] * RANGES.mag - exact.mag).max() < 4.0


def test_a_new_start_begins_the_motion_anew_with_other_noise():
    worn, time_us = plain_glove(seed=4), np.arange(0, 6_000_000, 10_000)
    first, again = worn.read(time_us, 100).counts, worn.read(time_us, 100).counts
    assert (first != again).any()
    np.testing.assert_allclose(gyro(first), gyro(again), atol=0.01)
    assert np.abs(gyro(first)).max() > 0.5


def test_asked_for_something_else_it_turns_to_it_without_a_jump():
    worn, later = plain_glove(seed=4), np.arange(10_000, 20_000_000, 10_000)
    worn.read(np.arange(0, 5_500_000, 10_000), 100)  # in the middle of a fist
    asked = perform("showcase~small", Actor(ideal_subject()))
    worn.turn_to(asked)
    turned = gyro(worn.read(5_490_000 + later, 100).counts)
    went_on = plain_glove(seed=4)
    went_on.read(np.arange(0, 5_500_000, 10_000), 100)
    before = gyro(went_on.read(5_490_000 + later, 100).counts)
    # the first instant is where it was; then it does something else
    np.testing.assert_allclose(turned[0], before[0], atol=0.02)
    assert np.abs(turned - before).max() > 1.0
    exact, _ = signals(ideal_subject(), glove(), asked, np.arange(0, 8_000_000, 10_000))
    bias = wear(ideal_subject(), glove(), PLAIN, 4).drawn.bias[:, 3:]
    rms = [np.sqrt(np.mean((turned[k : k + 800] - bias - exact.gyr) ** 2)) for k in range(20, 400)]
    assert min(rms) < 0.02 < 10 * min(rms) < max(rms)  # on the way first, then what was asked


def test_it_describes_the_sensors_of_the_layout():
    about = description("left", 7, 200, 99, "Mine")
    assert tuple(map(sensor_name, about.sensors)) == glove("left").names
    assert (about.side, about.rate_hz, about.epoch, about.name) == ("left", 200, 99, "Mine")
    assert about.serial_number == "VG-7"
    assert Ranges.of(about) == MPU9250.ranges
