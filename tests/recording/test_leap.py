"""Recordings of real hands from files: what is read, and what odd files are told."""

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handstudio.errors import TakeError
from handstudio.hand.skeleton import FINGERS
from handstudio.recording.leap import read_leap, recordings_in
from handstudio.simulation.motions.actor import Actor, Material
from handstudio.simulation.motions.language import perform
from handstudio.simulation.motions.recorded import recorded_angles
from handstudio.simulation.subject import subject

FRAMES = 60


def frame(number: int, hand_id: int = 7, side: str = "right") -> dict[str, Any]:
    """A flat right hand, palm down and pointing away, whose index finger bends its PIP."""
    bend = np.deg2rad(1.0 * number)
    pointables = []
    for kind in (2, 0, 1, 3, 4):  # in no order
        x = 20.0 * (kind - 2)
        mcp, pip = np.array([x, 200.0, 0.0]), np.array([x, 200.0, -40.0])
        on = np.array([0.0, -np.sin(bend), -np.cos(bend)]) * (kind == 1)
        on = on if kind == 1 else np.array([0.0, 0.0, -1.0])
        places = (mcp, pip, pip + 25.0 * on, pip + 45.0 * on)
        names = ("mcpPosition", "pipPosition", "dipPosition", "tipPosition")
        joints = {name: place.tolist() for name, place in zip(names, places, strict=True)}
        pointables.append({"type": kind, "handId": hand_id, "tool": False, **joints})
    hand = {"id": hand_id, "type": side, "direction": [0, 0, -1], "palmNormal": [0, -1, 0]}
    stamp = 5_000_000 + number * 9_000
    return {"timestamp": stamp, "hands": [hand], "pointables": pointables}


def content() -> dict[str, Any]:
    return {"metadata": {"formatVersion": 1}, "frames": [frame(n) for n in range(FRAMES)]}


def written(folder: Path, what: object, name: str = "bend.json") -> Path:
    path = folder / name
    path.write_text(json.dumps(what), encoding="utf-8")
    return path


def test_places_are_metres_with_z_up_and_fingers_in_their_order(tmp_path):
    recording = read_leap(written(tmp_path, content()))
    assert recording.side == "right"
    np.testing.assert_allclose(recording.time_s, 0.009 * np.arange(FRAMES), atol=1e-9)
    np.testing.assert_allclose(recording.palm, np.tile(np.eye(3), (FRAMES, 1, 1)), atol=1e-12)
    middle = FINGERS.index("middle")
    np.testing.assert_allclose(recording.joints_m[0, middle, 1], [0.0, 0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(recording.joints_m[0, middle, 2], [0.0, 0.04, 0.2], atol=1e-12)
    assert np.isnan(recording.joints_m[:, middle, 0]).all()
    # the thumb's first joint is the base of its metacarpal, and it has no DIP
    assert np.isfinite(recording.joints_m[:, 0, [0, 1, 2, 4]]).all()
    assert np.isnan(recording.joints_m[:, 0, 3]).all()


def test_a_finger_that_bends_bends(tmp_path):
    named = recorded_angles(read_leap(written(tmp_path, content())))
    np.testing.assert_allclose(np.rad2deg(named["index_pip_flexion"]), np.arange(FRAMES), atol=1e-6)
    for name in ("index_mcp_flexion", "middle_pip_flexion", "wrist_flexion", "elbow_flexion"):
        np.testing.assert_allclose(named[name], 0.0, atol=1e-9)


def test_frames_without_the_whole_hand_are_left_out(tmp_path):
    what = content()
    what["frames"][3]["hands"] = []
    del what["frames"][9]["pointables"][2]
    what["frames"][12]["pointables"].append({"type": 9, "handId": 7, "tool": True})
    assert len(read_leap(written(tmp_path, what)).time_s) == FRAMES - 2


def test_of_two_hands_it_is_the_one_seen_longest(tmp_path):
    what = content()
    for each in what["frames"][:10]:
        other = deepcopy(frame(0, hand_id=3, side="left"))
        each["hands"].insert(0, other["hands"][0])
        each["pointables"] += other["pointables"]
    recording = read_leap(written(tmp_path, what))
    assert recording.side == "right"
    assert len(recording.time_s) == FRAMES


def spoiled(value: object, *where: Any) -> dict[str, Any]:
    """The content with another value at a place in it."""
    what = content()
    at: Any = what
    for key in where[:-1]:
        at = at[key]
    at[where[-1]] = value
    return what


def without(name: str) -> list[dict[str, Any]]:
    return [{**each, name: []} for each in content()["frames"]]


THIRD, HAND, FINGER = ("frames", 3), ("frames", 3, "hands", 0), ("frames", 3, "pointables", 0)


@pytest.mark.parametrize(
    ("value", "where", "told"),
    [
        (without("hands"), ("frames",), "there is no hand in this recording"),
        (without("pointables"), ("frames",), "the hand is never seen whole"),
        ("here", (*FINGER, "tipPosition"), "frame 3: tipPosition is missing or makes no sense"),
        ([1.0, 2.0], (*FINGER, "tipPosition"), "frame 3: tipPosition is missing"),
        (None, (*FINGER, "mcpPosition"), "frame 3: mcpPosition is missing"),
        ([[1, 2, 3]], (*FINGER, "mcpPosition"), "frame 3: mcpPosition is missing"),
        ([0.0, None, 1.0], (*HAND, "palmNormal"), "frame 3: palmNormal is missing"),
        ([0, 0, -1], (*HAND, "palmNormal"), "frame 3: direction and palmNormal"),
        (None, (*THIRD, "timestamp"), "frame 3: timestamp is missing or makes no sense"),
        (float("nan"), (*THIRD, "timestamp"), "frame 3: timestamp is missing"),
        (10**400, (*THIRD, "timestamp"), "frame 3: timestamp is missing"),
        (1, (*THIRD, "timestamp"), "the frames are not in the order of their time"),
        ("both", (*HAND, "type"), "the hand is said to be both, right"),
        ([["id", "timestamp"], [1, 2]], ("frames",), "holds no list of frames with names"),
        ([], ("frames",), "holds no list of frames with names"),
        (None, ("frames",), "holds no list of frames with names"),
    ],
)
def test_an_odd_file_is_told_what_is_odd(tmp_path, value, where, told):
    with pytest.raises(TakeError, match=told):
        read_leap(written(tmp_path, spoiled(value, *where)))


@pytest.mark.parametrize("value", [None, 3, "x", [], {}, [3], [[]], {"id": []}, 1.0, True, [None]])
@pytest.mark.parametrize(
    "where",
    [
        THIRD,
        (*THIRD, "hands"),
        (*THIRD, "pointables"),
        HAND,
        (*HAND, "id"),
        (*HAND, "type"),
        FINGER,
        (*FINGER, "type"),
        (*FINGER, "handId"),
    ],
)
def test_whatever_stands_in_a_frame_it_is_read_or_refused(tmp_path, where, value):
    path = written(tmp_path, spoiled(value, *where))
    try:
        recording = read_leap(path)
    except TakeError as error:
        assert str(path) in error.what  # noqa: PT017
    else:
        assert FRAMES - 1 <= len(recording.time_s) <= FRAMES


@pytest.mark.parametrize(
    "raw", [b"", b"PK\x03\x04\xff", b"[1, 2", b"[]", b'"frames"', b"[" * 100_000]
)
def test_what_is_no_json_is_refused(tmp_path, raw):
    path = tmp_path / "odd.json"
    path.write_bytes(raw)
    with pytest.raises(TakeError, match=r"odd\.json"):
        read_leap(path)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(TakeError, match="no recording of a hand can be read"):
        read_leap(tmp_path / "nothing.json")


def test_a_folder_gives_its_recordings_by_name_and_reads_none_of_them(tmp_path):
    written(tmp_path, content(), "wave.json")
    written(tmp_path, "nothing", "broken.json")
    (tmp_path / "notes.txt").write_text("x", encoding="utf-8")
    known = recordings_in(tmp_path)
    assert list(known) == ["broken", "wave"]
    assert known["wave"]().side == "right"
    assert recordings_in(tmp_path / "elsewhere") == {}


@pytest.mark.real
def test_real_recordings_are_played_by_any_subject(data_dir):
    known = recordings_in(data_dir / "leap")
    assert known
    actor = Actor(subject(3, "left"), material=Material(recordings=known))
    for name in known:
        part = perform(f"recorded:{name}", actor)
        assert part.duration_s > 2.0
        rates = part.derivatives(np.arange(0.0, part.duration_s, 0.005))[1]
        assert 60.0 < np.rad2deg(np.abs(rates[:, :-3]).max()) < 900.0
