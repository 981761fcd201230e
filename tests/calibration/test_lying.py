"""Bones of a flat hand: each by its own link, and by lying in a row with the others."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.calibration.lying import pitches

NONE = float("nan")
BENT = np.deg2rad(3.0)


def deg(measured: list[float], sd: list[float]) -> np.ndarray:
    return np.rad2deg(pitches(np.deg2rad(measured), np.deg2rad(sd), BENT))


def test_a_last_bone_lies_in_line_with_those_before():
    assert deg([4.0, 4.0, NONE], [1.0, 1.0, NONE]) == pytest.approx([4.0, 4.0, 4.0])


def test_a_centre_that_is_off_bends_a_finger_less_than_its_links_say():
    """2 mm at the middle joint take the link before it up and the one behind it down."""
    up, down = np.rad2deg([2.0 / 45.0, -2.0 / 25.0])
    sd = np.rad2deg([1.5 / 45.0, 1.5 / 25.0])
    first, second, last = deg([up, down, NONE], [*sd, NONE])
    assert abs(first) < 0.6 * up
    assert abs(second) < 0.6 * abs(down)
    assert abs(last) < 0.25 * abs(down)


def test_a_finger_that_links_know_to_be_bent_is_bent():
    assert deg([5.0, -5.0, NONE], [0.01, 0.01, NONE]) == pytest.approx([5.0, -5.0, 0.0], abs=0.02)


def test_of_no_link_nothing_follows():
    assert deg([NONE], [NONE]) == pytest.approx([0.0])
    assert deg([NONE, NONE], [NONE, NONE]) == pytest.approx([0.0, 0.0])


def test_what_is_not_known_does_not_pull_at_what_is():
    assert deg([2.0, NONE, NONE], [1.0, NONE, NONE]) == pytest.approx([2.0] * 3)
    assert deg([2.0, 30.0, NONE], [0.1, 50.0, NONE])[0] == pytest.approx(2.0, abs=0.1)
