"""Checking a calibration, and aligning headings, from the shell."""

from __future__ import annotations

from pathlib import Path

import pytest

from handstudio.process import aligned_setup
from handstudio.recording.calibrations import save_calibration
from handstudio.recording.notes import load_notes, save_notes, with_label
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.simulation.imperfections.strengths import parse

from .test_calibration import hand


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    way = rehearse(0, "quick_start+flat_hand+open_close", parse("typical"), 2)
    path: Path = simulate(tmp_path_factory.mktemp("sessions"), way, seconds=18.0)
    save_notes(path, with_label(load_notes(path), 9.5, 16.5, "open_close"))
    return path


@pytest.mark.long
def test_a_take_is_checked_against_a_calibration(handstudio, take, tmp_path):
    file = save_calibration(tmp_path, hand())
    said = handstudio("check", take, "--calibration", file)
    assert "The calibration one" in said.out
    told = handstudio("check", take, "--calibration", file, "--json").json
    assert told["calibration"] == "one"
    assert told["verdicts"][0]["step"] == "check"


def test_without_a_calibration_or_a_take_it_says_so(handstudio, take):
    assert "no calibration that could be checked" in handstudio("check", take).err
    assert "No take was named" in handstudio("check").err


@pytest.mark.long
def test_headings_are_aligned_by_the_takes_own_quick_start(handstudio, take):
    plain = handstudio("process", take, "--json").json
    said = handstudio("process", take, "--align", "--json")
    assert said.json == plain
    assert "headings aligned" in said.err
    setup, found = aligned_setup(open_take(take))
    assert setup.heading_rad == found.psi_cor
    assert "headings aligned" in handstudio("export", take, "--align").err
