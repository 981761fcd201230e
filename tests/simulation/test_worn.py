import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from handstudio.layout import glove
from handstudio.simulation.imperfections.strengths import IDEAL, TYPICAL
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import subject
from handstudio.simulation.worn import begin, sense, wear


@given(st.lists(st.integers(1, 150), min_size=1, max_size=5), st.sampled_from([100, 1000]))
def test_a_stream_reads_the_same_however_it_is_cut(cuts, rate_hz):
    worn, motion = wear(subject(3), glove(), TYPICAL, 5), showcase("right")
    time_us = 5_000_000 + np.arange(sum(cuts)) * 1_000_000 // rate_hz
    whole, _ = sense(worn, begin(worn), motion, time_us, rate_hz)
    state, parts = begin(worn), []
    for part in np.split(time_us, np.cumsum(cuts)[:-1]):
        sensed, state = sense(worn, state, motion, part, rate_hz)
        parts.append(sensed)
    for name in ("counts", "fresh", "answering", "celsius"):
        whole_one = getattr(whole, name)
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), whole_one)


def test_without_imperfections_sensors_read_what_is_true():
    someone, time_us = subject(3), np.arange(0, 40_000_000, 200_000)
    worn = wear(someone, glove(), IDEAL, 5)
    sensed, _ = sense(worn, begin(worn), showcase("right"), time_us, 100)
    samples, truth = signals(someone, glove(), showcase("right"), time_us)
    assert sensed.samples == samples
    np.testing.assert_array_equal(sensed.truth.q_world_sensor, truth.q_world_sensor)
