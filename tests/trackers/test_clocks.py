"""The clocks that trackers have, or have not."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.trackers.clocks import FIRST, TrackerClock, clock_of

HOST_US = 1_700_000_000_000_000


@pytest.fixture
def arrival():
    """At 60 Hz, up to 8 ms late."""
    rng = np.random.default_rng(1)
    even = HOST_US + np.arange(300) * 16_667
    return even, even + rng.integers(500, 8000, 300)


def test_times_of_the_host_are_taken_as_they_are(arrival):
    even, came = arrival
    clock = clock_of(came, even)
    assert clock == TrackerClock(sound=True)
    np.testing.assert_array_equal(clock.told_us(came, even), even)


def test_a_clock_of_another_origin_begins_where_the_least_delayed_pose_came(arrival):
    even, came = arrival
    told = clock_of(came, even - HOST_US).told_us(came, even - HOST_US)
    assert np.ptp(told - even) == 0
    assert abs(int((told - even)[0])) < 1500


@pytest.mark.parametrize(
    "own",
    [np.zeros(300, int), HOST_US + np.zeros(300, int), np.arange(300), np.arange(300) * -16_667],
)
def test_without_a_clock_arrivals_count(arrival, own):
    _, came = arrival
    clock = clock_of(came, own)
    assert not clock.sound
    np.testing.assert_array_equal(clock.told_us(came, own), came)


def test_poses_that_come_in_a_burst_at_first_have_a_clock(arrival):
    even, came = arrival
    assert clock_of(np.maximum(came, came[25]), even - HOST_US).sound
    assert clock_of(np.maximum(came, came[110]), even).sound


def test_a_clock_that_jumps_is_not_followed(arrival):
    even, came = arrival
    own = even.copy()
    own[200:] += 3_600_000_000
    told = clock_of(came, own).told_us(came, own)
    np.testing.assert_array_equal(told[200:], came[200:])


def test_a_clock_is_not_judged_by_a_few_poses(arrival):
    even, came = arrival
    assert clock_of(came[: FIRST - 1], even[: FIRST - 1]) is None
