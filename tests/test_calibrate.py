"""From the takes of a course to a subject calibration, and what is refused on the way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from handstudio.calibrate import Calibrated, calibrate
from handstudio.calibration.subject import decode, encode
from handstudio.errors import CalibrationError
from handstudio.hand.skeleton import SEGMENTS
from handstudio.hand_fit import fit_of
from handstudio.recording.notes import Notes, save_notes
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import Take, open_take
from handstudio.recording.truth import load_truth
from handstudio.setup import calibrated
from handstudio.simulation.imperfections.strengths import parse

COURSE = (
    "quick_start+elbow:flexion+wrist:flexion+wrist:deviation+index_mcp:flexion"
    "+index_mcp:abduction+index_pip:flexion+index_dip:flexion+flat_hand"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sessions")


@pytest.fixture(scope="module")
def take(folder: Path) -> Take:
    rehearsed = rehearse(7, COURSE, parse("plain,packets=0.2"), 7)
    return open_take(simulate(folder, rehearsed))


@pytest.fixture(scope="module")
def done(take: Take) -> Calibrated:
    return calibrate([take])


def test_a_course_well_done_has_nothing_to_repeat_but_what_was_left_out(done: Calibrated) -> None:
    assert all(verdict.ok for verdict in done.verdicts), done.verdicts
    assert "little_pip:flexion" in done.to_repeat
    assert "index_pip:flexion" not in done.to_repeat


def test_lengths_are_the_persons_within_their_error_bars(take: Take, done: Calibrated) -> None:
    truth = load_truth(take.path)
    for name in ("index_proximal", "index_intermediate"):
        segment = done.calibration.segments[SEGMENTS.index(name)]
        true = np.linalg.norm(truth.t_parent_joint[SEGMENTS.index(name) + 1])
        assert abs(segment.length_m - true) < 3.0 * segment.length_sd_m
        assert segment.length_source == "measured"


def test_a_setup_with_it_shows_this_hand(take: Take, done: Calibrated) -> None:
    setup = calibrated(take.header.setup, subject=done.calibration)
    fit = fit_of(setup)
    k = SEGMENTS.index("index_intermediate")
    assert fit.skeleton.t_parent_joint[k] == pytest.approx(
        np.array(done.calibration.segments[k].t_parent_joint)
    )
    assert setup.calibration == done.calibration.id
    assert setup.key != take.header.setup.key


def test_it_is_text_that_reads_back(done: Calibrated) -> None:
    assert decode(encode(done.calibration), "it") == done.calibration


@pytest.mark.long
def test_the_same_takes_give_the_same_calibration(take: Take, done: Calibrated) -> None:
    again = calibrate([take]).calibration
    assert again.segments == done.calibration.segments
    assert again.takes == done.calibration.takes


@pytest.mark.long
def test_what_is_done_sloppily_is_told_with_its_reason(folder: Path) -> None:
    course = COURSE.replace("index_pip:flexion", "index_pip:flexion~small")
    told = calibrate([open_take(simulate(folder, rehearse(7, course, parse("plain"), 8)))])
    (bad,) = [v for v in told.verdicts if not v.ok]
    assert bad.step == "index_pip:flexion"
    assert bad.failing[0].what == "range"
    assert "index_pip:flexion" in told.to_repeat


def test_a_take_without_labels_is_refused(folder: Path) -> None:
    path = simulate(folder, rehearse(7, "static+static", parse("plain"), 1))
    save_notes(path, Notes())
    with pytest.raises(CalibrationError, match="labelled"):
        calibrate([open_take(path)])


def test_too_few_joints_are_refused(folder: Path) -> None:
    path = simulate(folder, rehearse(7, "quick_start+index_pip:flexion", parse("plain"), 1))
    with pytest.raises(CalibrationError, match="joints were swung"):
        calibrate([open_take(path)])


def test_takes_of_two_people_are_refused(folder: Path, take: Take) -> None:
    path = simulate(folder, rehearse(8, "static+static", parse("plain"), 1))
    with pytest.raises(CalibrationError, match="another person"):
        calibrate([take, open_take(path)])


def test_no_take_is_refused() -> None:
    with pytest.raises(CalibrationError, match="No take"):
        calibrate([])
