"""Instants as frames of an even rate: exact where they are even, and what is off is told."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.export.frames import Frames, blocks, frames_of
from handstudio.export.part import Part, Processed


def frames(source: Processed, time_us: np.ndarray, start_us: int = 0) -> Frames:
    motion = source.motion[: len(time_us)]
    moved = type(motion)(
        time_us, motion.q_world_sensor, motion.q_world_start, motion.doubt, motion.sd_rad
    )
    return frames_of(Part(source.setup, moved, start_us, 0, "positions"))


def test_even_instants_are_frames_of_the_nominal_rate(whole):
    found = frames(whole, 7_000_000 + 10_000 * np.array([100, 101, 102, 150, 151]), 7_000_000)
    assert found.at.tolist() == [100, 101, 102, 150, 151]
    assert (found.rate_hz, found.first, found.count, found.off_s) == (100.0, 100, 52, 0.0)
    assert found.facts()["frames_without_an_instant"] == 47


def test_a_device_that_is_slower_than_it_says_has_frames_of_its_own_rate(whole):
    time_us = np.rint(np.arange(500) * 10_020.04).astype(np.int64)
    found = frames(whole, time_us)
    assert found.at.tolist() == list(range(500))
    assert found.rate_hz == pytest.approx(1e6 / 10_020.04, rel=1e-6)
    assert found.off_s <= 1e-6


def test_what_is_not_even_says_by_how_much(whole):
    rng = np.random.default_rng(5)
    time_us = np.arange(200) * 10_000 + rng.integers(-2000, 2000, 200)
    time_us -= time_us[0]
    found = frames(whole, time_us)
    assert (np.diff(found.at) >= 1).all()
    off = np.abs(found.at / found.rate_hz - time_us * 1e-6).max()
    assert found.off_s == pytest.approx(off, abs=1e-7)
    assert 0.001 < found.off_s < 0.02


def test_one_instant_is_one_frame(whole):
    found = frames(whole, np.array([30_000]))
    assert (found.first, found.count) == (3, 1)


def test_blocks_hold_every_instant_once(gappy, monkeypatch):
    monkeypatch.setattr("handstudio.export.frames.BLOCK", 64)
    part = Part(gappy.setup, gappy.motion, int(gappy.motion.time_us[0]), 0, "positions")
    found = frames_of(part)
    instants, frame = 0, found.first
    for first, count, motion, rows in blocks(part, found):
        assert (first, count <= 64) == (frame, True)
        assert ((rows >= 0) & (rows < count)).all()
        instants, frame = instants + len(motion), frame + count
    assert (instants, frame) == (len(gappy.motion), found.first + found.count)
