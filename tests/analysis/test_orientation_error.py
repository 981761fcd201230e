"""Errors of orientations against rotations made by hand, and on real recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.real import broad_trial, dfjimu_trial, imported, mean
from benchmarks.recordings import broad_folder, dfjimu_folder
from handstudio.analysis.orientation_error import (
    aligned_heading,
    orientation_error,
    relative_error,
    with_oracle_heading,
)
from handstudio.maths import so3

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
N = 50


@pytest.fixture
def q_ref() -> np.ndarray:
    return so3.normalize(np.random.default_rng(1).normal(size=(N, 4)))


def turned(axis: np.ndarray, degrees: np.ndarray | float, q: np.ndarray) -> np.ndarray:
    """The same orientations in a world that is turned."""
    return so3.multiply(so3.from_axis_angle(axis, np.deg2rad(degrees)), q)


def degrees(error: object) -> tuple[float, float, float]:
    return tuple(np.rad2deg([error.total, error.heading, error.inclination]))


# --- total, heading, inclination --------------------------------------------------------------


def test_no_error_is_none_whatever_the_quaternions_signs(q_ref):
    signs = np.where(np.arange(N)[:, None] % 2, 1.0, -1.0)
    np.testing.assert_allclose(degrees(orientation_error(q_ref, signs * q_ref)), 0.0, atol=1e-5)


@pytest.mark.parametrize("size", [0.5, 30.0, 179.0, -30.0])
def test_a_turn_about_the_vertical_is_heading_alone(q_ref, size):
    error = degrees(orientation_error(q_ref, turned(Z, size, q_ref)))
    np.testing.assert_allclose(error, (abs(size), abs(size), 0.0), atol=1e-5)


@pytest.mark.parametrize("size", [0.5, 30.0, 179.0, -30.0])
@pytest.mark.parametrize("towards", [0.0, 1.0, 4.0])
def test_a_tilt_is_inclination_alone(q_ref, size, towards):
    level = np.array([np.cos(towards), np.sin(towards), 0.0])
    error = degrees(orientation_error(q_ref, turned(level, size, q_ref)))
    np.testing.assert_allclose(error, (abs(size), 0.0, abs(size)), atol=1e-5)


def test_a_turn_after_a_tilt_is_both(q_ref):
    error = degrees(orientation_error(q_ref, turned(Z, 40.0, turned(X, 25.0, q_ref))))
    half = np.cos(np.deg2rad(20.0)) * np.cos(np.deg2rad(12.5))
    total = np.rad2deg(2.0 * np.arccos(half))
    np.testing.assert_allclose(error, (total, 40.0, 25.0), atol=1e-6)


def test_errors_are_root_mean_squares_over_the_instants_that_are_seen(q_ref):
    q_est = turned(X, np.where(np.arange(N) < N // 2, 10.0, 20.0), q_ref)
    expected = np.sqrt((10.0**2 + 20.0**2) / 2.0)
    assert degrees(orientation_error(q_ref, q_est))[0] == pytest.approx(expected)
    unseen = q_ref.copy()
    unseen[N // 2 :] = np.nan
    unseen[3, 2] = np.nan
    np.testing.assert_allclose(
        degrees(orientation_error(unseen, q_est)), (10.0, 0.0, 10.0), atol=1e-5
    )


def test_where_nothing_was_seen_there_is_no_error_to_tell(q_ref):
    with pytest.raises(ValueError, match="no instant"):
        orientation_error(np.full_like(q_ref, np.nan), q_ref)


def test_quaternions_that_are_not_quite_of_length_one_do_not_matter(q_ref):
    q_est = turned(X, 7.0, q_ref)
    error = orientation_error(1.01 * q_ref, 0.99 * q_est)
    np.testing.assert_allclose(degrees(error), (7.0, 0.0, 7.0), atol=1e-5)


# --- headings that are aligned ----------------------------------------------------------------


@pytest.mark.parametrize("offset", [0.0, 75.0, -179.0, 180.0])
def test_one_offset_of_heading_is_taken_out_and_nothing_else(q_ref, offset):
    tilted = turned(X, 5.0, q_ref)
    aligned = aligned_heading(q_ref, turned(Z, offset, tilted))
    np.testing.assert_allclose(
        degrees(orientation_error(q_ref, aligned)), (5.0, 0.0, 5.0), atol=1e-5
    )


def test_instants_that_were_not_seen_do_not_spoil_the_alignment(q_ref):
    unseen = q_ref.copy()
    unseen[::3] = np.nan
    aligned = aligned_heading(unseen, turned(Z, 75.0, q_ref))
    np.testing.assert_allclose(degrees(orientation_error(q_ref, aligned)), 0.0, atol=1e-5)


def test_an_oracle_leaves_the_inclination_alone(q_ref):
    wander = np.linspace(-170.0, 170.0, N)
    q_est = turned(Z, wander, turned(X, 5.0, q_ref))
    left = degrees(orientation_error(q_ref, with_oracle_heading(q_ref, q_est)))
    np.testing.assert_allclose(left, (5.0, 0.0, 5.0), atol=1e-5)


# --- between two sensors ----------------------------------------------------------------------


def test_what_both_sensors_have_wrong_alike_is_no_relative_error(q_ref):
    child = so3.multiply(q_ref, so3.exp(np.array([0.1, 0.7, -0.4])))
    alike = [turned(Z, 30.0, q) for q in (q_ref, child)]
    assert relative_error(q_ref, child, *alike) == pytest.approx(0.0, abs=1e-7)
    off = so3.multiply(alike[1], so3.exp(np.array([0.0, np.deg2rad(4.0), 0.0])))
    assert np.rad2deg(relative_error(q_ref, child, alike[0], off)) == pytest.approx(4.0)


def test_a_relative_error_is_over_the_instants_in_which_both_are_seen(q_ref):
    child = turned(X, 20.0, q_ref)
    off = turned(X, np.where(np.arange(N) < 30, 3.0, 50.0), child)
    parent_seen, child_seen = q_ref.copy(), child.copy()
    parent_seen[30:40] = child_seen[40:] = np.nan
    error = relative_error(parent_seen, child_seen, q_ref, off)
    assert np.rad2deg(error) == pytest.approx(3.0)


# --- real recordings --------------------------------------------------------------------------

VQF_ON_BROAD = {  # [deg], measured on the whole arrays with the authors' package alone
    "02_undisturbed_slow_rotation_B": 1.38,
    "08_undisturbed_fast_rotation_with_breaks_A": 3.34,
    "16_undisturbed_fast_translation_B": 0.74,
    "21_undisturbed_fast_combined": 4.08,
    "31_disturbed_stationary_magnet_D": 3.21,
    "34_disturbed_attached_magnet_3cm": 3.35,
}


@pytest.mark.real
def test_vqf_errs_on_broad_as_its_package_does_through_import_take_and_process(
    data_dir: Path, tmp_path: Path
) -> None:
    trials = {
        name: broad_trial(
            imported(data_dir / "broad" / f"{name}.mat", broad_folder, tmp_path, "BROAD", "vqf")
        )
        for name in VQF_ON_BROAD
    }
    for name, expected in VQF_ON_BROAD.items():
        assert trials[name]["total"] == pytest.approx(expected, abs=0.05), name
    assert mean(trials)["total"] == pytest.approx(2.68, abs=0.05)


@pytest.mark.real
def test_between_two_segments_inclination_alone_costs_under_two_degrees(
    data_dir: Path, tmp_path: Path
) -> None:
    trials = {
        path.stem: dfjimu_trial(imported(path, dfjimu_folder, tmp_path, "dfjimu", "vqf"), path)
        for path in sorted((data_dir / "dfjimu").glob("*.mat"))
    }
    assert len(trials) == 10
    assert mean(trials)["inclination_only"] == pytest.approx(1.85, abs=0.05)
