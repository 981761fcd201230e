"""How a device's clock stands to the host's, by when its bytes arrived."""

from __future__ import annotations

import numpy as np

from handstudio.recorded_track import LeastDelayed

PERIOD_US = 10_000


def test_a_busy_host_does_not_move_the_clock_and_a_drifting_device_does():
    rng = np.random.default_rng(4)
    clock, off = LeastDelayed(), []
    for k in range(6000):
        device_us = k * PERIOD_US
        host_us = device_us * (1.0 + 30e-6) + 5_000_000  # 30 ppm fast
        late_us = rng.exponential(2000.0) + (60_000 if 2000 < k < 4000 else 0)  # 20 s of load
        clock.observe(device_us, round(1000 * (host_us + late_us)))
        off.append(clock.offset_us + device_us - host_us)
    assert np.abs(off[1000:]).max() < 2500.0


def test_the_first_arrivals_of_a_burst_are_forgotten_at_once():
    clock = LeastDelayed()
    clock.observe(0, 1_300_000_000)
    clock.observe(PERIOD_US, 1_010_000_000)
    assert clock.offset_us == 1_000_000
