"""Shake a sensor and it is the one that is pointed out; work points out none."""

from __future__ import annotations

import numpy as np
import pytest

from app.shown import shaken
from app.shown.review import Review
from handstudio.maths import so3
from handstudio.pipeline import Doubt, Motion, unsure

SENSORS = 20


def still(seconds: float, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    time_us = np.arange(0, int(seconds * 1e6), int(1e6 / rate_hz))
    return time_us, np.tile(so3.IDENTITY, (len(time_us), SENSORS, 1))


def turned(time_us: np.ndarray, hz: float, degrees: float) -> np.ndarray:
    angle = np.deg2rad(degrees) * np.sin(2 * np.pi * hz * time_us * 1e-6)
    axis = np.array([0.3, 0.9, 0.1]) / np.linalg.norm([0.3, 0.9, 0.1])
    return so3.exp(angle[:, None] * axis)


def motion(time_us: np.ndarray, q: np.ndarray) -> Motion:
    doubt = np.full((len(time_us), SENSORS), Doubt(0), dtype=np.uint8)
    return Motion(time_us, q, np.tile(so3.IDENTITY, (len(time_us), 1)), doubt, unsure(doubt))


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 1000.0])
def test_the_one_that_is_shaken_is_found(rate_hz: float) -> None:
    time_us, q = still(1.5, rate_hz)
    q[:, 13] = turned(time_us, hz=4.0, degrees=25.0)
    state = shaken.begin(SENSORS)
    for begin in range(0, len(time_us), 7):
        part = slice(begin, begin + 7)
        state = shaken.heeded(state, [motion(time_us[part], q[part])])
    assert state.sensor == 13
    assert len(state.time_us) <= 81


def test_it_goes_out_again() -> None:
    time_us, q = still(6.0, 100.0)
    q[:200, 3] = turned(time_us[:200], hz=4.0, degrees=25.0)
    state = shaken.begin(SENSORS)
    lit = []
    for at in range(len(time_us)):
        state = shaken.heeded(state, [motion(time_us[at : at + 1], q[at : at + 1])])
        lit.append(state.sensor)
    assert lit[199] == 3
    assert lit[-1] is None


def test_a_hand_that_is_shaken_as_a_whole_points_nothing_out() -> None:
    time_us, q = still(1.0, 100.0)
    q[:] = turned(time_us, hz=4.0, degrees=25.0)[:, None]
    assert shaken.shaken(time_us, q) is None


def test_one_swift_turn_is_no_shaking() -> None:
    time_us, q = still(1.0, 100.0)
    q[:, 5] = so3.exp(np.outer(np.clip(time_us * 1e-6 * 6.0 - 2.0, 0.0, 2.0), [1.0, 0.0, 0.0]))
    assert shaken.shaken(time_us, q) is None


def test_work_points_nothing_out(review: Review) -> None:
    state = shaken.begin(len(review.setup.layout.sensors))
    for begin in range(0, len(review.motion), 5):
        state = shaken.heeded(state, [review.motion[begin : begin + 5]])
        assert state.sensor is None


def test_a_device_that_begins_anew_is_no_trouble() -> None:
    time_us, q = still(1.0, 100.0)
    state = shaken.heeded(shaken.begin(SENSORS), [motion(time_us, q)])
    state = shaken.heeded(state, [motion(time_us[:5], q[:5])])
    assert len(state.time_us) == 0
