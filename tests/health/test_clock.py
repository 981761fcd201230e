"""The clock estimate, from arrivals of which the truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.health.clock import ClockEstimate

START_NS = 1_800_000_000_000_000_000


def arrivals(
    seconds: float, drift_ppm: float, seed: int, rate_hz: int = 100
) -> tuple[np.ndarray, np.ndarray]:
    """Device time [µs], arrival [ns]: on the way 2 ms at least, mostly 1 ms more, at times 80."""
    rng = np.random.default_rng(seed)
    count = round(seconds * rate_hz)
    device_us = 5_000_000 + np.arange(count) * (1_000_000 // rate_hz)
    late_us = rng.exponential(1000.0, count) + (rng.random(count) < 0.01) * 80_000.0
    host_us = (device_us - device_us[0]) * (1.0 + drift_ppm * 1e-6) + 2000.0 + late_us
    return device_us, START_NS + np.round(host_us * 1000.0).astype(np.int64)


def observed(device_us: np.ndarray, arrival_ns: np.ndarray) -> ClockEstimate:
    clock = ClockEstimate()
    for device, arrival in zip(device_us, arrival_ns, strict=True):
        clock.observe(int(device), int(arrival))
    return clock


@pytest.mark.parametrize("drift_ppm", [100.0, -100.0, 20.0, 0.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_drift_is_found_through_the_jitter(drift_ppm, seed):
    clock = observed(*arrivals(60.0, drift_ppm, seed))
    # 10 µs of unequal least delays over a minute are a part in a million
    assert clock.drift_ppm == pytest.approx(drift_ppm, abs=2.0)


def test_drift_is_unknown_for_ten_seconds():
    clock = observed(*arrivals(9.0, 100.0, 4))
    assert clock.drift_ppm is None
    assert clock.offset_ns() is not None


def test_offset_is_that_of_the_least_delayed():
    device_us, arrival_ns = arrivals(20.0, 0.0, 5)
    clock = observed(device_us, arrival_ns)
    least_ns = START_NS - int(device_us[0]) * 1000 + 2_000_000  # what every packet needs
    assert 0 <= clock.offset_ns() - least_ns < 100_000


def test_offset_follows_the_drift_of_hours():
    device_us, arrival_ns = arrivals(600.0, 100.0, 6, rate_hz=10)
    clock = observed(device_us, arrival_ns)
    now_ns = int(arrival_ns[-1]) - int(device_us[-1]) * 1000
    assert abs(clock.offset_ns() - now_ns) < 3_000_000
    assert clock.drift_ppm == pytest.approx(100.0, abs=2.0)


def test_a_late_packet_is_known_to_be_late():
    device_us, arrival_ns = arrivals(20.0, 0.0, 7)
    clock = observed(device_us, arrival_ns)
    due_ns = START_NS + (int(device_us[-1]) + 10_000 - int(device_us[0])) * 1000 + 2_000_000
    late_ms = clock.delay_ms(int(device_us[-1]) + 10_000, due_ns + 80_000_000)
    assert late_ms == pytest.approx(80.0, abs=0.2)


def test_a_restart_begins_the_estimate_anew():
    clock = observed(*arrivals(30.0, 100.0, 8))
    clock.restart()
    assert clock.drift_ppm is None
    assert clock.offset_ns() is None
    assert clock.delay_ms(0, START_NS) == 0.0
    device_us, arrival_ns = arrivals(30.0, -50.0, 9)
    for device, arrival in zip(device_us - 5_000_000, arrival_ns + 10**12, strict=True):
        clock.observe(int(device), int(arrival))
    assert clock.drift_ppm == pytest.approx(-50.0, abs=4.0)
