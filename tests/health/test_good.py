"""What is well raises nothing: a virtual glove at rest, at work and as fast as people get."""

from __future__ import annotations

import numpy as np
import pytest

from .conftest import glove, watched, with_missing


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
@pytest.mark.parametrize("motion", ["rest", "fast"])
def test_a_good_glove_raises_nothing(motion, seed):
    one = glove(seconds=12.0, seed=seed, motion=motion)
    assert watched(one, one.chunks()).findings == []


@pytest.mark.parametrize("seed", [4, 5])
def test_a_whole_showcase_raises_nothing(seed):
    one = glove(seconds=45.0, seed=seed, motion="showcase")
    seen = watched(one, one.chunks(at_once=5))
    assert seen.findings == []
    health = seen.watch.end_take()
    assert health.episodes == ()
    assert health.measured_rate_hz == pytest.approx(100.0)
    assert all(sensor.saturated == sensor.silent == 0 for sensor in health.sensors)


@pytest.mark.parametrize("motion", ["rest", "fast", "showcase"])
@pytest.mark.parametrize(("rate_hz", "at_once"), [(1000, 4), (50, 1)])
def test_nor_does_it_at_other_rates(rate_hz, at_once, motion):
    one = glove(rate_hz, 6.0, seed=6, motion=motion)
    assert watched(one, one.chunks(at_once=at_once)).findings == []


def test_the_fast_motion_is_fast():
    one = glove(seconds=6.0, motion="fast")
    gyr = one.counts[..., 3:6] / 32768 * one.ranges.gyr
    assert np.rad2deg(np.linalg.norm(gyr, axis=-1).max()) > 900.0


def test_a_glove_without_compasses_raises_nothing():
    one = glove(seconds=6.0)
    one.fresh[:] = False
    one.counts[..., 6:] = 0
    assert watched(one, one.chunks()).findings == []


def test_compasses_that_read_seldom_are_not_stuck():
    one = glove(seconds=8.0, motion="showcase")
    held = one.counts[::20, :, 6:].repeat(20, axis=0)[: len(one.counts)]
    one.counts[..., 6:] = held
    one.fresh[:] = (np.arange(len(one.fresh)) % 20 == 0)[:, None]
    assert watched(one, one.chunks()).findings == []


def test_one_lost_instant_in_a_thousand_raises_nothing():
    one = glove(1000, 6.0)
    packets = [packet for k, packet in enumerate(one.packets()) if k % 2000 != 1500]
    assert watched(one, one.chunks(with_missing(packets), at_once=4)).findings == []


def test_a_perfect_import_at_rest_is_not_stuck():
    """Sensors without noise that do not move: nobody changes, so nobody is the odd one."""
    one = glove(seconds=4.0)
    one.counts[:] = one.counts[0]
    seen = watched(one, one.chunks())
    assert seen.findings == []
