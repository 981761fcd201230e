"""Every word a person reads is in every catalogue."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path
from types import ModuleType

import pytest
from babel.messages.catalog import Catalog
from babel.messages.pofile import read_po

from app import words
from handstudio.errors import LayoutError, SetupError, TakeError
from handstudio.layout import Layout, SensorPlace, glove
from handstudio.recording import library

ROOT = Path(__file__).resolve().parents[2]
CATALOGUES = sorted(ROOT.glob("app/locale/*/LC_MESSAGES/*.po"))
NAMES = [f"{path.parts[-3]}-{path.stem}" for path in CATALOGUES]

FEWEST = {"handstudio": 50, "errors": 150}
"""Texts that are there at the least: an extraction that finds none would agree with anything."""


def loaded(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"{path.stem}_under_test", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def collect() -> ModuleType:
    """The script that finds what is said."""
    return loaded(ROOT / ".ci/words.py")


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The catalogues as a build compiles them."""
    root = tmp_path_factory.mktemp("built")
    folder = root / "app/locale"
    shutil.copytree(ROOT / "app/locale", folder, ignore=shutil.ignore_patterns("*.mo"))
    hook = loaded(ROOT / "hatch_build.py").CompileCatalogues(str(root), {}, None, None, "", "wheel")
    hook.initialize("standard", {})
    return folder


@pytest.fixture
def japanese(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(words, "_FOLDER", built)
    for name in ("_catalogue", "_errors"):
        monkeypatch.setattr(words, name, getattr(words, name))
    words.use_language("ja")


def read(path: Path) -> Catalog:
    with path.open("rb") as file:
        return read_po(file)


# --- the catalogues -------------------------------------------------------------------------------


def test_every_language_has_every_catalogue(collect: ModuleType) -> None:
    languages = {path.parts[-3] for path in CATALOGUES}
    assert languages == {"ja"}
    assert sorted(f"{each}-{domain}" for each in languages for domain in collect.DOMAINS) == NAMES


@pytest.mark.parametrize("path", CATALOGUES, ids=NAMES)
def test_everything_is_translated_and_nothing_is_left_over(path: Path, collect: ModuleType) -> None:
    said = collect.DOMAINS[path.stem]()
    assert len(said) >= FEWEST[path.stem]
    translated = {str(m.id): str(m.string) for m in read(path) if m.id}
    assert translated.keys() == set(said), "run .ci/words.py, then translate what it names"
    for message, translation in translated.items():
        assert translation, message
        assert collect.fields(translation) == collect.fields(message), message


@pytest.mark.parametrize("path", CATALOGUES, ids=NAMES)
def test_nothing_obsolete_or_doubtful_is_kept(path: Path) -> None:
    catalogue = read(path)
    assert not catalogue.obsolete
    assert not [message.id for message in catalogue if message.id and message.fuzzy]


# --- errors in the code ---------------------------------------------------------------------------


def test_every_error_in_the_code_has_two_constant_templates_with_its_values(
    collect: ModuleType,
) -> None:
    calls = list(collect.calls())
    assert len(calls) > 80
    for call in calls:
        assert len(call.templates) == 2, f"{call.where}: what happened, and what to do next"
        assert all(call.templates), f"{call.where}: a text is empty, or no constant"
        named = {name for text in call.templates for name in collect.names(text)}
        assert named == call.values, f"{call.where}: the values are not those the texts name"


def test_the_check_sees_what_it_should(collect: ModuleType, tmp_path: Path) -> None:
    code = tmp_path / "handstudio/somewhere.py"
    code.parent.mkdir()
    code.write_text(
        "from handstudio import errors\n"
        "_REMEDY = 'Try {again}.'\n"
        "class OwnError(errors.TakeError): ...\n"
        "class TakeError(errors.HandstudioError): ...\n"
        "raise OwnError(f'{path}: gone', _REMEDY, path=1)\n"
        "errors.TakeError('{path.name!r}' ' gone', 'Look' + '.', **values)\n"
        "ValueError('other')\n"
    )
    own, dotted = collect.calls(tmp_path)
    assert own.where == "handstudio/somewhere.py:5"
    assert own.templates == (None, "Try {again}.")
    assert own.values == {"path"}
    assert dotted.templates == ("{path.name!r} gone", None)
    assert dotted.values == {None}
    assert collect.names("{path.name!r} {n:.1f} {{no}}") == {"path", "n"}
    assert collect.fields("{n:.1f}, {x!r:>4}") == {"{n:.1f}", "{x!r:>4}"}
    assert collect.said_in_errors(tmp_path) == ["Try {again}.", "{path.name!r} gone"]


def test_catalogues_are_brought_up_to_date(collect: ModuleType) -> None:
    old = Catalog("ja")
    old.add("Stays", "残る")
    old.add("Goes", "消える")
    new = collect.brought_up_to_date(old, ["New {one}", "Stays"])
    assert [(m.id, m.string) for m in new if m.id] == [("New {one}", ""), ("Stays", "残る")]
    assert not new.obsolete


# --- speaking -------------------------------------------------------------------------------------


@pytest.mark.usefixtures("japanese")
def test_a_language_speaks_and_an_unknown_one_falls_back() -> None:
    error = TakeError("{path}: not a take.", "Choose a file that ends in .mcap.", path="a.mcap")
    assert words._("Record") == "記録"
    assert words.in_words(error) == (
        "a.mcap: テイクではありません。",
        ".mcap で終わるファイルを選んでください。",
    )
    assert error.what == "a.mcap: not a take."

    words.use_language("tlh")
    assert words._("Record") == "Record"
    assert words.in_words(error) == ("a.mcap: not a take.", "Choose a file that ends in .mcap.")

    words.use_language("ja")
    assert words.in_words(error)[0] == "a.mcap: テイクではありません。"


@pytest.mark.usefixtures("japanese")
def test_words_of_others_stay_as_they_are() -> None:
    assert words.in_words(SetupError("Theirs: {odd", "")) == ("Theirs: {odd", "")


@pytest.mark.usefixtures("japanese")
def test_a_reason_speaks_the_language_of_its_error() -> None:
    no_hand = glove("unknown").no_hand
    assert no_hand is not None
    error = LayoutError("There is no hand in this recording.", "{why} {why.remedy}", why=no_hand)
    assert error.remedy == (
        "The layout does not say which hand: no hand is shown. Export orientations instead."
    )
    assert words.in_words(error)[1] == "".join(words.in_words(no_hand))
    assert "左右" in words.in_words(error)[1]


@pytest.mark.usefixtures("japanese")
def test_the_library_says_why_a_file_cannot_be_opened(tmp_path: Path) -> None:
    path = tmp_path / "S1/2026-01-01/take.mcap.recording"
    path.parent.mkdir(parents=True)
    path.touch()
    (entry,) = library.entries(tmp_path)
    assert entry.error is not None
    assert "この記録は途中で中断されました" in words.in_words(entry.error)[0]
    assert "this recording was interrupted" in entry.problem


def test_whoever_lacks_a_hand_is_told_what_is_missing() -> None:
    forearm, hand = SensorPlace("A", "forearm"), SensorPlace("B", "hand")
    index = SensorPlace("C", "index_proximal")
    for places, missing in [
        ((hand, index), "No sensor on forearm: no hand is shown."),
        ((forearm, index), "No sensor on hand: no hand is shown."),
        ((index,), "No sensor on forearm and hand: no hand is shown."),
        ((forearm, hand, SensorPlace("D", "door")), "The layout names segments or joints that"),
    ]:
        assert Layout("left", places, ()).missing_for_hand.startswith(missing)
    assert glove().no_hand is None
    assert glove().missing_for_hand == ""
