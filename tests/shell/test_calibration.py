"""Calibrating from the shell: what is said, what is kept, and what is refused."""

from __future__ import annotations

import json
import shutil
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import pytest

from handstudio.calibrate import Calibrated
from handstudio.calibrate_sensors import SensorsFound
from handstudio.calibration.agreement import agreement_of
from handstudio.calibration.device import decode as decode_device
from handstudio.calibration.device import encode as encode_device
from handstudio.calibration.mirrored import mirrored
from handstudio.calibration.subject import Centre, Segment, SubjectCalibration, Tip, encode
from handstudio.calibration.verdict import Reading, Verdict, What
from handstudio.commands import calibration as commands
from handstudio.commands.readings import TABLE, sentence, sentences
from handstudio.errors import CalibrationError
from handstudio.hand.skeleton import FINGERS, SEGMENTS, nominal_skeleton
from handstudio.layout import glove
from handstudio.recording.calibrations import history, load_calibration, save_calibration
from handstudio.recording.device_calibrations import (
    device_history,
    load_device_calibration,
    save_device_calibration,
    tumbled,
)
from handstudio.recording.notes import Label, Notes, save_notes
from handstudio.recording.simulated import simulate
from handstudio.recording.subjects import Subject, create_subject
from handstudio.recording.take import open_take

START = datetime(2026, 3, 4, 12, 30, tzinfo=UTC)

GOOD = Verdict("wrist:flexion", (Reading("range", 84.0, 70.0, "deg"),))
SIDEWAYS = Reading("second_axis", 18.0, 30.0, "deg")
BAD = Verdict("index_mcp:abduction", (Reading("range", 30.0, 12.5, "deg"), SIDEWAYS))
AGAIN = msgspec.structs.replace(BAD, readings=BAD.readings[:1])


def hand(id: str = "one", side: str = "right", longer: float = 1.0) -> SubjectCalibration:
    skeleton = nominal_skeleton(side)
    drivers = {place.segment: place.sensor for place in glove(side).sensors}
    unit = (1.0, 0.0, 0.0, 0.0)
    segments = tuple(
        Segment(
            name,
            drivers.get(name, ""),
            unit,
            tuple(skeleton.q_parent_rest[i].tolist()),
            tuple((longer * skeleton.t_parent_joint[i]).tolist()),
            (1e-3,) * 3,
            longer * float(skeleton.length_m[i]),
            0.0006,
            "measured",
            "with prior",
            3.4 if name == "index_proximal" else -2.4 if name == "hand" else 0.3,
        )
        for i, name in enumerate(SEGMENTS)
    )
    tips = tuple(
        Tip(finger, tuple(t.tolist()), 1e-3, "proportions")
        for finger, t in zip(FINGERS, skeleton.t_distal_tip, strict=True)
    )
    centre = Centre(
        "index_pip", "SN16", (0.0, 0.03, 0.01), (5e-4,) * 3, (1.0, 0.0, 0.0), 0.21, (61.0, 3.0), 7.0
    )
    return SubjectCalibration(
        *(id, f"2026-03-04T12:30:0{len(id)}+00:00", "handstudio", "virtual-0", side, 0.187, 3),
        *("VG-0", segments, tips, (centre,)),
        takes=(("course", "ab" * 32),),
    )


@pytest.fixture(scope="session")
def recorded(tmp_path_factory) -> Path:
    """A take of a second, of the right hand of virtual-0."""
    return simulate(tmp_path_factory.mktemp("one"), seconds=1.0, start=START)


@pytest.fixture
def take(recorded, tmp_path) -> Path:
    return Path(shutil.copy(recorded, tmp_path / "take.mcap"))


@pytest.fixture
def sessions(tmp_path) -> Path:
    return tmp_path / "sessions"


@pytest.fixture
def found(monkeypatch):
    """``found(verdicts, to_repeat)``: what calibrating the takes shall find."""

    def set_to(verdicts=(GOOD,), to_repeat=(), calibration=None):
        result = Calibrated(calibration or hand(), tuple(verdicts), tuple(to_repeat))
        monkeypatch.setattr(commands, "calibrate_takes", lambda takes, progress, hand_type: result)

    return set_to


# --- words ----------------------------------------------------------------------------------------


def test_a_sentence_says_figure_limit_and_what_to_do():
    told = "second axis covered 18 deg, at least 30 wanted: repeat the sideways swing"
    assert sentence(SIDEWAYS) == told
    assert sentences(BAD) == [told]
    assert sentences(GOOD) == ["swung by 84 deg, at least 70 wanted"]
    moved = Reading("stillness", 4.12, 1.0, "deg/s", False, "SN17")
    assert sentence(moved) == (
        "SN17 still moved at 4.1 deg/s, at most 1 allowed: keep still until the step is over"
    )


@pytest.mark.parametrize("at_least", [True, False])
@pytest.mark.parametrize("what", What.__args__)
def test_every_figure_has_words_and_a_remedy(what, at_least):
    for unit in ("deg", "%", ""):
        wrong = Reading(what, 5.0 if at_least else 9.0, 7.0, unit, at_least)
        said = sentence(wrong)
        assert said.count(": ") == 1 + ("result: " in said)
        assert ("at least 7 wanted" if at_least else "at most 7 allowed") in said
        assert ": " not in sentence(msgspec.structs.replace(wrong, value=7.0)).split(",")[1]
    assert any(key[0] == what for key in TABLE)


def test_a_limit_that_is_missed_by_little_does_not_look_kept():
    assert "29.8 deg, at least 30 wanted" in sentence(Reading("range", 29.8, 30.0, "deg"))
    assert "1.04 deg/s, at most 1.00" in sentence(Reading("stillness", 1.04, 1.0, "deg/s", False))


def test_a_figure_that_could_not_be_had_is_unknown():
    nothing = Reading("stillness", float("nan"), 1.0, "deg/s", False)
    assert sentence(nothing).startswith("the hand still moved at unknown, at most 1 allowed: ")


# --- calibrate ------------------------------------------------------------------------------------


def test_a_good_course_is_kept_and_told(here, found, take, sessions):
    found()
    said = here("calibrate", take, "--sessions", sessions)
    assert said.code == 0, said.err
    assert load_calibration(sessions, "virtual-0", "right").calibration == hand()
    for words in (
        *("wrist:flexion", "good", "swung by 84 deg, at least 70 wanted"),
        *("index_proximal", "45.8 ± 0.6 mm", "measured", "with prior"),
        *("3.4 SD longer than the mean: hardly any hand", "2.4 SD shorter than the mean: unusual"),
        *("index_pip", "SN16", "0.21 m/s²", "61 and 3 deg"),
        *("Nothing needs to be repeated", "calibration.right.json"),
    ):
        assert words in said.out


def test_a_sloppy_step_is_refused_with_the_reason_unless_one_insists(here, found, take, sessions):
    found((GOOD, BAD), (BAD.step, "elbow:rotation"))
    said = here("calibrate", take, "--sessions", sessions)
    assert said.code == 1
    assert "second axis covered 18 deg, at least 30 wanted: repeat the sideways swing" in said.out
    assert f"Repeat, for they were done badly: {BAD.step}\n" in said.out
    assert "Would make it better: elbow:rotation" in said.out
    assert "--anyway" in said.err
    assert not sessions.exists()
    said = here("calibrate", take, "--sessions", sessions, "--anyway")
    assert said.code == 0
    assert load_calibration(sessions, "virtual-0", "right").calibration == hand()


def test_a_step_that_was_done_well_the_second_time_is_no_reason(here, found, take, sessions):
    found((BAD, AGAIN), ("elbow:rotation",))
    assert here("calibrate", take, "--sessions", sessions).code == 0


def test_a_dry_run_keeps_nothing(here, found, take, sessions):
    found()
    said = here("calibrate", take, "--sessions", sessions, "--dry-run")
    assert said.code == 0
    assert "a dry run" in said.out
    assert not sessions.exists()


def test_it_is_told_for_programs_and_kept_for_another_subject(here, found, take, sessions):
    found((GOOD, BAD), (BAD.step,))
    options = ["--sessions", sessions, "--json", "--subject", "P07"]
    told = here("calibrate", take, *options).json
    assert told["refused"] == told["to_repeat"] == [BAD.step]
    assert told["kept"] is None
    assert [verdict["ok"] for verdict in told["verdicts"]] == [True, False]
    assert told["verdicts"][1]["readings"][1]["words"] == sentence(SIDEWAYS)
    told = here("calibrate", take, *options, "--anyway").json
    assert told["kept"] == str(sessions / "P07" / "calibration.right.json")
    assert told["calibration"]["subject"] == "P07"
    assert load_calibration(sessions, "P07", "right").calibration is not None


def test_what_cannot_be_calibrated_says_why(here, monkeypatch, take, sessions):
    def refuse(takes, progress, hand_type):
        raise CalibrationError("Nothing swings in {count} takes.", "Record them.", count=len(takes))

    monkeypatch.setattr(commands, "calibrate_takes", refuse)
    said = here("calibrate", take, take, "--sessions", sessions)
    assert said.code == 1
    assert said.err.splitlines() == ["Nothing swings in 2 takes.", "Record them."]


def test_what_was_found_is_told_also_where_it_cannot_be_kept(here, found, take, sessions):
    found()
    sessions.write_text("four years of work")
    said = here("calibrate", take, "--sessions", sessions)
    assert said.code == 1
    assert "swung by 84 deg" in said.out
    assert "cannot be written" in said.err
    assert sessions.read_text() == "four years of work"


@pytest.mark.parametrize("command", ["calibrate", "calibrate-sensors"])
def test_without_a_take_it_says_how(here, command):
    said = here(command)
    assert said.code == 1
    assert f"handstudio {command} TAKE.mcap" in said.err


# --- calibrations, mirror -------------------------------------------------------------------------


def test_the_history_is_listed_and_an_older_one_restored(here, sessions):
    for made in (hand("one"), hand("three"), hand("fifth", "left")):
        save_calibration(sessions, made)
    rows = here("calibrations", "virtual-0", "--sessions", sessions, "--json").json
    assert {row["id"]: row["in_use"] for row in rows} == {
        "one": False,
        "three": True,
        "fifth": True,
    }
    said = here("calibrations", "virtual-0", "--sessions", sessions, "--restore", "one")
    assert said.code == 0
    assert "one is in use again for the right hand" in said.err
    lines = {line.split()[0]: line for line in said.out.splitlines() if line.strip()}
    assert lines["one"].endswith("in use")
    assert not lines["three"].rstrip().endswith("in use")
    assert "VG-0" in lines["fifth"]
    assert load_calibration(sessions, "virtual-0", "right").calibration == hand("one")
    said = here("calibrations", "virtual-0", "--sessions", sessions, "--restore", "two")
    assert said.code == 1
    assert "There is no calibration two" in said.err


def test_a_broken_one_is_listed_and_said(here, sessions):
    for id in ("one", "three"):
        file = save_calibration(sessions, hand(id))
    file.write_bytes(b"{")
    (sessions / "virtual-0" / "calibrations" / "three.json").write_bytes(b"{")
    said = here("calibrations", "virtual-0", "--sessions", sessions)
    assert said.code == 0
    assert str(file) in said.err
    assert said.out.count("not a subject calibration") == 1
    rows = here("calibrations", "virtual-0", "--sessions", sessions, "--json").json
    assert [(row["id"], row["in_use"]) for row in rows] == [("one", True), ("three", False)]
    assert here("calibrations", "nobody", "--sessions", sessions).code == 1


def test_the_other_hand_is_made_by_mirror(here, sessions):
    create_subject(sessions, Subject("virtual-0"))
    said = here("mirror", "virtual-0", "--sessions", sessions)
    assert said.code == 1
    assert "handstudio calibrate" in said.err
    save_calibration(sessions, hand())
    said = here("mirror", "virtual-0", "--sessions", sessions)
    assert said.code == 0
    assert "calibration.left.json" in said.out
    made = load_calibration(sessions, "virtual-0", "left").calibration
    assert made == mirrored(hand(), made.id, made.made_utc)
    assert here("mirror", "virtual-0", "--sessions", sessions, "--json").json["kept"]
    assert len(history(sessions, "virtual-0", "left")) == 2
    save_calibration(sessions, hand("measured", "left"))
    said = here("mirror", "virtual-0", "--sessions", sessions)
    assert said.code == 1
    assert "--side left or --side right" in said.err
    assert here("mirror", "virtual-0", "--side", "left", "--sessions", sessions).code == 0
    made = load_calibration(sessions, "virtual-0", "right").calibration
    assert made.mirrored_from == "measured"


# --- sensors --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tumble(handstudio, tmp_path_factory) -> Path:
    """A tumble by somebody with ordinary sensors."""
    said = handstudio(
        *["simulate", "--subject", 7, "--motion", "quick_start+tumble", "--seed", 3],
        *["--imperfections", "typical", "--out", tmp_path_factory.mktemp("tumble")],
    )
    assert said.code == 0, said.err
    return Path(said.out.strip())


@pytest.fixture(scope="module")
def calibrated(handstudio, tumble, tmp_path_factory) -> tuple[Path, dict]:
    """The library in which its sensors are calibrated, and what was told."""
    sessions = tmp_path_factory.mktemp("devices")
    said = handstudio("calibrate-sensors", tumble, "--sessions", sessions, "--json")
    assert said.code == 0, said.err
    return sessions, said.json


@pytest.mark.long
def test_sensors_are_calibrated_from_a_tumble(tumble, calibrated):
    sessions, told = calibrated
    setup = open_take(tumble).header.setup
    found = {sensor["name"] for sensor in told["calibration"]["sensors"]}
    assert found == set(setup.layout.names) == told["before"].keys()
    for name in found:
        before, after = told["before"][name], told["after"][name]
        assert after["acc"] < 0.2 * before["acc"]
        assert after["gyr"] < 0.2 * before["gyr"]
    assert told["calibration"]["source"] == [
        {"take": tumble.stem, "sha256": open_take(tumble).sha256()}
    ]
    assert [verdict["ok"] for verdict in told["verdicts"]] == [True]
    kept = load_device_calibration(sessions, setup.device.serial_number).calibration
    assert encode_device(kept).encode() == Path(told["kept"]).read_bytes()


@pytest.mark.long
def test_sensors_are_told_and_refused_where_the_verdict_is_bad(
    here, take, calibrated, sessions, monkeypatch
):
    found = decode_device(Path(calibrated[1]["kept"]).read_bytes())
    found = msgspec.structs.replace(found, sensors=found.sensors[1:])
    few = Verdict("tumble", (Reading("answering", 19.0, 20.0, ""),))
    names = open_take(take).header.setup.layout.names
    felt = tuple(agreement_of(tumbled([open_take(take)])))
    bad = SensorsFound(found, few, names, felt, felt)
    monkeypatch.setattr(commands, "sensors_of", lambda *_, **__: bad)
    said = here("calibrate-sensors", take, "--sessions", sessions)
    assert said.code == 1
    assert "sensors with a result: 19, at least 20 wanted: check its plug" in said.out
    lines = {line.split()[0]: line for line in said.out.splitlines() if line.startswith("SN")}
    assert "not found: as shipped" in lines["SN1"]
    assert lines["SN2"].rstrip().endswith("found")
    assert not sessions.exists()
    assert here("calibrate-sensors", take, "--sessions", sessions, "--anyway").code == 0
    assert device_history(sessions, found.device)


@pytest.mark.long
def test_an_older_calibration_of_sensors_is_restored(here, calibrated, sessions):
    one = decode_device(Path(calibrated[1]["kept"]).read_bytes())
    two = msgspec.structs.replace(one, made_utc="2036-03-04T12:30:00+00:00")
    for each in (one, two):
        save_device_calibration(sessions, each)
    options = [one.device, "--device", "--sessions", sessions]
    rows = here("calibrations", *options, "--json").json
    assert [row["in_use"] for row in rows] == [True, False]
    said = here("calibrations", *options, "--restore", rows[1]["id"])
    assert said.code == 0
    assert load_device_calibration(sessions, one.device).calibration == one
    (line,) = [each for each in said.out.splitlines() if each.startswith(rows[1]["id"])]
    assert line.endswith("in use")


@pytest.mark.long
def test_a_take_is_exported_with_corrected_sensors_of_its_device_only(
    here, take, calibrated, tmp_path
):
    found = decode_device(Path(calibrated[1]["kept"]).read_bytes())
    other, file = tmp_path / "other.json", tmp_path / "own.json"
    other.write_text(encode_device(found), "utf-8")
    file.write_text(encode_device(msgspec.structs.replace(found, device="VG-0")), "utf-8")
    said = here("process", take, "--sensors", other)
    assert said.code == 1
    assert "the sensors of VG-3, and the take is of VG-0" in said.err
    target = tmp_path / "angles.csv"
    assert here("export", take, "--sensors", file, "--to", target).code == 0
    told = json.loads(target.with_name("angles.csv.json").read_text("utf-8"))
    assert told["sensor_calibration"]["made_utc"] == found.made_utc
    assert told["sensor_calibration"]["device"] == "VG-0"
    assert told["sensor_calibration"]["residuals"].keys() == found.by_name.keys()


@pytest.mark.long
def test_sensors_of_two_devices_are_not_mixed(here, take, tumble, sessions):
    said = here("calibrate-sensors", take, tumble, "--sessions", sessions)
    assert said.code == 1
    assert "Name takes of one device" in said.err


def test_labelled_stretches_of_several_takes_follow_one_another(take):
    opened = open_take(take)
    whole = tumbled([opened])
    assert len(whole) == 101
    labels = (Label(0.1, 0.3, "tumble"), Label(0.5, 0.6, "tumble"), Label(0.0, 1.0, "static"))
    save_notes(take, Notes(labels=labels))
    two = tumbled([opened, opened])
    assert len(two) == 2 * (21 + 11)
    steps = np.diff(two.time_us)
    assert steps.min() > 0
    assert np.flatnonzero(steps > 10_000_000).tolist() == [20, 31, 52]
    np.testing.assert_array_equal(two.acc[:21], whole.acc[10:31])
    np.testing.assert_array_equal(two.acc[32:], two.acc[:32])


def test_a_take_in_which_nothing_was_laid_down_calibrates_no_sensor(here, take, sessions):
    said = here("calibrate-sensors", take, "--sessions", sessions)
    assert said.code == 1
    assert "lay still" in said.err
    assert not sessions.exists()


# --- another calibration than the take carries ----------------------------------------------------


def test_a_take_is_processed_and_exported_with_another_calibration(here, take, tmp_path):
    file = tmp_path / "hand.json"
    file.write_bytes(encode(hand("long", longer=1.5)))

    def positions(*options: object) -> tuple[np.ndarray, dict]:
        target = tmp_path / "positions.csv"
        said = here("export", take, "--content", "positions", "--to", target, *options)
        assert said.code == 0, said.err
        told = json.loads(target.with_name("positions.csv.json").read_text("utf-8"))
        return np.genfromtxt(target, delimiter=",", names=True), told

    plain, told = positions()
    assert (told["calibration_made"], told["sensor_calibration"]) == (None, None)
    assert (told["zero_source"], told["heading_alignment_deg"]) == ("maker", None)
    long, told = positions("--calibration", file)
    np.testing.assert_allclose(long["wrist_x_mm"], 1.5 * plain["wrist_x_mm"], atol=2e-3)
    assert told["calibration"] == told["calibration_made"]["id"] == "long"
    assert told["zero_source"] == "calibration"
    assert told["calibration_residuals"][0]["residual_m_s2"] == 0.21
    none, told = positions("--calibration", "none", "--sensors", "none")
    np.testing.assert_array_equal(none, plain)
    assert here("process", take, "--calibration", file, "--csv").code == 0


@pytest.mark.parametrize("option", ["--calibration", "--sensors"])
def test_a_file_that_is_no_calibration_says_so(here, take, tmp_path, option):
    wrong = tmp_path / "wrong.json"
    wrong.write_bytes(b'{"format": 1}')
    for command in ("process", "export"):
        for file, words in ((tmp_path / "lost.json", "No such file"), (wrong, "calibration")):
            said = here(command, take, option, file)
            assert said.code == 1
            assert str(file) in said.err
            assert words in said.err
            assert len(said.err.splitlines()) == 2


def test_a_calibration_of_the_other_hand_is_refused(here, take, tmp_path):
    file = tmp_path / "left.json"
    file.write_bytes(encode(hand(side="left")))
    said = here("process", take, "--calibration", file)
    assert said.code == 1
    assert "handstudio mirror" in said.err


# --- simulate --start -----------------------------------------------------------------------------


def test_the_same_seed_and_start_give_the_same_file(here, tmp_path):
    def simulated(folder: str, *options: object) -> bytes:
        said = here("simulate", "--seconds", 1, "--out", tmp_path / folder, *options)
        assert said.code == 0, said.err
        return Path(said.out.strip()).read_bytes()

    one = simulated("a", "--seed", 4, "--start", "2026-03-04T12:30:00")
    assert simulated("b", "--seed", 4, "--start", "2026-03-04T21:30:00+09:00") == one
    assert simulated("c", "--seed", 4, "--start", "2026-03-04T12:30:01") != one
    assert simulated("d", "--seed", 5, "--start", "2026-03-04T12:30:00") != one
    (path,) = (tmp_path / "a").rglob("*.mcap")
    assert path.parent.name == "2026-03-04"
    assert open_take(path).header.start_utc_ns == int(START.timestamp() * 1e9)


@pytest.mark.parametrize("start", ["yesterday", "2026-13-01", "1926-03-04", "12:30"])
def test_a_start_that_is_no_time_is_refused(here, tmp_path, start):
    said = here("simulate", "--start", start, "--out", tmp_path)
    assert said.code == 1
    assert start in said.err
    assert "2026-03-04T12:30:00" in said.err
