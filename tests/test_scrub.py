"""What is private is found however it is written."""

from __future__ import annotations

import json
import re
from pathlib import Path, PureWindowsPath
from urllib.parse import quote

import pytest
from hypothesis import given
from hypothesis import strategies as st

from handstudio.scrub import NAME, SESSIONS, TOKEN, Scrubber

NAMES = [
    "P07",
    "Müller, Hans",
    "山田 太郎",
    'O\'Brien "Bo"',
    "back\\slash",
    "a+b*(c)[d]{e}^$|?.",
    "line\nend",
    "İstanbul",
    "  spaces around  ",
    "🖐 wave",
    "7",
]

HOWEVER = {
    "as it is": lambda name: name,
    "quoted": repr,
    "in ASCII": ascii,
    "as JSON": json.dumps,
    "as JSON of any language": lambda name: json.dumps(name, ensure_ascii=False),
    "in a link": quote,
    "in bytes": lambda name: repr(name.encode()),
    "as a file": lambda name: re.sub(r"[^\w\-+.]+", "_", name.strip()).strip("._") + ".notes.json",
    "in capitals": str.upper,
}


@pytest.fixture
def scrubber() -> Scrubber:
    one = Scrubber(home=Path("/home/maria"))
    one.sessions(Path("/home/maria/glove data/sessions"))
    one.names(NAMES)
    one.tokens(["Uq3_four-years-of-work"])
    return one


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("how", HOWEVER)
def test_a_name_is_found_however_it_is_written(scrubber: Scrubber, name: str, how: str) -> None:
    written = HOWEVER[how](name)
    inner = written.strip().strip("'\"").removesuffix(".notes.json")
    said = scrubber.clean(f"before {written} after")
    assert inner not in said
    assert said.startswith("before ")
    assert said.endswith(" after")


def test_folders_and_what_lies_in_them(scrubber: Scrubber) -> None:
    folder = "/home/maria/glove data/sessions"
    assert scrubber.clean(folder) == SESSIONS
    assert scrubber.clean(f"{folder}/Eva K/2026-01-31/x.mcap: cannot be written.") == (
        f"{SESSIONS}: cannot be written."
    )
    assert scrubber.clean(f"open('{folder}/Eva K/y z') failed") == f"open('{SESSIONS}') failed"
    assert "Eva" not in scrubber.clean(f"{folder}\\Eva K\\x")
    assert scrubber.clean(f"{folder}2/x") == "~/glove data/sessions2/x"
    assert scrubber.clean("/home/maria/.venv/lib/a.py") == "~/.venv/lib/a.py"
    assert scrubber.clean("/home/mariana") == "/home/mariana"


def test_folders_of_windows() -> None:
    folder = str(PureWindowsPath(r"C:\Users\maria\sessions"))
    one = Scrubber(home=Path("C:\\Users\\maria"))
    one.sessions(Path(folder))
    for said in (folder, repr(folder), json.dumps(folder)):
        assert "maria" not in one.clean(f"{said}")
    assert "Eva" not in one.clean(repr(folder + r"\Eva\x.mcap"))
    assert one.clean(r"C:\Users\maria\x") == r"~\x"


def test_takes_of_other_folders(scrubber: Scrubber) -> None:
    said = scrubber.clean("replay:/media/usb/Eva-K/first.mcap and 'Eva/second.mcap.recording'.")
    assert "Eva" not in said
    assert "first" not in said
    assert "second" not in said


def test_a_token_is_called_one(scrubber: Scrubber) -> None:
    said = scrubber.clean("GET /?token=Uq3_four-years-of-work HTTP/1.1")
    assert said == f"GET /?token={TOKEN} HTTP/1.1"


def test_a_short_name_takes_nothing_from_other_words() -> None:
    one = Scrubber(home=Path("/home/maria"))
    one.names(["a", "HZ", "take"])
    assert one.clean("a rate of 17 Hz, and a take") == f"{NAME} rate of 17 {NAME}, and {NAME} take"


def test_a_longer_name_leaves_no_rest_of_itself() -> None:
    one = Scrubber(home=Path("/home/maria"))
    one.names(["Anna", "Annabel", "anna-lena"])
    assert one.clean("Anna-Lena, ANNABEL, anna") == f"{NAME}, {NAME}, {NAME}"


def test_what_was_typed_is_known_by_the_name_of_its_file() -> None:
    one = Scrubber(home=Path("/home/maria"))
    one.names(["Hans_Müller_2"])
    assert one.clean("Hans Müller, (2) and Hans_Müller_2") == f"{NAME}) and {NAME}"


def test_names_that_come_later_leave_no_rest_of_earlier_ones() -> None:
    one = Scrubber(home=Path("/home/maria"))
    one.names([*(f"subject {number} of the study" for number in range(400)), "Anna-Lena"])
    assert one.clean("Anna-Lena") == NAME
    one.names(["Anna"])
    assert one.clean("Anna-Lena, Anna, subject 7 of the study") == f"{NAME}, {NAME}, {NAME}"
    one.names(["Anna-Lena-Maria"])
    one.now(["subject"])
    said = one.clean("Anna-Lena-Maria, subject 12 of the study, subject")
    assert said == f"{NAME}, {NAME}, {NAME}"


def test_values_of_json_keep_their_shape(scrubber: Scrubber) -> None:
    value = {"P07": ["山田 太郎", 3, None, 2.5, True], "path": Path("/home/maria/x")}
    assert scrubber.cleaned(value) == {NAME: [NAME, 3, None, 2.5, True], "path": "~/x"}


def test_a_scrubber_that_knows_nothing_changes_nothing() -> None:
    one = Scrubber(home=Path("/"))
    one.names(["", " ", "take"])
    one.sessions(Path("/"))
    assert one.clean("a / b take") == "a / b take"


@given(st.lists(st.text(min_size=1, max_size=30), max_size=8), st.text(max_size=60))
def test_no_name_of_four_letters_survives_whatever_it_is(names: list[str], around: str) -> None:
    one = Scrubber(home=Path("/home/maria"))
    one.names(names)
    for name in names:
        clear = name.strip(" _.\"'")
        if len(name.strip()) >= 4 and clear and clear.lower() != "take":
            said = one.clean(f"{around} {name} {around}")
            assert name not in said.replace(NAME, "\0")


def test_a_large_library_and_a_large_log_are_no_trouble() -> None:
    """A pattern that tried each of the names at each place would take an hour."""
    one = Scrubber(home=Path("/home/maria"))
    one.names(f"subject {number} of the study" for number in range(3000))
    text = "2026-01-31 10:00:00,000 INFO capture: lost subject 2999 of the study\n" * 5000
    assert "2999" not in one.clean(text)
    one.clean("a" * 100_000)
    one.clean("a/" * 50_000)
