"""What every format keeps to: it is whole or not there, tells where it is from, holds a window."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import get_args

import pytest

from handstudio.commands.exporting import FormatName
from handstudio.errors import HandstudioError, TakeError
from handstudio.export import frames as frames_module
from handstudio.export import glb as glb_module
from handstudio.export import part as part_module
from handstudio.export.export import export
from handstudio.export.formats import FORMATS, format_named
from handstudio.export.part import Processed, Window
from handstudio.recording.naming import file_name

NEED_A_HAND = ("mot", "trc", "c3d", "bvh", "glb", "glb-skin", "svg")


def test_the_shell_offers_every_format():
    assert get_args(FormatName) == tuple(FORMATS)
    with pytest.raises(HandstudioError, match=r"no format 'fbx'.*\n.*csv, parquet, mot"):
        format_named("fbx")


@pytest.mark.parametrize("name", FORMATS)
def test_the_sidecar_of_every_format_tells_the_same_of_the_take(into, whole, name):
    target = into(name, whole, start_s=1.0, end_s=3.0)
    told = json.loads(target.with_name(target.name + ".json").read_text("utf-8"))
    assert {key: told[key] for key in whole.about} == json.loads(json.dumps(whole.about))
    assert told["format"] == name
    assert (told["window_s"], told["instants"]) == ([1.0, 3.0], 201)
    assert told["gaps_s"] == []
    assert told["missing"] == [
        "No calibration of the wearer: sensors are taken to sit squarely on their segments, "
        "the hand to have mean proportions."
    ]


@pytest.mark.parametrize("name", FORMATS)
def test_gaps_and_doubts_are_told_with_every_format(into, gappy, name):
    target = into(name, gappy)
    told = json.loads(target.with_name(target.name + ".json").read_text("utf-8"))
    assert told["gaps_s"] == [[2.99, 3.4]]
    assert told["doubtful_s"]["SN17"] == [[0.0, 0.48, "unplaced"]]
    assert "1 gaps, 0.41 s in all" in told["missing"][-1]
    assert ("in_gaps" in told) == (name in ("bvh", "glb", "glb-skin"))


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX limits")
@pytest.mark.parametrize("name", FORMATS)
def test_a_full_disk_leaves_what_was_there_and_no_half_file(into, whole, name, limit_of_file_size):
    target = into(name, whole, end_s=0.05)
    before = {path.name: path.read_bytes() for path in target.parent.iterdir()}
    limit = max(map(len, before.values())) + 1000
    with limit_of_file_size(limit), pytest.raises(TakeError, match=r"cannot be written.*\nFree"):
        into(name, whole)
    assert {path.name: path.read_bytes() for path in target.parent.iterdir()} == before
    assert sorted(before) == [f"out.{name}", f"out.{name}.json"]


@pytest.mark.parametrize("name", FORMATS)
def test_who_stops_it_half_way_leaves_nothing(whole, tmp_path, name):
    def stop(_share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(whole, tmp_path / "out", FORMATS[name], progress=stop)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in ("mcap", "svg")])
def test_how_much_is_written_at_a_time_changes_no_byte(into, gappy, monkeypatch, name):
    once = into(name, gappy).read_bytes()
    for module in (part_module, frames_module, glb_module):
        monkeypatch.setattr(module, "BLOCK", 97)
    again = into(name, gappy).read_bytes()
    if name != "parquet":  # whose row groups are the blocks
        assert again == once


@pytest.mark.parametrize("name", NEED_A_HAND)
def test_a_take_without_a_hand_says_what_can_be_had_of_it(into, door, name):
    source = Processed(door[0], door[0].header.setup, door[1])
    with pytest.raises(
        TakeError, match=r"no joint angles.*which hand.*\n.*csv, parquet, sto, mcap"
    ):
        into(name, source)
    assert list(into.folder.glob("out*")) == []


def test_a_format_that_holds_something_else_says_what_it_holds(into, whole):
    with pytest.raises(TakeError, match=r"csv holds no skeleton.*\n.*angles, orientations"):
        into("csv", whole, "skeleton")


@pytest.mark.parametrize("name", ["csv", "mot", "svg", "mcap"])
def test_an_angle_that_there_is_not_is_named_with_those_there_are(into, whole, name):
    with pytest.raises(TakeError, match=r"no angle index_knee.*\n.*index_pip_flexion"):
        into(name, whole, angles=("index_knee",))
    assert list(into.folder.glob("out*")) == []


def test_only_the_angles_that_are_wanted(into, whole):
    wanted = ("index_pip_flexion", "thumb_ip_flexion")
    line = into("csv", whole, angles=wanted).read_text().splitlines()[0]
    assert line == ('"time_s","index_pip_flexion_deg","thumb_ip_flexion_deg","doubtful_sensors"')


@pytest.mark.parametrize("name", FORMATS)
def test_files_lie_beside_the_take_and_are_no_takes(whole, name):
    chosen, take = FORMATS[name], Path("visit/fist.mcap")
    content = chosen.content(None, whole.setup.layout)
    target = chosen.target(take, content)
    assert target.suffix == f".{name.partition('-')[0]}"
    assert target.parent == take.parent
    assert target != take
    if name == "mcap":
        assert file_name(target.stem, "take") != target.stem


def test_a_window_of_one_instant_is_enough(into, whole):
    for name in FORMATS:
        into(name, whole, start_s=2.0, end_s=2.0)
    assert Window() == Window(0.0, None)
