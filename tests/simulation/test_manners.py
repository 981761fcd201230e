"""Manners change how a thing is done, and not what it is."""

from functools import cache

import numpy as np
import pytest

from handstudio.errors import SetupError
from handstudio.hand.skeleton import JOINTS
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.language import perform
from handstudio.simulation.motions.manners import MANNERS
from handstudio.simulation.motions.reach import reach
from handstudio.simulation.postures import channel_of
from handstudio.simulation.subject import subject
from handstudio.simulation.trajectory import Trajectory

NAMED = ("static", "heading_rotation", "index_mcp:flexion", "wrist:deviation", "thumb_ip:flexion")
MOVING = channel_of("index_mcp_flexion")

each = pytest.mark.parametrize("manner", MANNERS)
things = pytest.mark.parametrize("name", NAMED)


@cache
def done(text: str, seed: int = 1) -> Trajectory:
    return perform(text, Actor(subject(4), seed))


def instants(part: Trajectory, step_s: float = 0.01) -> np.ndarray:
    return np.arange(0.0, part.duration_s, step_s)


def moved_deg(part: Trajectory) -> np.ndarray:
    """How far every turn goes [deg]."""
    return np.rad2deg(np.ptp(part.posture(instants(part))[:, :-3], axis=0))


def rates(part: Trajectory) -> np.ndarray:
    return np.rad2deg(np.abs(part.derivatives(instants(part))[1][:, :-3]))


@each
@things
def test_a_manner_keeps_what_is_named_and_rest_at_both_ends(manner, name):
    plain, part = done(name), done(f"{name}~{manner}")
    assert [span.name for span in part.spans] == [span.name for span in plain.spans]
    ends = [x for span in part.spans for x in (span.start_s, span.end_s)]
    assert ends[0] == pytest.approx(0.0, abs=1e-9)
    assert ends[-1] == pytest.approx(part.duration_s)
    assert ends == sorted(ends)
    _, *at_ends = part.derivatives(np.array([0.0, part.duration_s]))
    np.testing.assert_allclose(at_ends, 0.0, atol=1e-6)


@each
@things
def test_nothing_jumps_in_any_manner(manner, name):
    part = done(f"{name}~{manner}")
    inner = part.breaks_s[1:-1]
    hardest = max(1.0, float(np.abs(part.derivatives(instants(part))[2]).max()))
    before, after = (part.derivatives(inner + e) for e in (-1e-9, 1e-9))
    for left, right, allowed in zip(before, after, (1e-6, 1e-5, 1e-4), strict=True):
        np.testing.assert_allclose(left, right, atol=allowed * hardest)


@each
def test_a_manner_is_the_same_for_the_same_seed(manner):
    text = f"wrist:flexion~{manner}"
    again = perform(text, Actor(subject(4), 1))
    np.testing.assert_array_equal(again.coefficients, done(text).coefficients)
    np.testing.assert_array_equal(again.breaks_s, done(text).breaks_s)


def test_slow_takes_longer_and_small_goes_less_far():
    plain = done("index_mcp:flexion")
    slow, small, fast = (done(f"index_mcp:flexion~{m}") for m in ("slow", "small", "fast"))
    assert slow.duration_s == pytest.approx(2.0 * plain.duration_s)
    assert fast.duration_s == pytest.approx(plain.duration_s / 1.5)
    np.testing.assert_allclose(moved_deg(small)[MOVING], moved_deg(plain)[MOVING] / 3.0, rtol=1e-3)


@pytest.mark.parametrize("name", NAMED[2:])
def test_the_wrong_joint_moves_along_within_its_range(name):
    others = set()
    for seed in range(6):
        plain, part = done(name, seed), done(f"{name}~wrong_joint", seed)
        more = moved_deg(part) - moved_deg(plain)
        wrong = int(np.argmax(more))
        others.add(wrong)
        assert more[wrong] > 3.0
        assert moved_deg(part)[int(np.argmax(moved_deg(plain)))] == moved_deg(plain).max()
        assert np.count_nonzero(np.abs(more) > 1e-6) == 1
        assert within(part, wrong)
    assert len(others) > 1 or name == "thumb_ip:flexion"  # not the same each time


def within(part: Trajectory, channel: int) -> bool:
    joint = JOINTS[channel // 3].name
    low, high = reach(subject(4), f"{joint}_flexion")
    sign = 1.0 if joint == "elbow" else -1.0
    values = sign * np.rad2deg(part.posture(instants(part))[:, channel])
    return bool(low - 1.0 < values.min() and values.max() < high + 1.0)


def test_nothing_comes_along_where_nothing_moves():
    np.testing.assert_array_equal(
        done("static~wrong_joint").coefficients, done("static").coefficients
    )


def test_a_restless_hand_trembles_at_8_to_12_hz_at_rest_too():
    part = done("rest:40~restless")
    time_s = np.arange(1.0, 39.0, 0.005)
    rate = part.derivatives(time_s)[1][:, MOVING]
    power = np.abs(np.fft.rfft(rate * np.hanning(len(rate)))) ** 2
    hertz = np.fft.rfftfreq(len(rate), 0.005)
    trembling = power[(hertz > 7.5) & (hertz < 12.5)].sum() / power[hertz > 2.0].sum()
    assert trembling > 0.95
    assert 1.0 < np.rad2deg(rate.std()) < 12.0  # deg/s
    drift = np.rad2deg(part.posture(time_s)[:, MOVING])
    assert 0.3 < drift.std() < 2.5


def test_tremor_between_its_knots_is_still_a_tremor():
    """Quintics every 20 ms follow 12 Hz: rates are the derivatives of what was meant."""
    part = done("rest:40~restless")
    middle = 0.5 * (part.breaks_s[:-1] + part.breaks_s[1:])
    at_knots, between = (part.derivatives(t)[2][:, MOVING] for t in (part.breaks_s, middle))
    assert between.std() == pytest.approx(at_knots.std(), rel=0.1)


def test_a_jerky_hand_goes_the_same_way_with_halts():
    plain, part = done("index_mcp:flexion"), done("index_mcp:flexion~jerky")
    assert part.duration_s > plain.duration_s + 0.5
    np.testing.assert_allclose(moved_deg(part), moved_deg(plain), atol=0.5)
    swinging = part.spans[-1]
    inside = instants(part) > swinging.start_s
    still = (rates(part)[inside].max(axis=1) < 0.1).mean()
    assert still > 2.0 * (rates(plain)[200:].max(axis=1) < 0.1).mean() + 0.05

    def hardest(one: Trajectory) -> float:
        return float(np.abs(one.derivatives(instants(one))[2]).max())

    assert hardest(part) > 1.3 * hardest(plain)


@pytest.mark.parametrize("name", NAMED)
def test_what_is_sloppy_is_measurably_worse(name):
    plain = done(name)
    for seed in range(5):
        part = done(f"{name}~sloppy", seed)
        main = int(np.argmax(moved_deg(plain)))
        others = np.delete(moved_deg(part), main)
        worse = (
            part.duration_s > 1.3 * plain.duration_s,  # slow
            moved_deg(part)[main] < 0.75 * moved_deg(done(name, seed))[main],  # small
            others.max() > np.delete(moved_deg(plain), main).max() + 2.0,  # with the wrong joint
            np.median(rates(part)[:100].max(axis=1)) > 0.5,  # restless
        )
        assert any(worse)


def test_every_trial_of_a_calibration_is_sloppy_in_its_own_way():
    plain, part = done("joint_centres"), done("joint_centres~sloppy")
    assert [s.name for s in part.spans] == [s.name for s in plain.spans]
    lengths = [s.end_s - s.start_s for s in part.spans if s.name.endswith(":flexion")]
    assert len(lengths) == 18
    slow = [length > 9.0 for length in lengths]
    assert 3 < sum(slow) < 15  # some are slow and some are not
    assert len({round(length, 3) for length in lengths if length > 9.0}) == sum(slow)


@pytest.mark.parametrize("manner", ["restless", "jerky"])
def test_a_motion_that_is_too_long_for_a_manner_is_refused(manner):
    with pytest.raises(SetupError, match="too long to be done so"):
        done(f"rest:3600~{manner}")


def test_manners_add_up():
    both = done("index_mcp:flexion~small~slow")
    plain = done("index_mcp:flexion")
    assert both.duration_s == pytest.approx(2.0 * plain.duration_s)
    assert moved_deg(both)[MOVING] == pytest.approx(moved_deg(plain)[MOVING] / 3.0, rel=1e-3)
