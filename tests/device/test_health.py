"""What a stream tells of itself, from packets of which every figure is known."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.device.health import HealthCount, HealthView
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

START_NS = 1_800_000_000_000_000_000
PERIOD_NS = 10_000_000


def instant(sequence: int, answering: tuple[bool, ...] = (True, True, True)) -> ImuPacket:
    n = len(answering)
    return ImuPacket(
        epoch=1,
        status=Status(0),
        sequence=sequence,
        clock_us=sequence * 10_000,
        answering=np.array(answering),
        fresh=np.ones(n, dtype=bool),
        counts=np.zeros((n, 9), dtype=np.int16),
    )


def feed(count: HealthCount, first: int, instants: int, at_once: int = 1) -> int:
    """A steady stream at 100 Hz in chunks; when the last arrived."""
    arrival_ns = START_NS
    for start in range(first, first + instants, at_once):
        packets: list[Packet] = [instant(k) for k in range(start, start + at_once)]
        arrival_ns = START_NS + (start + at_once - 1) * PERIOD_NS
        count.note(packets, arrival_ns)
    return arrival_ns


@pytest.mark.parametrize("at_once", [1, 5, 20])
def test_the_rate_is_that_of_instants_whatever_their_chunks(at_once):
    count = HealthCount()
    now_ns = feed(count, 0, 400, at_once)
    view = count.view(now_ns)
    assert view.rate_hz == pytest.approx(100.0, rel=1e-6)
    assert view.packets == 400


def test_the_rate_of_a_stream_that_stopped_is_nought():
    count = HealthCount()
    now_ns = feed(count, 0, 400)
    assert count.view(now_ns + 1_000_000_000).rate_hz == pytest.approx(100.0)
    assert count.view(now_ns + 3_000_000_000).rate_hz == 0.0


def test_of_nothing_all_is_nought():
    assert HealthCount().view(START_NS) == HealthView()
    assert HealthView().loss_percent == 0.0


def test_loss_damage_and_drops_are_counted():
    count = HealthCount()
    now_ns = feed(count, 0, 97)
    count.note([Missing(2), instant(99), Missing(1), instant(101)], now_ns + 5 * PERIOD_NS)
    count.note([Corruption(Reason.CHECKSUM, 80), Corruption(Reason.FRAMING, 3)], now_ns)
    count.note([Health(1_000_000, 90, 7, 5000, (0, 0, 0))], now_ns)
    view = count.view(now_ns)
    assert (view.packets, view.missing, view.damaged) == (99, 3, 2)
    assert view.dropped_by_device == 7
    assert view.loss_percent == pytest.approx(100.0 * 3 / 102)


def test_sensors_are_silent_until_they_answer():
    count = HealthCount()
    count.note([instant(0, (True, False, False))], START_NS)
    assert count.view(START_NS).silent == (1, 2)
    count.note([instant(1, (True, False, False)), instant(2, (True, True, False))], START_NS)
    assert count.view(START_NS).silent == (2,)
    count.note([Missing(1)], START_NS)  # a chunk without an instant tells nothing of sensors
    assert count.view(START_NS).silent == (2,)
    count.note([instant(4)], START_NS)
    assert count.view(START_NS).silent == ()


def test_the_temperature_is_that_of_the_warmest_sensor_that_knows():
    count = HealthCount()
    count.note([Temperature(0, np.array([31.5, np.nan, 33.25]))], START_NS)
    assert count.view(START_NS).celsius == 33.25
    count.note([Temperature(1, np.full(3, np.nan))], START_NS)
    assert count.view(START_NS).celsius == 33.25


def test_a_restart_begins_the_clock_anew():
    count = HealthCount()
    now_ns = feed(count, 0, 2000)
    assert count.view(now_ns).drift_ppm is not None
    count.note([Restart(2), instant(0)], now_ns + 5_000_000_000)
    view = count.view(now_ns + 5_000_000_000)
    assert view.restarts == 1
    assert view.drift_ppm is None
    assert view.delay_ms == 0.0
    assert view.offset_ns == now_ns + 5_000_000_000


def test_latency_is_the_worst_but_one_in_a_hundred():
    count = HealthCount()
    for ms in range(1, 101):
        count.note_latency(float(ms))
    assert 98.0 < count.view(START_NS).latency_p99_ms <= 100.0
