"""A cluster of markers as a terminal: gaps, and clusters that tell no attitude."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.recording.tracks import read_markers
from handstudio.trackers.markers import Cluster, cluster_of, track_of
from handstudio.trackers.poses import placed

FOUR = np.array([[0.0, 0.0, 0.0], [0.04, 0.0, 0.0], [0.01, 0.03, 0.0], [0.0, 0.01, 0.02]])
NAMES = ("a", "b", "c", "d")


def _moved(shape: Array, count: int = 50, noise: float = 0.0) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(2)
    q = so3.normalize(rng.standard_normal((count, 4)))
    t = rng.standard_normal((count, 3))
    places = placed(q[:, None], t[:, None], shape[None])
    return q, t, places + noise * rng.standard_normal(places.shape)


def _time(count: int) -> Array:
    return 10_000 * np.arange(count, dtype=np.int64)


@pytest.mark.parametrize("markers", [3, 4])
def test_poses_come_back_whichever_marker_is_missing(markers: int) -> None:
    cluster = Cluster("hand", NAMES[:markers], FOUR[:markers])
    q, t, places = _moved(FOUR[:markers])
    if markers == 4:
        places[np.arange(50), np.arange(50) % 4] = np.nan
    track = track_of(cluster, _time(50), places)
    np.testing.assert_allclose(track.t_room_terminal, t, atol=1e-12)
    assert so3.angle_between(track.q_room_terminal, q).max() < 1e-7
    assert track.quality.min() > 0.999


def test_fewer_than_three_markers_are_no_pose() -> None:
    _, _, places = _moved(FOUR)
    places[10:20, :2] = np.nan
    track = track_of(Cluster("hand", NAMES, FOUR), _time(50), places)
    assert np.isnan(track.q_room_terminal[10:20]).all()
    assert not track.quality[10:20].any()
    assert np.isfinite(track.t_room_terminal[20:]).all()


def test_a_shape_is_learnt_from_the_recording_itself() -> None:
    _, _, places = _moved(FOUR, 300, noise=2e-4)
    places[::3, 1] = np.nan
    cluster = cluster_of("hand", NAMES, places)
    learnt = np.linalg.norm(cluster.t_cluster_marker[:, None] - cluster.t_cluster_marker, axis=2)
    true = np.linalg.norm(FOUR[:, None] - FOUR, axis=2)
    np.testing.assert_allclose(learnt, true, atol=1e-4)


def test_markers_in_a_row_are_refused() -> None:
    row = np.outer([0.0, 1.0, 2.0, 3.0], [0.02, 0.0, 0.0])
    with pytest.raises(TrackError, match="off one line"):
        Cluster("hand", NAMES, row)
    with pytest.raises(TrackError, match="off one line"):
        cluster_of("hand", NAMES, _moved(row)[2])


def test_two_markers_are_refused() -> None:
    with pytest.raises(TrackError, match="2 markers"):
        cluster_of("hand", NAMES[:2], _moved(FOUR[:2])[2])


def test_when_only_markers_in_a_row_are_seen_there_is_no_pose() -> None:
    shape = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.04, 0.0, 0.0], [0.0, 0.03, 0.0]])
    _, _, places = _moved(shape)
    places[5:9, 3] = np.nan
    track = track_of(Cluster("hand", NAMES, shape), _time(50), places)
    assert np.isnan(track.t_room_terminal[5:9]).all()


def test_a_mirrored_cluster_is_refused() -> None:
    _, _, places = _moved(FOUR * [-1.0, 1.0, 1.0])
    with pytest.raises(TrackError, match="mirror image"):
        track_of(Cluster("hand", NAMES, FOUR), _time(50), places)


def test_a_marker_taken_for_another_lowers_the_quality() -> None:
    _, _, places = _moved(FOUR)
    places[7, [0, 1]] = places[7, [1, 0]]
    track = track_of(Cluster("hand", NAMES, FOUR), _time(50), places)
    assert track.quality[7] < 0.1
    assert track.quality[8] > 0.99


@pytest.mark.real
def test_the_back_of_a_real_hand_is_one_rigid_terminal() -> None:
    folder = os.environ.get("HANDSTUDIO_DATA")
    if not folder:
        pytest.skip("HANDSTUDIO_DATA names no folder of recordings")
    recording = read_markers(Path(folder) / "markers" / "recording.tsv")
    names = ("hand_top", "hand_left", "hand_right")
    places = recording.t_room_marker[:, [recording.names.index(name) for name in names]]
    cluster = cluster_of("hand", names, places)
    track = track_of(cluster, recording.time_us, places)
    assert np.isfinite(track.t_room_terminal).all()
    fitted = placed(
        track.q_room_terminal[:, None], track.t_room_terminal[:, None], cluster.t_cluster_marker
    )
    assert np.sqrt(np.mean(np.sum((fitted - places) ** 2, axis=2))) < 5e-4
    # a marker that goes out of sight for a while takes the pose with it, and only there
    places[1000:1100, 0] = np.nan
    gone = np.isnan(track_of(cluster, recording.time_us, places).t_room_terminal).any(axis=1)
    assert gone.sum() == 100
    assert np.isnan(recording.t_room_marker[:, recording.names.index("thumb_tip")]).any()
