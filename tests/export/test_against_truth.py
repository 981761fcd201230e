"""Exports of a simulated take against what was true: no more is off than the filter's own error."""

from __future__ import annotations

import ezc3d
import numpy as np
import pyarrow.parquet
import pytest

from handstudio.analysis.hand_error import angle_errors
from handstudio.hand.angles import hand_angles
from handstudio.kinematics import angles_of, measured_angles
from handstudio.recording.truth import TruthFile, load_truth

from .test_opensim import read as read_mot


@pytest.fixture(scope="module")
def truth(whole) -> TruthFile:
    return load_truth(whole.take.path)


@pytest.fixture(scope="module")
def own_error(whole, truth) -> float:
    """Mean RMS error of the angles as the pipeline has them [deg], from a second on."""
    angles = measured_angles(whole.setup.layout)
    found = angles_of(whole.setup, whole.motion, angles)
    return _error(truth, [a.name for a in angles], np.rad2deg(found))


def _error(truth: TruthFile, names: list[str], degrees: np.ndarray) -> float:
    every = [angle.name for angle in hand_angles()]
    true = truth.angles[: len(degrees), [every.index(name) for name in names]].astype(float)
    errors = angle_errors(names, true[100:], np.deg2rad(degrees)[100:])
    return float(np.rad2deg(errors.mean))


def test_times_are_those_of_the_truth(into, whole, truth):
    table = pyarrow.parquet.read_table(into("parquet", whole))
    time_s = table["time_s"].to_numpy()
    expected = (truth.time_us - truth.time_us[0])[: len(time_s)] / 1e6
    np.testing.assert_allclose(time_s, expected, atol=1e-12)


def test_angles_are_off_by_what_the_filter_is(into, whole, truth, own_error):
    assert 0.05 < own_error < 2.0
    table = pyarrow.parquet.read_table(into("parquet", whole))
    names = [n.removesuffix("_deg") for n in table.column_names if n.endswith("_deg")]
    degrees = np.stack([table[f"{name}_deg"].to_numpy() for name in names], axis=1)
    assert _error(truth, names, degrees) == pytest.approx(own_error, abs=1e-6)
    fingers = tuple(name for name in names if "mcp" in name or "ip" in name)
    _, found, rows = read_mot(into("mot", whole, angles=fingers))
    mot = np.array(rows, dtype=float)[:, 1:]
    few = degrees[:, [names.index(name) for name in found]]
    assert _error(truth, found, mot) == pytest.approx(_error(truth, found, few), abs=1e-4)


def test_places_of_a_left_hand_are_off_by_what_its_attitudes_are(into, whole, points, truth):
    file = ezc3d.c3d(str(into("c3d", whole)))
    found = np.moveaxis(file["data"]["points"][:3], -1, 0).swapaxes(1, 2)
    assert _off_mm(truth, found) == pytest.approx(_off_mm(truth, points), abs=1e-3)
    assert _off_mm(truth, found) < 0.2 * _off_mm(truth, found * [1.0, -1.0, 1.0]), "no mirror image"


def _off_mm(truth: TruthFile, points_mm: np.ndarray) -> float:
    """RMS distance of the points from the true ones, from a second on; the elbow is where it is."""
    count = len(points_mm)
    true = 1e3 * np.concatenate([truth.t_world_joint, truth.t_world_tip], axis=1)[100:count]
    return float(np.sqrt(np.mean(np.sum((points_mm[100:] - true) ** 2, axis=-1))))
