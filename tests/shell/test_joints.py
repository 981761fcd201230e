"""Joints from the shell: from a file with two terminals to a place with its uncertainty."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from handstudio.commands.joints import joints
from handstudio.errors import TrackError
from handstudio.simulation.bending import bending
from handstudio.simulation.imperfections.strengths import parse
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.subject import subject
from handstudio.simulation.trackers import TrackerErrors, tracked


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finger held straight and bent, as a tracker's own software exports it."""
    someone = subject(2)
    trajectory = bending(Actor(someone), "index_dip", 8.0)
    segments = ("index_intermediate", "index_distal")
    told = tracked(
        someone, trajectory, segments, TrackerErrors(), 2, skin=parse("ideal,slide"), base="hand",
        rate_hz=60.0,
    ).tracks  # fmt: skip
    columns = ["time_s"] + [f"{t.name}_{c}" for t in told for c in COLUMNS]
    rows = [1e-6 * told[0].time_us[:, None]]
    for track in told:
        rows += [1e3 * track.t_room_terminal, track.q_room_terminal]
    path = tmp_path_factory.mktemp("tracks") / "finger.csv"
    np.savetxt(path, np.hstack(rows), delimiter=",", header=",".join(columns), comments="")
    return path


COLUMNS = ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")


def test_the_joint_is_printed_with_its_uncertainty(here, file: Path):
    said = here("joints", file, "--every-method")
    assert said.code == 0, said.err
    for word in ("rolling", "steady", "helical", "±", "The joint can be used."):
        assert word in said.out


def test_a_program_gets_si(here, file: Path):
    said = here("joints", file, "--json", "--method", "symmetric")
    assert said.code == 0, said.err
    found = said.json["joints"]["symmetric"]
    assert 0.005 < np.linalg.norm(found["p_upper_m"]) < 0.04
    assert np.shape(found["p_upper_covariance_m2"]) == (3, 3)
    assert said.json["terminals"] == ["index_intermediate", "index_distal"]


def test_swapped_terminals_are_told(here, file: Path):
    said = here("joints", file, "--terminals", "index_distal", "index_intermediate")
    assert "They seem swapped" in said.err


def test_what_cannot_be_done_is_said(file: Path):
    with pytest.raises(TrackError, match="two are needed"):
        joints(file, terminals=("thumb", "index_distal"))
    with pytest.raises(TrackError, match="is no way"):
        joints(file, method="magic")
    with pytest.raises(TrackError, match="names no markers"):
        joints(file, cluster=("hand",))
    with pytest.raises(TrackError, match="holds no instant"):
        joints(file, start_s=100.0)
