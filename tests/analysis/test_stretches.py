"""What makes one look twice at a motion, and a good motion that does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from handstudio.analysis.stretches import MOST, Stretch, stretches_of
from handstudio.maths import so3
from handstudio.pipeline import Doubt, Motion
from handstudio.process import process
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import Take, open_take
from handstudio.survey import kept_survey, survey

Find = Callable[[Motion], dict[str, list[Stretch]]]


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Take:
    """Rest, then fists, of the ideal hand."""
    path = simulate(tmp_path_factory.mktemp("take"), rehearse(seed=5), seconds=12.0)
    return open_take(path)


@pytest.fixture
def find(take: Take) -> Find:
    def by_kind(motion: Motion) -> dict[str, list[Stretch]]:
        found: dict[str, list[Stretch]] = {}
        for one in stretches_of(take.header.setup, motion):
            found.setdefault(one.kind, []).append(one)
        return found

    return by_kind


@pytest.fixture
def motion(take: Take) -> Motion:
    whole = process(take)
    return Motion(*(np.array(getattr(whole, name)) for name in Motion.__slots__))


def test_a_good_motion_has_only_its_start_told(motion: Motion, find: Find) -> None:
    found = find(motion)
    assert set(found) <= {"unplaced"}
    assert all(one.end_s < 1.5 for one in found.get("unplaced", []))


def test_instants_that_are_missing(motion: Motion, find: Find) -> None:
    rows = np.delete(np.arange(len(motion)), [*range(300, 310), 700])
    found = find(Motion(*(getattr(motion, name)[rows] for name in Motion.__slots__)))
    first, second = found["gap"]
    assert (first.worst, second.worst) == (10.0, 1.0)
    assert (first.start_s, first.end_s) == pytest.approx((2.99, 3.10), abs=1e-3)


def test_doubts_are_told_with_their_sensors(motion: Motion, find: Find) -> None:
    motion.doubt[500:520, 3] |= np.uint8(Doubt.SATURATED)
    motion.doubt[510:530, 7] |= np.uint8(Doubt.SATURATED)
    motion.doubt[900, :] |= np.uint8(Doubt.SILENT)
    found = find(motion)
    (saturated,), (silent,) = found["saturated"], found["silent"]
    assert saturated.names == ("SN4", "SN8")
    assert saturated.end_s == pytest.approx(5.29, abs=1e-3)
    assert silent.worst == 1.0


def test_a_finger_that_bends_the_wrong_way(motion: Motion, find: Find, take: Take) -> None:
    sensor = take.header.setup.layout.drivers["index_distal"]
    flipped = so3.from_axis_angle(np.array([1.0, 0.0, 0.0]), np.array(np.pi * 0.7))
    motion.q_world_sensor[200:300, sensor] = so3.multiply(
        motion.q_world_sensor[200:300, sensor], flipped
    )
    (one,) = find(motion)["impossible"]
    assert one.names[0] == "index_dip_flexion"
    assert one.worst > 20.0
    assert (one.start_s, one.end_s) == pytest.approx((2.0, 2.9), abs=0.11)


def test_a_sensor_that_turns_while_the_hand_rests(motion: Motion, find: Find) -> None:
    still = motion[100:101]
    rest = Motion(*(np.repeat(getattr(still, name), 900, axis=0) for name in Motion.__slots__))
    time_s = np.arange(900) * 0.01
    rest = replace(rest, time_us=(time_s * 1e6).astype(np.int64))
    creep = so3.about_z(np.deg2rad(20.0 / 60.0) * time_s)
    rest.q_world_sensor[:, 5] = so3.multiply(creep, rest.q_world_sensor[:, 5])
    (one,) = find(rest)["drift"]
    assert one.names == ("SN6",)
    assert one.worst == pytest.approx(20.0, abs=1.0)


def test_thousands_are_told_as_hundreds(motion: Motion, find: Find) -> None:
    motion.doubt[::2, 0] |= np.uint8(Doubt.SATURATED)
    told = find(motion)["saturated"]
    assert len(told) == MOST
    assert told[-1].end_s > 11.9


def test_a_survey_is_kept_beside_the_motion(take: Take, monkeypatch: pytest.MonkeyPatch) -> None:
    assert kept_survey(take) is None
    found = survey(take)
    assert found == stretches_of(take.header.setup, process(take))
    monkeypatch.setattr("handstudio.survey.stretches_of", None)
    assert survey(take) == found
    (kept,) = Path(take.path.with_suffix(".motion")).glob("*/stretches.json")
    kept.write_text("{")
    assert kept_survey(take) is None
