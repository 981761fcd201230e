"""What a watch counts, from packets of which every figure is known."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.health.view import HealthView
from handstudio.health.watch import Watch
from handstudio.layout import glove as glove_layout
from handstudio.protocol.packets import (
    Corruption,
    Health,
    ImuPacket,
    Missing,
    Packet,
    Reason,
    Restart,
    Status,
    Temperature,
)
from handstudio.samples import Ranges, from_packets
from handstudio.setup import Setup

START_NS = 1_800_000_000_000_000_000
PERIOD_NS = 10_000_000
RANGES = Ranges(78.0, 35.0, 4912.0)
SETUP = Setup(glove_layout("right", ["SN1", "SN11", "SN15"]), 100.0, ranges=RANGES)


def instant(sequence: int, answering: tuple[bool, ...] = (True, True, True)) -> ImuPacket:
    n = len(answering)
    return ImuPacket(
        epoch=1,
        status=Status(0),
        sequence=sequence,
        clock_us=sequence * 10_000,
        answering=np.array(answering),
        fresh=np.ones(n, dtype=bool),
        counts=np.full((n, 9), sequence % 7, dtype=np.int16),
    )


def tell(watch: Watch, packets: list[Packet], arrival_ns: int = START_NS) -> None:
    watch.note(packets, from_packets(packets, RANGES), arrival_ns)


def feed(watch: Watch, first: int, instants: int, at_once: int = 1) -> int:
    """A steady stream at 100 Hz in chunks; when the last arrived."""
    arrival_ns = START_NS
    for start in range(first, first + instants, at_once):
        arrival_ns = START_NS + (start + at_once - 1) * PERIOD_NS
        tell(watch, [instant(k) for k in range(start, start + at_once)], arrival_ns)
    return arrival_ns


@pytest.fixture
def watch() -> Watch:
    watch = Watch()
    watch.begin(SETUP)
    return watch


@pytest.mark.parametrize("at_once", [1, 5, 20])
def test_the_rate_is_that_of_instants_whatever_their_chunks(watch, at_once):
    now_ns = feed(watch, 0, 400, at_once)
    view = watch.view(now_ns)
    assert view.rate_hz == pytest.approx(100.0, rel=1e-6)
    assert view.measured_rate_hz == pytest.approx(100.0, rel=1e-6)
    assert view.nominal_rate_hz == 100.0
    assert view.packets == 400


def test_the_rate_of_a_stream_that_stopped_is_nought(watch):
    now_ns = feed(watch, 0, 400)
    assert watch.view(now_ns + 1_000_000_000).rate_hz == pytest.approx(100.0)
    assert watch.view(now_ns + 3_000_000_000).rate_hz == 0.0


def test_of_nothing_all_is_nought():
    assert Watch().view(START_NS) == HealthView()
    assert HealthView().loss_percent == 0.0


def test_what_comes_before_the_device_is_known_is_counted():
    watch = Watch()
    tell(watch, [instant(0), Corruption(Reason.FRAMING, 3)])
    watch.begin(SETUP)
    tell(watch, [instant(1)])
    assert (watch.view(START_NS).packets, watch.view(START_NS).damaged) == (2, 1)
    assert watch.end_take() is None


def test_a_take_needs_a_device():
    with pytest.raises(ValueError, match="what the device is"):
        Watch().begin_take()


def test_loss_damage_and_drops_are_counted(watch):
    now_ns = feed(watch, 0, 97)
    tell(watch, [Missing(2), instant(99), Missing(1), instant(101)], now_ns + 5 * PERIOD_NS)
    tell(watch, [Corruption(Reason.CHECKSUM, 80), Corruption(Reason.FRAMING, 3)], now_ns)
    tell(watch, [Health(1_000_000, 90, 7, 5000, (0, 0, 0))], now_ns)
    view = watch.view(now_ns)
    assert (view.packets, view.missing, view.damaged) == (99, 3, 2)
    assert view.dropped_by_device == 7
    assert view.loss_percent == pytest.approx(100.0 * 3 / 102)


def test_what_was_dropped_before_a_restart_counts_on():
    watch = Watch()
    watch.begin(SETUP)
    watch.begin_take()
    for dropped in (5, 9):
        tell(watch, [Health(0, 90, dropped, 5000, (0, 0, 0))])
    tell(watch, [Restart(2), Health(0, 90, 3, 5000, (0, 0, 0))])
    assert watch.view(START_NS).dropped_by_device == 3
    assert watch.end_take().dropped_by_device == 4 + 3


def test_sensors_are_silent_until_they_answer(watch):
    tell(watch, [instant(0, (True, False, False))])
    assert watch.view(START_NS).silent == (1, 2)
    tell(watch, [instant(1, (True, False, False)), instant(2, (True, True, False))])
    assert watch.view(START_NS).silent == (2,)
    tell(watch, [Missing(1)])  # a chunk without an instant tells nothing of sensors
    assert watch.view(START_NS).silent == (2,)
    tell(watch, [instant(4)])
    assert watch.view(START_NS).silent == ()


def test_the_temperature_is_that_of_the_warmest_sensor_that_knows(watch):
    tell(watch, [Temperature(0, np.array([31.5, np.nan, 33.25]))])
    assert watch.view(START_NS).celsius == 33.25
    tell(watch, [Temperature(1, np.full(3, np.nan))])
    assert watch.view(START_NS).celsius == 33.25
    tell(watch, [Temperature(2, np.array([32.0, 30.0, 31.0]))])
    feed(watch, 0, 60)
    warmed = [sensor.warmed_celsius for sensor in watch.view(START_NS).sensors]
    assert warmed == [0.5, 0.0, -2.25]


def test_nobody_knows_a_temperature(watch):
    tell(watch, [Temperature(0, np.full(3, np.nan))])
    feed(watch, 0, 60)
    assert watch.view(START_NS).celsius is None
    assert [sensor.celsius for sensor in watch.view(START_NS).sensors] == [None] * 3


def test_a_restart_begins_the_clock_anew(watch):
    now_ns = feed(watch, 0, 2000)
    assert watch.view(now_ns).drift_ppm is not None
    tell(watch, [Restart(2), instant(0)], now_ns + 5_000_000_000)
    view = watch.view(now_ns + 5_000_000_000)
    assert view.restarts == 1
    assert view.drift_ppm is None
    assert view.delay_ms == 0.0
    assert view.offset_ns == now_ns + 5_000_000_000


def test_latency_is_the_worst_but_one_in_a_hundred(watch):
    for ms in range(1, 101):
        watch.note_latency(float(ms))
    view = watch.view(START_NS)
    assert 98.0 < view.latency_p99_ms <= 100.0
    assert view.latency_p50_ms == pytest.approx(50.0, rel=0.05)
    assert view.latency_max_ms == 100.0


def test_a_slow_moment_is_not_recent_for_ever_but_stays_in_the_whole(watch):
    watch.note_latency(900.0)
    feed(watch, 0, 1000)
    for _ in range(50):
        watch.note_latency(2.0)
    view = watch.view(START_NS)
    assert view.latency_max_ms == 2.0
    assert view.latency_whole.max_ms == 900.0


def test_another_device_keeps_the_counts_and_has_other_sensors(watch):
    feed(watch, 0, 200)
    watch.begin(Setup(glove_layout("right", ["SN1", "SN11"]), 50.0, ranges=RANGES))
    assert watch.findings == ()
    assert watch.view(START_NS).packets == 200
    assert watch.view(START_NS).nominal_rate_hz == 50.0
    feed(watch, 200, 200)  # still of three sensors: no motion of this setup, and no window
    assert watch.view(START_NS).sensors == ()


def test_a_take_counts_from_its_own_beginning(watch):
    feed(watch, 0, 130)
    tell(watch, [Missing(3), instant(133)])
    watch.begin_take()
    feed(watch, 134, 70)
    tell(watch, [Missing(2), instant(206), Corruption(Reason.CHECKSUM, 80)])
    take = watch.end_take()
    assert (take.instants, take.missing, take.damaged) == (71, 2, 1)
    assert take.loss_percent == pytest.approx(100.0 * 2 / 73)
    assert watch.view(START_NS).missing == 5
    assert watch.end_take() is None


def test_how_late_the_page_is_is_kept_with_the_take_alone(watch):
    watch.note_page(500.0)  # before the take
    watch.begin_take()
    for ms in (20.0, 30.0, 40.0):
        watch.note_page(ms)
    kept = watch.end_take()
    assert kept is not None
    assert kept.page is not None
    assert 25.0 < kept.page.p50_ms < 36.0
    assert kept.page.max_ms == 40.0
