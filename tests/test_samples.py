"""Packets to events: counts to SI, runs and gaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from handstudio.protocol.packets import (
    Corruption,
    Description,
    Health,
    ImuPacket,
    Missing,
    Reason,
    Restart,
    Status,
    Temperature,
)
from handstudio.samples import STANDARD_GRAVITY, Gap, ImuSamples, Ranges, Why, from_packets

ABOUT = Description(
    protocol=1,
    epoch=7,
    name="a glove",
    serial_number="1",
    firmware="1",
    side="right",
    sensors=(1, 11),
    rate_hz=100,
    max_rate_hz=1000,
    magnetometer_rate_hz=100,
    accelerometer_range_g=16.0,
    gyroscope_range_dps=2000.0,
    magnetometer_range_ut=4912.0,
)
RANGES = Ranges.of(ABOUT)


def instant(sequence: int, counts: object = 0) -> ImuPacket:
    return ImuPacket(
        epoch=7,
        status=Status(0),
        sequence=sequence,
        clock_us=10_000 * sequence,
        answering=np.array([True, sequence % 2 == 0]),
        fresh=np.array([sequence % 3 == 0, True]),
        counts=np.broadcast_to(np.asarray(counts, dtype=np.int16), (2, 9)).copy(),
    )


def test_counts_become_si_units():
    counts = [16384, 0, 0, 0, -16384, 0, 0, 0, 8192]
    (samples,) = from_packets([instant(0, counts)], RANGES)
    assert samples.acc[0, 0, 0] == pytest.approx(8.0 * STANDARD_GRAVITY)
    assert samples.gyr[0, 0, 1] == pytest.approx(-np.deg2rad(1000.0))
    assert samples.mag[0, 0, 2] == pytest.approx(1228.0)
    assert np.count_nonzero(samples.acc) + np.count_nonzero(samples.gyr) == 4  # of two sensors
    assert not samples.saturated.any()


def test_a_run_of_instants_is_one_event_and_keeps_its_flags():
    (samples,) = from_packets(map(instant, range(4)), RANGES)
    assert samples.time_us.tolist() == [0, 10_000, 20_000, 30_000]
    assert samples.valid[:, 1].tolist() == [True, False, True, False]
    assert samples.fresh[:, 0].tolist() == [True, False, False, True]


@pytest.mark.parametrize("column", range(9))
@pytest.mark.parametrize("count", [-32768, -32767, 32767])
def test_an_inertial_axis_at_its_limit_is_saturated(column, count):
    packet = instant(0)
    packet.counts[1, column] = count
    (samples,) = from_packets([packet], RANGES)
    assert samples.saturated[0].tolist() == [False, column < 6]
    packet.counts[1, column] -= np.sign(count) * 2
    assert not from_packets([packet], RANGES)[0].saturated.any()


def test_gaps_stand_where_instants_are_missing_and_other_packets_interrupt_nothing():
    said = [
        ABOUT,
        instant(0),
        Health(1, 2, 3, 4, (0, 0)),
        Temperature(5, np.array([30.0, 31.0])),
        Corruption(Reason.CHECKSUM, 9),
        instant(1),
        Missing(3),
        instant(5),
        Restart(8),
        instant(0),
    ]
    events = from_packets(said, RANGES)
    assert [len(event) if isinstance(event, ImuSamples) else event for event in events] == [
        2,
        Gap(Why.LOST, 3),
        1,
        Gap(Why.RESTART, 0),
        1,
    ]


def test_samples_are_equal_by_value_and_an_absent_compass_equals_itself():
    (samples,) = from_packets(map(instant, range(4)), RANGES)
    blind = replace(samples, mag=np.full_like(samples.mag, np.nan))
    assert blind == replace(samples, mag=np.full_like(samples.mag, np.nan))
    assert blind != samples
    assert samples[1:3] == samples[1:][:2]
    assert samples[1:3] != samples[0:2]
    assert samples != "samples"
    broken = replace(samples, gyr=np.full_like(samples.gyr, np.nan))
    assert broken != broken[:]  # only a compass may be absent
