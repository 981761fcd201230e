"""Every command does its work, and says it so that persons and programs understand."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from handstudio.cli import COMMANDS
from handstudio.setup import FILTERS

posix = pytest.mark.skipif(sys.platform == "win32", reason="uses POSIX signals and limits")


@pytest.fixture(scope="session")
def recorded(handstudio, tmp_path_factory) -> Path:
    """A take of two seconds, recorded by the command."""
    sessions = tmp_path_factory.mktemp("sessions")
    said = handstudio(
        *["record", "virtual:?seed=7", "--seconds", 2, "--sessions", sessions],
        *["--subject", "P07", "--visit", "first", "--name", "grasp"],
        *["--hand-length-mm", 171, "--json"],
    )
    assert said.code == 0, said.err
    return Path(said.json["path"])


@pytest.fixture
def take(recorded, tmp_path) -> Path:
    """A copy of it, for a test alone."""
    return Path(shutil.copy(recorded, tmp_path))


# --- help -----------------------------------------------------------------------------------------


def test_help_names_every_command_and_where_to_begin(handstudio):
    said = handstudio("--help")
    assert said.code == 0
    for name, command in COMMANDS.items():
        line = next(line for line in said.out.splitlines() if f"• {name} " in line)
        assert (command.__doc__ or "").split("\n")[0] in line
    assert "handstudio studio --virtual" in said.out


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_explains_it_and_every_option(help_of, name):
    said = help_of[name]
    assert (COMMANDS[name].__doc__ or "").split("\n")[0] in said
    options = re.findall(r"^│ (\S.*?) {2,}(\S.*?) *│$", said, re.MULTILINE)
    assert ("-h, --help", "show this help message and exit") in options
    for option, words in options:
        explained = re.sub(r"\((default|required|optional).*\)", "", words)
        assert len(explained.split()) >= 2, f"{name} {option}: {words}"


def test_what_is_no_command_is_refused_and_the_commands_are_named(handstudio):
    said = handstudio("frobnicate")
    assert said.code != 0
    assert "frobnicate" in said.err
    assert "record" in said.err
    assert handstudio().code != 0


@pytest.mark.parametrize("name", ["info", "process", "export", "import", "recover", "record"])
def test_a_command_without_what_it_works_on_says_what_is_missing(here, name):
    said = here(name)
    assert said.code != 0
    assert said.out == ""
    assert said.err


# --- devices --------------------------------------------------------------------------------------


def test_devices_are_listed_for_programs(handstudio):
    said = handstudio("devices", "--json")
    assert said.code == 0
    assert said.json[-1]["address"] == "virtual:"
    assert {"address", "label", "problem", "description"} <= said.json[-1].keys()


def test_devices_are_listed_for_persons(handstudio):
    said = handstudio("devices")
    assert said.code == 0
    assert "virtual:" in said.out
    assert "handstudio studio --connect" in said.out


# --- record, info, process, export ----------------------------------------------------------------


def test_a_recording_is_a_take_of_the_library_and_of_that_length(handstudio, recorded):
    assert recorded.parts[-3:] == ("P07", "first", "grasp.mcap")
    said = handstudio("info", recorded, "--json").json
    assert said["path"] == str(recorded)
    assert said["header"]["subject"] == "P07"
    assert said["header"]["setup"]["hand"]["hand_length_m"] == pytest.approx(0.171)
    assert said["header"]["setup"]["device"]["serial_number"] == "VG-7"
    assert said["summary"]["duration_s"] == pytest.approx(2.0, abs=1.0)
    assert said["summary"]["packets"] > 100


def test_a_take_is_described_for_persons(here, recorded):
    said = here("info", recorded)
    assert said.code == 0
    for fact in ("P07", "171 mm", "100 Hz", "VG-7", "SN17", "100.00 Hz", "latency", "jitter"):
        assert fact in said.out


def test_how_a_take_did_is_told_and_computed_where_it_was_not_kept(here, recorded, tmp_path):
    kept = here("info", recorded, "--json").json["health"]
    assert kept["latency"]["p99_ms"] > 0.0
    assert len(kept["sensors"]) == 20
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(recorded.read_bytes()[:-500])
    back = here("recover", torn, "--json").json["path"]
    assert here("info", back, "--json").json["health"] is None
    computed = here("info", back, "--health", "--json").json["health"]
    assert computed["latency"] is None
    assert computed["measured_rate_hz"] == kept["measured_rate_hz"]
    assert "restarts" in here("info", back, "--health").out


def test_processing_writes_the_csv_that_exporting_writes(handstudio, take, tmp_path):
    (result,) = handstudio("process", take, "--csv", "--json").json
    assert result["take"] == str(take)
    assert result["instants"] > 100
    exported = tmp_path / "elsewhere" / "angles.csv"
    said = handstudio("export", take, "--to", exported)
    assert said.code == 0
    assert said.out.strip() == str(exported)
    written = Path(result["csv"]).read_bytes()
    assert exported.read_bytes() == written
    assert len(written.splitlines()) == result["instants"] + 1
    assert Path(result["csv"]).with_name(Path(result["csv"]).name + ".json").exists()


def test_a_take_is_processed_with_outputs_corrected_and_as_another_type_of_hand(here, take):
    written = {}
    for asked in ((), ("--correction",), ("--hand-type", 1)):
        (result,) = here("process", take, "--csv", "--json", *asked).json
        written[asked] = Path(result["csv"]).read_bytes()
    assert len(set(written.values())) == 3
    assert b"ulnar_cmc_flexion" in written[()]
    assert b"ulnar_cmc_flexion" not in written["--hand-type", 1]
    assert b"ring_mcp_flexion" in written["--hand-type", 1]


def test_several_takes_are_processed_in_one_go(here, take, recorded):
    said = here("process", take, recorded)
    assert said.code == 0
    assert len(said.out.splitlines()) == 2


@pytest.mark.parametrize("content", ["angles", "orientations", "positions"])
def test_a_window_of_a_take_is_exported(handstudio, take, tmp_path, content):
    target = tmp_path / "part.csv"
    window = ["--start-s", 0.5, "--end-s", 1.2]
    said = handstudio("export", take, "--content", content, *window, "--to", target)
    assert said.code == 0, said.err
    table = np.genfromtxt(target, delimiter=",", names=True)
    assert table["time_s"][0] == pytest.approx(0.5, abs=0.011)
    assert table["time_s"][-1] == pytest.approx(1.2, abs=0.011)
    assert np.isfinite([table[name] for name in table.dtype.names]).all()


def test_a_window_beyond_the_take_says_what_there_is(here, take):
    said = here("export", take, "--start-s", 50)
    assert said.code == 1
    assert "50.00 s" in said.err
    assert "Choose a window within" in said.err


# --- import, recover, simulate --------------------------------------------------------------------


def foreign(folder: Path, instants: int = 300) -> Path:
    """A folder of two sensors, as somebody else recorded them."""
    folder.mkdir()
    rng = np.random.default_rng(3)
    names, columns = ["time_s"], [np.arange(instants) / 100.0]
    for sensor in ("SN15", "SN16"):
        for kind, rest in (("gyr", (0, 0, 0)), ("acc", (0, 0, 9.81)), ("mag", (20, 0, -40))):
            for axis, value in zip("xyz", rest, strict=True):
                names.append(f"{sensor}_{kind}_{axis}")
                columns.append(value + 0.01 * rng.standard_normal(instants))
    rows = np.column_stack(columns)
    np.savetxt(folder / "samples.csv", rows, "%.6f", ",", header=",".join(names), comments="")
    return folder


def test_a_foreign_folder_becomes_a_take(here, tmp_path):
    folder = foreign(tmp_path / "foreign")
    said = here("import", folder, "--sessions", tmp_path / "sessions", "--subject", "P9")
    assert said.code == 0, said.err
    path = Path(said.out.strip())
    assert path.name == "foreign.mcap"
    told = here("info", path, "--json").json
    assert told["header"]["kind"] == "samples"
    (result,) = here("process", path, "--csv", "--json").json
    assert result["instants"] == 300
    assert result["csv"].endswith(".orientations.csv")
    said = here("export", path, "--content", "angles")
    assert said.code == 1
    assert "Export orientations instead" in said.err


def test_a_folder_that_is_wrong_says_where(here, tmp_path):
    folder = foreign(tmp_path / "foreign", 20)
    table = (folder / "samples.csv").read_text().splitlines()
    table[7] = table[7].replace(table[7].split(",")[3], "nan", 1)
    (folder / "samples.csv").write_text("\n".join(table))
    said = here("import", folder, "--sessions", tmp_path / "sessions")
    assert said.code == 1
    assert "SN15_gyr_z" in said.err
    assert "Leave out the rows" in said.err
    assert not list((tmp_path / "sessions").rglob("*.mcap*"))


def test_what_is_left_of_a_torn_take_comes_back(here, take):
    whole = here("info", take, "--json").json["summary"]
    torn = take.with_name("torn.mcap")
    torn.write_bytes(take.read_bytes()[: take.stat().st_size * 2 // 3])
    said = here("info", torn)
    assert said.code == 1
    assert f"handstudio recover '{torn}'" in said.err
    back = here("recover", torn, "--json").json
    assert 0 < back["bytes"] < whole["bytes"]
    assert Path(back["path"]).name == "torn-recovered.mcap"
    assert here("process", back["path"], "--json").json[0]["instants"] > 20
    again = here("recover", torn)
    assert again.code == 1
    assert "exists already" in again.err


def test_a_take_is_simulated_with_its_truth(handstudio, tmp_path):
    said = handstudio(
        "simulate", "--seconds", 1.5, "--seed", 4, "--side", "left", "--out", tmp_path
    )
    assert said.code == 0, said.err
    path = Path(said.out.strip())
    assert path.with_suffix(".truth.npz").exists()
    told = handstudio("info", path, "--json").json
    assert told["header"]["setup"]["layout"]["side"] == "left"
    assert told["summary"]["packets"] == 151


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--rate", 77, "77 Hz"),
        ("--rate", 0, "0 Hz"),
        ("--seconds", 0, "0 s"),
        ("--seconds", -1, "-1 s"),
        ("--motion", "juggling", "juggling"),
        ("--motion", "showcase+", "understood"),
        ("--imperfections", "rust", "rust"),
    ],
)
def test_what_cannot_be_simulated_is_said(here, tmp_path, option, value, words):
    said = here("simulate", option, value, "--out", tmp_path)
    assert said.code == 1
    assert words in said.err
    assert len(said.err.splitlines()) >= 2  # and what to do
    assert not list(tmp_path.rglob("*.mcap*"))


# --- what goes wrong ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "what", "remedy"),
    [
        (["info", "lost.mcap"], "lost.mcap", "Check the path"),
        (["info", "thesis.mcap"], "not a take", "ends in .mcap"),
        (["info", "left.mcap.recording"], "interrupted", "handstudio recover"),
        (["export", "lost.mcap"], "lost.mcap", "Check the path"),
        (["process", "lost.mcap"], "lost.mcap", "Check the path"),
        (["recover", "thesis.mcap"], "nothing of a take", "copy"),
        (["import", "nowhere"], "no such folder", "Check the path"),
        (["record", "serial:/nowhere/ttyACM0"], "no such port", "Plug the device in"),
        (["record", "tcp:127.0.0.1:1"], "does not answer", "switched on"),
        (["record", "usb:1"], "not the address", "Write serial:PORT"),
        (["record", "virtual:", "--subject", "///"], "subject has no name", "Type a name"),
        (["record", "virtual:", "--name", ""], "take has no name", "Type a name"),
        (["record", "virtual:", "--seconds", "0"], "of 0 s", "more than 0"),
        (["record", "virtual:", "--seconds", "nan"], "of nan s", "more than 0"),
        (["record", "virtual:", "--hand-length-mm", "0"], "0 mm", "millimetres"),
    ],
)
def test_an_error_says_what_it_is_and_what_to_do(here, desk, arguments, what, remedy):
    sessions = ["--sessions", "sessions"] if arguments[0] == "record" else []
    said = here(*arguments, *sessions)
    assert said.code == 1
    assert said.out == ""
    assert what in said.err
    assert remedy in said.err


@pytest.fixture
def desk(tmp_path, monkeypatch) -> None:
    """The folder one works in."""
    monkeypatch.chdir(tmp_path)
    Path("thesis.mcap").write_text("four years of work")
    Path("left.mcap.recording").write_text("four years of work")


def test_an_error_is_no_trace_of_a_program(handstudio, tmp_path):
    said = handstudio("info", "lost.mcap", cwd=tmp_path)
    assert said.code == 1
    assert said.out == ""
    assert len(said.err.splitlines()) == 2


def test_a_take_can_be_fused_by_each_filter(here, take):
    written = set()
    for name in FILTERS:
        assert here("process", take, "--filter", name, "--csv").code == 0
        written.add(take.with_suffix(".angles.csv").read_bytes())
    assert len(written) == len(FILTERS)


def test_a_filter_nobody_has_is_refused_and_the_filters_are_named(here, take):
    said = here("process", take, "--filter", "kalman")
    assert said.code == 1
    assert "kalman" in said.err
    assert "vqf" in said.err


def test_names_with_brackets_and_colons_are_said_as_they_are(here, take):
    folder = take.parent / "old [bold]takes[/] :smile: [red]"
    folder.mkdir(parents=True)
    moved = Path(shutil.move(take, folder / "a [dim] one.mcap"))
    assert here("export", moved).out.strip() == str(moved.with_suffix(".angles.csv"))
    assert moved.name in here("info", moved).out
    assert here("process", moved).out.startswith(str(moved))
    moved.write_text("four years of work")
    assert str(moved) in here("info", moved).err
    lost = f"{moved}\\"
    assert lost in here("info", lost).err


@posix
def test_a_recording_that_the_disk_refuses_ends_at_once_with_what_to_do(handstudio, tmp_path):
    (tmp_path / "sessions").write_text("four years of work")
    said = handstudio("record", "virtual:", "--sessions", tmp_path / "sessions")
    assert said.code == 1
    assert "cannot be written" in said.err
    assert "permissions" in said.err


@posix
def test_a_recording_whose_disk_is_full_ends_then_with_what_to_do(begun, tmp_path):
    import resource  # noqa: PLC0415 - not on Windows

    process = begun("record", "virtual:", "--seconds", 600, "--sessions", tmp_path)
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (150_000, resource.RLIM_INFINITY))
    out, err = process.communicate(timeout=60.0)
    assert process.returncode == 1
    assert out == ""
    assert "cannot be written" in err
    (left,) = tmp_path.rglob("*.recording")
    assert f"handstudio recover '{left}'" in err
    assert "Traceback" not in err


@posix
def test_a_reader_that_goes_away_is_no_mistake(recorded):
    command = f"'{sys.executable}' -c 'from handstudio.cli import main; main()' info '{recorded}'"
    done = subprocess.run(
        ["sh", "-c", f"{command} | true"], capture_output=True, text=True, check=False
    )
    assert "Traceback" not in done.stderr


# --- the studio and what helps with it ------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "what", "remedy"),
    [
        (["--token", "too-short"], "16 to 128", "one is made for you"),
        (["--host", "192.0.2.99"], "192.0.2.99: this machine cannot serve there", "0.0.0.0"),
        (["--host", "no-such.invalid"], "no machine of this name", "0.0.0.0"),
        (["--port", "70000"], "not the number of a port", "1024 to 65535"),
    ],
)
def test_where_nothing_can_be_served_it_is_said_at_once(
    handstudio, tmp_path, arguments, what, remedy
):
    said = handstudio("studio", "--no-browser", "--sessions", tmp_path, *arguments)
    assert said.code == 1
    assert what in said.err
    assert remedy in said.err
    assert "too-short" not in said.out + said.err


def test_diagnostics_are_written_and_never_over_another_file(here, tmp_path):
    target = tmp_path / "help.zip"
    said = here("diagnostics", "--output", target, "--sessions", tmp_path / "sessions")
    assert said.code == 0, said.err
    assert said.out.strip() == str(target)
    assert "README.txt" in zipfile.ZipFile(target).namelist()
    before = target.read_bytes()
    said = here("diagnostics", "--output", target)
    assert said.code == 1
    assert "is there already" in said.err
    assert target.read_bytes() == before
    said = here("diagnostics", "--output", tmp_path / "no" / "such" / "place.zip")
    assert said.code == 1
    assert "cannot be written" in said.err


def test_diagnostics_say_nothing_of_the_subjects_of_the_library(here, tmp_path, log_folder):
    simulated = here("simulate", "--seconds", "0.5", "--out", tmp_path / "sessions")
    path = Path(simulated.out.strip())
    renamed = tmp_path / "sessions" / "Eva_Köhler" / "2026-01-31" / "left_wrist.mcap"
    renamed.parent.mkdir(parents=True)
    path.rename(renamed)
    (log_folder / "studio.log").write_text(f"INFO Eva Köhler, left wrist, {renamed}\n", "utf-8")
    target = tmp_path / "help.zip"
    here("diagnostics", "--output", target, "--sessions", tmp_path / "sessions")
    with zipfile.ZipFile(target) as zipped:
        whole = "".join(zipped.read(name).decode() for name in zipped.namelist())
    assert "INFO" in whole
    for word in ("Köhler", "left wrist", "left_wrist", str(tmp_path)):
        assert word not in whole
