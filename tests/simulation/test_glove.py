import numpy as np
import pytest

from handstudio.layout import glove
from handstudio.protocol.packets import sensor_name
from handstudio.samples import FULL_SCALE, Ranges
from handstudio.simulation.glove import WornGlove, description
from handstudio.simulation.imperfections import MPU9250, draw_biases
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject


@pytest.mark.parametrize("side", ["right", "left"])
def test_it_reads_what_its_wearer_does(side):
    time_us = np.arange(5_000_000, 7_000_000, 10_000)
    counts = WornGlove(side, seed=4).read(time_us, 100).counts / FULL_SCALE
    exact, _ = signals(ideal_subject(side), glove(side), showcase(side), time_us)
    ranges, biases = Ranges.of(description(side, 4, 100, 1, "x")), draw_biases(MPU9250, 20, 4)
    assert np.abs(counts[..., 0:3] * ranges.acc - exact.acc - biases.acc).max() < 0.2
    assert np.abs(counts[..., 3:6] * ranges.gyr - exact.gyr - biases.gyr).max() < 0.01
    assert np.abs(counts[..., 6:9] * ranges.mag - exact.mag).max() < 4.0


def test_it_describes_the_sensors_of_the_layout():
    about = description("left", 7, 200, 99, "Mine")
    assert tuple(map(sensor_name, about.sensors)) == glove("left").names
    assert (about.side, about.rate_hz, about.epoch, about.name) == ("left", 200, 99, "Mine")
    assert about.serial_number == "VG-7"
    assert Ranges.of(about) == MPU9250.ranges
