"""A hand whose place in a tracker's room is known: every format has it at the same places."""

from __future__ import annotations

import json

import numpy as np
import pytest

from handstudio.export.export import export
from handstudio.export.formats import FORMATS
from handstudio.export.part import Processed, Window
from handstudio.hand.skeleton import SEGMENTS
from handstudio.process import process
from handstudio.recording.simulated import rehearse, simulate
from handstudio.recording.take import open_take
from handstudio.recording.take_track import save_track
from handstudio.rooted import aligned_track
from handstudio.simulation.imperfections.strengths import IDEAL

from ..test_rooted import LEVER, MOTION, SENSOR, _track
from .test_mcap import placed, read
from .test_positions import bvh_points, glb_points, read_c3d, read_trc

WITHIN_MM = 0.1


@pytest.fixture(scope="module")
def roomy(tmp_path_factory) -> Processed:
    """The tracker begins late, so that at first no place is known."""
    sessions = tmp_path_factory.mktemp("sessions")
    path = simulate(sessions, rehearse(0, MOTION, IDEAL), seconds=10.0, code="S01")
    take = open_take(path)
    motion = process(take)
    track = _track(path, SENSOR)
    save_track(path, aligned_track(take, motion, track, "t.csv", sensor=SENSOR, lever_m=LEVER))
    return Processed(take, take.header.setup, motion)


@pytest.fixture
def written(roomy, tmp_path):
    """Writes a window from before the first place to the end: the file, and its sidecar."""

    def write(name):
        path = tmp_path / f"roomy.{name}"
        export(roomy, path, FORMATS[name], window=Window(1.0, None))
        return path, json.loads((tmp_path / f"roomy.{name}.json").read_text())

    return write


@pytest.fixture
def expected(written):
    """Places by `trc` [mm]; where they are not known what is held in their place."""
    points = read_trc(written("trc")[0])[2]
    known = np.isfinite(points[:, 0, 0])
    assert 0 < known.sum() < len(known)
    elbow = points[known, 0]
    assert np.linalg.norm(elbow.max(axis=0) - elbow.min(axis=0)) > 50.0  # or it proves nothing
    return points, known


def test_c3d_bvh_and_glb_are_at_the_places_of_trc(written, expected):
    points, known = expected
    found = {
        "c3d": read_c3d(written("c3d")[0])[1],
        "bvh": bvh_points(written("bvh")[0])[1],
        "glb": glb_points(written("glb")[0])[2],
    }
    skin = written("glb-skin")[0]
    found["glb-skin"] = glb_points(skin.rename(skin.with_suffix(".glb")))[2]
    for name, places in found.items():
        np.testing.assert_allclose(places[known], points[known], atol=WITHIN_MM, err_msg=name)
        if name != "c3d":  # which has gaps
            first = points[known][0, 0]
            held = np.broadcast_to(first, places[~known, 0].shape)
            np.testing.assert_allclose(places[~known, 0], held, atol=WITHIN_MM)


def test_the_sidecars_say_whose_axes_these_are(written, roomy):
    for name in ("trc", "c3d", "bvh", "glb", "mcap"):
        about = written(name)[1]
        assert "tracker's room" in about["axes"], name
        assert "north" not in about["axes"]
        assert about["track"]["sensor"] == SENSOR
        assert 0.0 < about["without_a_place_percent"] < 20.0
    assert "held" in written("bvh")[1]["without_a_place"]


def test_mcap_has_the_forearm_in_the_room_and_leaves_it_out_where_nobody_knows(written, expected):
    points, known = expected
    messages = [message for _, message in read(written("mcap")[0])[1]["/tf"]]
    told = [message.transforms[0].child_frame_id == SEGMENTS[0] for message in messages]
    assert told == known.tolist()
    counts = [len(message.transforms) for message in messages]
    assert counts == [len(SEGMENTS) - 1 + there for there in told]
    for k in np.flatnonzero(known)[::100]:
        found = placed(messages[k])
        places = [found[name] for name in SEGMENTS]
        np.testing.assert_allclose(places, points[k, : len(SEGMENTS)], atol=WITHIN_MM)
