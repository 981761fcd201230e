"""Cut anywhere, the same counts and findings; from a file, the same as live."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from handstudio.health.distribution import Distribution
from handstudio.health.episodes import Episodes
from handstudio.health.findings import Kind
from handstudio.health.latch import Latch
from handstudio.health.limits import EPISODES
from handstudio.health.measures import measure
from handstudio.health.record import TakeHealth
from handstudio.health.watch import Watch
from handstudio.health.windows import Windows
from handstudio.protocol.packets import (
    Corruption,
    Missing,
    Packet,
    Reason,
    Restart,
    Temperature,
)
from handstudio.samples import FULL_SCALE, Gap, Why, from_packets

from .conftest import DEVICE_US, Glove, glove

# --- chunking -------------------------------------------------------------------------------------


def troubled() -> tuple[Glove, list[Packet]]:
    """Nine seconds with everything in them: faults, loss, a long gap, damage, a restart."""
    one = glove(seconds=9.0, seed=3, motion="showcase")
    one.counts[120:260, 3, :6] = one.counts[120, 3, :6]
    one.counts[300:310, 5, 4] = FULL_SCALE - 1
    one.answering[400:430, 8] = False
    one.counts[500:, 11, 6] += round(40.0 / one.ranges.mag * FULL_SCALE)
    packets: list[Packet] = []
    for k, packet in enumerate(one.packets()):
        if 200 <= k < 203 or 450 <= k < 520:
            continue
        if k in (203, 520):
            packets.append(Missing(3 if k == 203 else 70))
        if k == 640:
            packets.append(Restart(2))
        if k % 97 == 0:
            packets.append(Corruption(Reason.CHECKSUM, 50))
        if k in (2, 333):
            packets.append(Temperature(0, np.full(20, 31.0 + k / 50)))
        late_us = 0 if k < 640 else DEVICE_US + 5_000_000  # its clock begins anew
        packets.append(replace(packet, clock_us=packet.clock_us - late_us))
    return one, packets


TROUBLED = troubled()
HEARSAY = {"damaged", "dropped by device", "warmed", "jitter"}  # told beside the instants


def health_of(cuts: list[int]) -> TakeHealth:
    one, packets = TROUBLED
    watch = Watch()
    watch.begin(one.setup)
    watch.begin_take()
    edges = [0, *sorted(cuts), len(packets)]
    for first, last in pairwise(edges):
        part = packets[first:last]
        watch.note(part, from_packets(part, one.ranges), None)
    return watch.end_take()


WHOLE = health_of([])


def test_there_is_something_to_compare():
    assert {episode.kind for episode in WHOLE.episodes} >= {
        *("stuck", "saturated", "silent", "magnetic", "loss", "restarted"),
    }
    assert (WHOLE.missing, WHOLE.restarts, WHOLE.instants) == (73, 1, 900 - 73)
    assert WHOLE.measured_rate_hz == pytest.approx(100.0)
    assert WHOLE.sensors[3].stuck_s > 1.0
    assert WHOLE.sensors[5].saturated == 10


@given(st.lists(st.integers(0, len(TROUBLED[1])), max_size=60))
@settings(max_examples=20)
def test_cutting_the_stream_anywhere_changes_no_count_and_no_finding(cuts):
    cut = health_of(cuts)
    assert _of_instants(cut) == _of_instants(WHOLE)
    assert cut.damaged == WHOLE.damaged


def test_one_instant_at_a_time_is_the_same():
    assert _of_instants(health_of(list(range(len(TROUBLED[1]))))) == _of_instants(WHOLE)


def _of_instants(health: TakeHealth) -> TakeHealth:
    """Without what is told beside the instants: it counts where its chunk ends."""
    episodes = tuple(one for one in health.episodes if one.kind not in HEARSAY)
    return msgspec.structs.replace(health, episodes=episodes)


# --- joining late ---------------------------------------------------------------------------------


@pytest.mark.parametrize("start", [1, 137, 450, 700])
def test_a_take_begun_in_the_middle_is_judged_as_from_its_own_file(start):
    one = glove(seconds=9.0, seed=4, motion="showcase")
    one.counts[500:, 3, :6] = one.counts[500, 3, :6]
    one.answering[100:180, 6] = False
    chunks = one.chunks(at_once=3)
    live, alone = Watch(), Watch()
    live.begin(one.setup)
    alone.begin(one.setup)
    alone.begin_take()
    for k, (packets, events, arrival_ns) in enumerate(chunks):
        if k == start // 3:
            live.begin_take()
        live.note(packets, events, arrival_ns)
        if k >= start // 3:
            alone.note(packets, events, arrival_ns)
    assert live.end_take() == alone.end_take()


# --- windows --------------------------------------------------------------------------------------


def test_no_instant_is_lost_or_counted_twice_between_windows():
    one, packets = TROUBLED
    windows, found = Windows(20, 100.0), []
    for event in from_packets(packets, one.ranges):
        found += windows.add(event)
    last = windows.flush()
    assert last is not None
    every = [*found, last]
    assert windows.flush() is None
    assert sum(len(window.samples) for window in every) == WHOLE.instants
    assert sum(window.missing for window in every) == WHOLE.missing
    assert all(window.end_us - window.start_us < 500_000 for window in every)
    starts = np.array([window.start_us for window in every])
    assert (np.diff(starts) > 0).all()


def test_time_goes_on_over_a_restart_by_as_long_as_the_device_was_away():
    one = glove(seconds=3.0)
    before, after = (from_packets(one.packets()[:150], one.ranges)[0] for _ in range(2))
    windows = Windows(20, 100.0)
    found = [w for e in (before, Gap(Why.RESTART, 0, 4_000_000), after) for w in windows.add(e)]
    gap = [window for window in found if window.restarts]
    assert len(gap) == 1
    assert gap[0].start_us == int(before.time_us[-1]) + 4_000_000


def test_noise_is_not_taken_from_over_a_gap():
    """The step between two attitudes is no noise."""
    one = glove(seconds=3.0)
    one.counts[130:, :, :3] += 4000
    packets = [*one.packets()[:130], Missing(10), *one.packets()[140:]]
    windows, found = Windows(20, 100.0), []
    for event in from_packets(packets, one.ranges):
        found += windows.add(event)
    whole = [measure(window) for window in found]
    assert [measures.missing for measures in whole] == [0, 0, 0, 10, 0, 0]
    usual = whole[1].noise_acc
    assert (whole[3].noise_acc < 2.0 * usual).all()
    assert (whole[3].spread_acc > 5.0).all()


# --- bounds ---------------------------------------------------------------------------------------


def test_episodes_are_bounded_and_the_rest_is_counted():
    latch, episodes = Latch(Kind.LOSS, 1), Episodes()
    for k in range(EPISODES + 7):
        for value, start_s in ((5.0, 10.0 * k), (0.0, 10.0 * k + 5.0)):
            latch.update(np.array([value]), start_s, start_s + 0.5, 2.5)
            episodes.update(latch)
    latch.update(np.array([9.0]), 1e5, 1e5 + 0.5, 0.5)
    episodes.update(latch)
    kept, beyond = episodes.kept()
    assert (len(kept), beyond) == (EPISODES, 8)
    assert kept[1].start_s == 10.0
    assert kept[1].end_s == 10.5


def test_a_value_that_wavers_about_its_limit_is_one_finding_from_then_on():
    latch = Latch(Kind.JITTER, 1)  # 50 ms, after two windows
    on = []
    for k, value in enumerate([51.0, 49.0, 51.0, 52.0, *[45.0] * 8, *[35.0] * 4, 51.0]):
        latch.update(np.array([value]), 0.5 * k, 0.5 * k + 0.49, 0.5)
        on.append(bool(latch.on[0, 0]))
    assert on == [False] * 3 + [True] * 12 + [False] * 2
    latch.update(np.array([60.0]), 9.0, 9.49, 0.5)
    for k in range(20):  # what says nothing is not well
        latch.update(np.full(1, np.nan), 10.0 + k, 10.49 + k, 0.5)
    assert latch.on[0, 0]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_quantiles_are_at_most_a_bin_too_long(seed):
    durations = np.random.default_rng(seed).lognormal(1.0, 1.0, 5000)
    counted = Distribution()
    for ms in durations:
        counted.add(float(ms))
    for share in (0.5, 0.95, 0.99, 1.0):
        exact = float(np.quantile(durations, share, method="inverted_cdf"))
        assert exact <= counted.quantile(share) <= exact * 1.048
    assert counted.quantile(1.0) == durations.max()


def test_durations_beyond_every_bin_are_counted_too():
    counted = Distribution()
    for ms in (-1.0, 0.0, 1e9):
        counted.add(ms)
    assert counted.quantile(0.5) <= 0.01
    assert counted.quantile(1.0) > 1e4
    assert Distribution().quantile(0.5) is None


def test_a_take_health_survives_its_file():
    assert msgspec.json.decode(msgspec.json.encode(WHOLE), type=TakeHealth) == WHOLE


def test_troubles_sum_up_the_episodes():
    (stuck,) = [one for one in WHOLE.troubles if one.kind == "stuck"]
    assert (stuck.level, stuck.unit, stuck.sensors, stuck.times) == ("act", "s", (3,), 1)
    assert WHOLE.troubles[0].level == "act"
