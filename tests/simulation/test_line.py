import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.simulation.imperfections.strengths import IDEAL, TYPICAL, Imperfections
from handstudio.simulation.line import DAMAGED, LOST, Line, LineState, line_of, passed


def frames(n: int) -> list[bytes]:
    return [number.to_bytes(4, "little") + bytes(60) for number in range(n)]


def test_a_good_line_passes_everything():
    assert passed(line_of(IDEAL, 1), LineState(), frames(5000))[0] == frames(5000)


@given(st.lists(st.integers(0, 200), min_size=1, max_size=6), st.integers(0, 3))
def test_frames_arrive_the_same_however_they_are_handed_over(cuts, seed):
    line, sent = Line(seed, lost=0.1, damaged=0.1), frames(sum(cuts))
    whole, end = passed(line, LineState(), sent)
    state, arrived = LineState(), []
    for start, size in zip(np.cumsum([0, *cuts[:-1]]), cuts, strict=True):
        part, state = passed(line, state, sent[start : start + size])
        arrived += part
    assert (arrived, state) == (whole, end)


@pytest.mark.parametrize(("lost", "burst"), [(0.005, 4.0), (0.2, 4.0), (0.05, 1.5)])
def test_as_much_is_lost_as_was_asked_for_and_in_such_bursts(lost, burst):
    n = 200_000
    arrived, _ = passed(Line(3, lost, damaged=0.0, burst=burst), LineState(), frames(n))
    numbers = np.array([int.from_bytes(frame[:4], "little") for frame in arrived])
    bursts = np.diff(numbers) - 1
    bursts = bursts[bursts > 0]
    # a burst is geometric: its standard deviation is about its mean
    tolerance = 5.0 / np.sqrt(len(bursts))
    assert bursts.mean() == pytest.approx(burst, rel=tolerance)
    assert 1.0 - len(arrived) / n == pytest.approx(lost, rel=1.5 * tolerance)


def test_as_many_are_damaged_as_was_asked_for_by_one_byte():
    n = 50_000
    sent = frames(n)
    arrived, _ = passed(Line(3, lost=0.0, damaged=0.02), LineState(), sent)
    wrong = [(a, b) for a, b in zip(arrived, sent, strict=True) if a != b]
    assert len(wrong) == pytest.approx(0.02 * n, rel=5.0 / np.sqrt(0.02 * n))
    differing = [[i for i in range(64) if a[i] != b[i]] for a, b in wrong]
    assert all(len(places) == 1 for places in differing)
    assert len({places[0] for places in differing}) == 64


def test_strengths_scale_the_line():
    assert line_of(TYPICAL, 2) == Line(2, 0.1 * LOST, 0.1 * DAMAGED)
    both = Imperfections(lost_packets=2.0, damaged_packets=3.0)
    assert line_of(both, 2) == Line(2, 2.0 * LOST, 3.0 * DAMAGED)


def test_a_seed_is_a_line_and_another_is_another():
    lost = [passed(Line(seed, 0.1, 0.1), LineState(), frames(2000))[0] for seed in (1, 1, 2)]
    assert lost[0] == lost[1] != lost[2]
