"""Takes and folders of them in several formats: what can be had is there, and the rest is said."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import msgspec
import numpy as np
import pytest

from handstudio.cli import main
from handstudio.layout import JointPlace, Layout, SensorPlace
from handstudio.recording.header import Header
from handstudio.recording.samples_message import encode_samples
from handstudio.recording.simulated import simulate
from handstudio.recording.take import open_take
from handstudio.recording.writer import TakeWriter
from handstudio.samples import ImuSamples
from handstudio.setup import Setup


@pytest.fixture(scope="module")
def two_seconds(tmp_path_factory) -> Path:
    return simulate(tmp_path_factory.mktemp("one"), seconds=2.0, name="fist")


@pytest.fixture
def take(two_seconds, tmp_path) -> Path:
    return Path(shutil.copy(two_seconds, tmp_path))


def door(path: Path) -> Path:
    """A take without a hand: two sensors that lie still."""
    places = (SensorPlace("SN1", "leaf"), SensorPlace("SN2", "frame"))
    layout = Layout("unknown", places, (JointPlace("hinge", "frame", "leaf", 1),))
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = TakeWriter(path, Header(path.stem, "S01", 10**18, Setup(layout, 50.0), "samples", "x"))
    n = 100
    acc = np.tile([0.0, 0.0, 9.81], (n, 2, 1))
    mag = np.tile([20.0, 0.0, -40.0], (n, 2, 1))
    yes, no = np.ones((n, 2), dtype=bool), np.zeros((n, 2), dtype=bool)
    time_us = 20_000 * np.arange(n, dtype=np.int64)
    samples = ImuSamples(time_us, np.zeros((n, 2, 3)), acc, mag, yes, yes, no)
    writer.write(10**18, encode_samples(samples))
    return writer.close()


@pytest.fixture
def sessions(take, tmp_path) -> Path:
    """A hand, a door, takes cut short, interrupted, of a later version and binned."""
    sessions = tmp_path / "sessions"
    visit = sessions / "S01" / "today"
    door(visit / "door.mcap")
    whole = Path(shutil.copy(take, visit / "fist.mcap"))
    (visit / "cut.mcap").write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    shutil.copy(whole, visit / "lost.mcap.recording")
    header = open_take(take).header
    later = msgspec.structs.replace(header, format=99)
    TakeWriter(visit / "later.mcap", later).close()
    (sessions / ".bin" / "x").mkdir(parents=True)
    shutil.copy(whole, sessions / ".bin" / "x" / "binned.mcap")
    return sessions


def test_several_formats_in_one_go(here, take):
    said = here("export", take, "--format", "mot", "--format", "c3d", "--format", "mcap")
    assert said.code == 0, said.err
    files = [take.with_suffix(".mot"), take.with_suffix(".c3d"), take.with_name("fist~motion.mcap")]
    assert said.out.splitlines() == [str(file) for file in files]
    assert all(file.exists() and file.with_name(file.name + ".json").exists() for file in files)
    assert "No calibration of the wearer" in said.err


def test_some_angles_of_a_window_into_a_file_of_any_name(here, take, tmp_path):
    target = tmp_path / "pip.parquet"
    options = ["--angles", "index_pip_flexion", "wrist_flexion", "--start-s", 1, "--end-s", 1.5]
    said = here("export", take, "--format", "parquet", "--to", target, *options)
    assert said.out.splitlines() == [str(target)]
    told = json.loads(target.with_name("pip.parquet.json").read_text("utf-8"))
    assert (told["window_s"], told["format"]) == ([1.0, 1.5], "parquet")


def test_another_filter_and_the_future_are_told(here, take, tmp_path):
    said = here("export", take, "--filter", "raw", "--to", tmp_path / "a.csv")
    assert said.code == 0, said.err
    assert json.loads((tmp_path / "a.csv.json").read_text("utf-8"))["filter"]["type"] == "raw"


def test_of_a_folder_all_that_can_be_had_is_written_and_the_rest_is_said(here, sessions, tmp_path):
    to = tmp_path / "out"
    said = here("export", sessions, "--format", "csv", "--format", "trc", "--to", to)
    assert said.code == 1
    written = sorted(path.relative_to(to) for path in to.rglob("*") if path.suffix != ".json")
    home = Path("S01/today")
    names = ("door.orientations.csv", "fist.angles.csv", "fist.trc")
    assert [path for path in written if path.suffix] == [home / name for name in names]
    assert said.out.splitlines() == [str(to / home / name) for name in names]
    for words in (
        *("cut.mcap", "handstudio recover", "lost.mcap.recording: this recording was interrupted"),
        *("later.mcap", "format 99", "Update handstudio"),
        *("door.mcap:", "no joint angles or positions", "does not say which hand"),
        *("3 files of 5 takes written.", "Not everything of 4: cut.mcap, door.mcap, later.mcap"),
    ):
        assert words in said.err, words
    assert "binned" not in said.err


def test_programs_learn_what_came_of_each_take(here, sessions):
    said = here("export", sessions, "--format", "glb", "--json")
    assert said.code == 1
    by_name = {Path(each["take"]).name: each for each in said.json}
    visit = sessions / "S01" / "today"
    assert by_name["fist.mcap"]["files"] == {"glb": str(visit / "fist.glb")}
    assert by_name["fist.mcap"]["problems"] == []
    assert "Export orientations instead" in by_name["door.mcap"]["problems"][0]["remedy"]
    assert by_name["door.mcap"]["files"] == {}


def test_a_take_that_breaks_the_program_does_not_stop_the_rest(here, sessions, monkeypatch):
    from handstudio.commands import exporting  # noqa: PLC0415

    process = exporting.process

    def breaking(take, *given, **more):
        if take.path.stem == "door":
            raise ZeroDivisionError("a mistake of ours")
        return process(take, *given, **more)

    monkeypatch.setattr(exporting, "process", breaking)
    said = here("export", sessions, "--format", "csv")
    assert said.code == 1
    assert "ZeroDivisionError('a mistake of ours')" in said.err
    assert "fist.angles.csv" in said.out


def test_two_takes_are_not_written_over_each_other(here, take, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    shutil.copy(take, other)
    said = here("export", take, other / take.name, "--to", tmp_path / "out")
    assert said.code == 1
    assert "another take was just written there" in said.err
    assert len(said.out.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [([], "No take was named"), (["."], "there is no take in it"), (["x.mcap"], "x.mcap: cannot")],
)
def test_nothing_to_export_is_said(here, tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    said = here("export", *arguments)
    assert said.code == 1
    assert words in said.err


def test_a_format_nobody_has_is_refused_and_the_formats_are_named(capsys, take):
    with pytest.raises(SystemExit):
        main(["export", str(take), "--format", "fbx"])
    assert "parquet" in capsys.readouterr().err
