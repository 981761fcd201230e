"""What is handed to a helper: useful, and without a word about subjects, takes and folders."""

from __future__ import annotations

import io
import json
import logging
import zipfile
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest

from app import diagnostics
from app.diagnostics import Facts, bundle, collect, make
from app.journal import Journal
from app.state import Message, Shelf, State
from handstudio import __version__
from handstudio.device.health import HealthView
from handstudio.device.orders import Newest, Phase
from handstudio.device.recorder import Recorder
from handstudio.errors import DeviceError, TakeError
from handstudio.hand.skeleton import ADULT_HAND_LENGTH_M
from handstudio.log import FILE, logging_to
from handstudio.recording import library
from handstudio.recording.bin import move_to_bin
from handstudio.recording.notes import Label, Notes, save_notes
from handstudio.recording.simulated import simulate
from handstudio.recording.subjects import Subject, create_subject
from handstudio.recording.take import Take
from handstudio.recording.writer import TakeWriter
from handstudio.scrub import Scrubber
from handstudio.settings import Settings
from handstudio.simulation.glove import description

SUBJECT = 'Zoë "Zo" O\'Hara'
NAME = "übung №7; 手を握る"
NOTE = "complains of µ-pain\nin the left Zeigefinger"
LABEL = "sneezed: twice"
SECRETS = {
    "subject": ("Zoë", "O'Hara", "Hara", "Zo\\u00eb", "Zo\\xeb"),
    "take": ("übung", "№7", "手を握る", "\\u624b"),
    "note": ("complains of", "µ-pain", "Zeigefinger"),
    "label": ("sneezed",),
    "folder": ("Klinik Süd", "Klinik"),
}


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    return tmp_path / "Klinik Süd: Raum 3" / "sessions"


@pytest.fixture
def recorded(sessions: Path, take: Take) -> Path:
    """A take whose every word is private, in a folder that is too."""
    path = library.new_take_path(sessions, SUBJECT, NAME, datetime(2026, 1, 31, tzinfo=UTC))
    path.parent.mkdir(parents=True)
    private = msgspec.structs.replace(take.header, name=path.stem, subject=SUBJECT)
    TakeWriter(path, private).close()
    save_notes(path, Notes((Label(0.0, 1.0, LABEL),), NOTE))
    return path


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("HANDSTUDIO_LOG", str(tmp_path / "log"))
    return tmp_path / "log"


def members(content: bytes) -> dict[str, str]:
    with zipfile.ZipFile(io.BytesIO(content)) as zipped:
        assert zipped.testzip() is None
        return {name: zipped.read(name).decode() for name in zipped.namelist()}


def leaks(text: str) -> list[str]:
    return [word for words in SECRETS.values() for word in words if word in text]


def a_bad_day(recorded: Path) -> Newest:
    """The newest of a capture whose every error speaks of what is private."""
    return Newest(
        phase=Phase.FAILED,
        address=f"replay:{recorded}",
        description=description("right", 3, 100, 1, "Virtual glove"),
        health=HealthView(rate_hz=99.5, packets=995, missing=5),
        problem=DeviceError("{path}: {why}.", "Ask {who}.", path=recorded, why=NOTE, who=SUBJECT),
    )


def fail_at(path: Path) -> None:
    raise TakeError("{path}: is damaged.", "Recover it.", path=path)


def test_nothing_private_is_in_any_part_of_it(sessions: Path, recorded: Path, log: Path) -> None:
    newest = a_bad_day(recorded)
    state = State(
        sessions=sessions,
        newest=newest,
        settings=Settings(subject=SUBJECT, take_name=NAME),
        shelf=Shelf(takes=tuple(library.entries(sessions))),
        messages=(Message(f"{recorded}: cannot be written for {SUBJECT}.", NAME, alarm=True),),
    )
    scrubber = Scrubber()
    scrubber.sessions(sessions)
    with logging_to(log, scrubber):
        Journal(scrubber).note(state)
        try:
            fail_at(recorded)
        except TakeError:
            logging.getLogger("app").exception("with %s", NAME)
        logging.getLogger("app").error("%s", FileNotFoundError(2, "No file", str(recorded)))
    settings = {"subject": SUBJECT, "take_name": NAME, "language": "ja", "seen": [SUBJECT, NAME]}
    takes = library.entries(sessions)
    content = make(newest, settings=settings, sessions=sessions, takes=takes)
    parts = members(content)
    assert set(parts) >= {"README.txt", "versions.json", "device.json", f"log/{FILE}"}
    for name, text in parts.items():
        assert leaks(name) == []
        assert leaks(text) == [], name
    assert leaks(content.decode("latin-1")) == []
    assert "is damaged" in parts[f"log/{FILE}"]
    assert "Traceback" in parts[f"log/{FILE}"]


def test_a_log_of_somebody_else_is_scrubbed_again(
    sessions: Path, recorded: Path, log: Path
) -> None:
    log.mkdir()
    said = f"2026 INFO {SUBJECT} / {NAME} / {NOTE} / {LABEL} at {recorded}\n"
    (log / FILE).write_text(said, "utf-8")
    (log / f"{FILE}.3").write_text(said, "utf-8")
    content = make(Newest(), settings={}, sessions=sessions, takes=library.entries(sessions))
    parts = members(content)
    for name in (f"log/{FILE}", f"log/{FILE}.3"):
        assert "2026 INFO" in parts[name]
        assert leaks(parts[name]) == []


def test_names_that_are_not_in_the_library_yet_can_be_given(tmp_path: Path, log: Path) -> None:
    problem = TakeError("{who} cannot be recorded.", "Wait.", who=SUBJECT)
    newest = replace(Newest(), problem=problem)
    content = make(newest, settings={}, sessions=tmp_path, takes=[], names=[SUBJECT])
    assert leaks(members(content)["device.json"]) == []


def test_it_helps(tmp_path: Path, log: Path) -> None:
    newest = Newest(
        Phase.STREAMING,
        "serial:/dev/ttyACM0",
        description("right", 3, 100, 1, "Virtual glove"),
        health=HealthView(rate_hz=99.5, packets=995, missing=5),
    )
    settings = {"language": "ja", "hand_length_mm": ADULT_HAND_LENGTH_M * 1e3}
    with logging_to(log, Scrubber()):
        logging.getLogger("app").info("begun")
    parts = members(make(newest, settings=settings, sessions=tmp_path, takes=[]))
    versions = json.loads(parts["versions.json"])
    assert versions["handstudio"] == __version__
    assert "numpy" in versions["packages"]
    device = json.loads(parts["device.json"])
    assert device["address"] == "serial:/dev/ttyACM0"
    assert device["phase"] == "streaming"
    assert device["description"]["serial_number"] == "VG-3"
    assert device["health"]["loss_percent"] == pytest.approx(0.5)
    assert json.loads(parts["settings.json"]) == settings
    assert json.loads(parts["disk.json"])["free"] > 0
    assert isinstance(json.loads(parts["ports.json"]), list)
    assert "begun" in parts[f"log/{FILE}"]
    assert "look through them before you send them" in parts["README.txt"]
    assert "被験者コード" in parts["README.txt"]


def test_settings_with_private_names_are_left_out_whatever_they_hold() -> None:
    settings = {
        "Subject": 7,
        "last_take": "x",
        "notes": ["y"],
        "sessions_folder": "z",
        "port": 8765,
        "shown": {"labels": True, "names": "x"},
    }
    facts = Facts(datetime(2026, 1, 31, tzinfo=UTC), settings=settings)
    told = json.loads(members(bundle(facts, Scrubber()))["settings.json"])
    assert told.pop("port") == 8765
    assert told.pop("shown") == {"labels": True, "names": diagnostics.LEFT_OUT}
    assert set(told.values()) == {diagnostics.LEFT_OUT}


def test_a_bundle_is_made_of_its_facts_alone() -> None:
    facts = Facts(datetime(2026, 1, 31, tzinfo=UTC), versions={"handstudio": "1"})
    assert bundle(facts, Scrubber()) == bundle(facts, Scrubber())


def test_what_is_not_there_is_no_obstacle(tmp_path: Path) -> None:
    facts = collect(Newest(), {}, tmp_path / "no" / "such", tmp_path / "nor this")
    assert facts.log == {}
    assert facts.disk["there"] is False
    assert members(bundle(facts, Scrubber()))


def test_notes_that_cannot_be_read_are_no_obstacle(
    sessions: Path, recorded: Path, log: Path
) -> None:
    for file in recorded.parent.glob("*.notes.json*"):
        file.write_text("{")
    assert make(Newest(), settings={}, sessions=sessions, takes=library.entries(sessions))


def test_subjects_without_takes_and_takes_in_the_bin_are_not_named(
    sessions: Path, recorded: Path, log: Path
) -> None:
    create_subject(sessions, Subject("Ottokar", note="limps"))
    move_to_bin(sessions, recorded, datetime(2026, 2, 1, tzinfo=UTC))
    log.mkdir()
    (log / FILE).write_text(f"INFO Ottokar limps; {SUBJECT}: {NAME}\n", "utf-8")
    content = make(Newest(), settings={}, sessions=sessions, takes=library.entries(sessions))
    said = members(content)[f"log/{FILE}"]
    assert "INFO" in said
    assert not any(word in said for word in ("Ottokar", "limps", "Zoë", "übung"))


# --- the journal ----------------------------------------------------------------------------------


class _Recorder(Recorder):
    """What is looked at of a recording."""

    seconds = 12.5

    def __init__(self, take: Take) -> None:
        self.header, self.bytes, self.failure = take.header, 3456, None


def test_the_journal_tells_of_devices_and_of_the_size_of_takes(
    take: Take, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    journal = Journal(Scrubber())
    known = description("right", 3, 100, 1, "Virtual glove")
    asked = Newest(Phase.CONNECTING, "serial:/dev/ttyACM0")
    streaming = replace(asked, phase=Phase.STREAMING, description=known)
    recording = replace(streaming, recorder=_Recorder(take))
    problem = DeviceError("{port}: gone.", "Plug it in.", port="/dev/ttyACM0")
    lost = replace(streaming, phase=Phase.LOST, problem=problem)
    day = (Newest(), asked, replace(asked, description=known), streaming, streaming)
    with caplog.at_level(logging.INFO, "app"):
        for newest in (*day, recording, recording, lost, lost, streaming):
            journal.note(State(sessions=tmp_path, newest=newest))
    told = [record.getMessage() for record in caplog.records]
    assert told == [
        "device serial:/dev/ttyACM0: connecting, before: idle",
        "it is Virtual glove (VG-3), firmware "
        + f"{known.firmware}, protocol 1, 20 sensors at 100 Hz",
        "device serial:/dev/ttyACM0: streaming, before: connecting",
        "a take begins",
        "device serial:/dev/ttyACM0: lost, before: streaming",
        "so far: 0 packets, 0 missing, 0 damaged, 0 restarts",
        "DeviceError: /dev/ttyACM0: gone.",
        "a take ended: 12.5 s, 3456 bytes",
        "device serial:/dev/ttyACM0: streaming, before: lost",
    ]


def test_the_journal_learns_names_before_it_tells(take: Take, tmp_path: Path) -> None:
    scrubber = Scrubber()
    journal = Journal(scrubber)
    journal.note(State(tmp_path, settings=Settings(subject="Hans", take_name="first")))
    assert scrubber.clean("Hans first") == "[name] [name]"
    journal.note(State(tmp_path, settings=Settings(subject="Hansine")))
    assert scrubber.clean("first Hansine") == "first [name]"  # what was half typed is no name
    path = simulate(tmp_path, seconds=0.5)
    journal.note(State(tmp_path, shelf=Shelf(takes=tuple(library.entries(tmp_path)))))
    subject = path.parent.parent.name
    assert subject not in scrubber.clean(f"of {subject}.")
