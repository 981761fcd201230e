"""The figures of the calibration benchmark have the names that others look for."""

from __future__ import annotations

import pytest

from benchmarks import calibration
from benchmarks.calibrated import Errors
from benchmarks.calibration import summed

ONE = Errors(
    person=1,
    centre_mm={"elbow": 2.0, "ulnar_cmc": 9.0, "index_pip": 1.0},
    along_mm={"index_pip": -1.5},
    link_mm={"index_pip": (-0.5, 1.0), "index_dip": (3.0, 1.0), "ring_mcp": (30.0, 1.0)},
    axis_deg={"index_pip": 0.4, "index_dip": 0.8},
    frame_deg={"index_pip": 1.0},
)


def test_figures_are_of_all_joints_but_the_ulnar_cmc_and_of_lengths_that_people_know():
    found = summed([ONE])
    assert found["joint_centre_mm"]["median"] == 1.5
    assert found["joint_centre_mm"]["worst"] == 2.0
    assert found["joint_centre_mm"]["ulnar_cmc_median"] == 9.0
    assert found["link_mm"]["worst"] == 3.0
    assert found["link_mm"]["in_band_pct"] == 50.0
    assert found["axis_deg"]["median"] == pytest.approx(0.6)


def test_other_benchmarks_give_theirs(monkeypatch):
    monkeypatch.delenv(calibration.RECORDINGS, raising=False)
    heading = {"cases": {"calibrated": {"ours": 0.1}}}
    monkeypatch.setattr(calibration.heading, "measured", lambda *_: heading)
    sensors = {"after": {"gyro_scale_pct": {"median": 0.006}}}
    monkeypatch.setattr(calibration.sensor_errors, "measured", lambda *_: sensors)
    sloppy = {"caught_pct": 99.0, "false_alarm_pct": 1.0}
    monkeypatch.setattr(calibration.sloppy, "measured", lambda *_: sloppy)
    found = calibration._others([1], development=True)
    assert found["heading_sd_deg"] == {"calibrated": 0.1}
    assert found["gyro_scale_pct"] == {"median": 0.006}
    assert found["sloppy"] == sloppy
    assert found["lever_arm_scatter_mm"] is None  # without the recordings
