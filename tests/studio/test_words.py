"""Every word a person reads is in every catalogue."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from babel.messages.extract import extract_from_dir
from babel.messages.pofile import read_po

import app
from app import words

ROOT = Path(app.__file__).parent
CATALOGUES = sorted(ROOT.glob("locale/*/LC_MESSAGES/*.po"))


def said() -> set[str]:
    found = extract_from_dir(str(ROOT), [("**.py", "python")], keywords={"_": None})
    return {str(message) for _file, _line, message, _comments, _context in found}


def test_there_are_words() -> None:
    assert len(said()) > 50
    assert [path.parts[-3] for path in CATALOGUES] == ["ja"]


@pytest.mark.parametrize("path", CATALOGUES, ids=lambda path: path.parts[-3])
def test_everything_is_translated_and_nothing_is_left_over(path: Path) -> None:
    with path.open("rb") as file:
        catalogue = read_po(file)
    translated = {str(m.id): str(m.string) for m in catalogue if m.id}
    assert translated.keys() == said()
    for message, translation in translated.items():
        assert translation, message
        assert figures(translation) == figures(message), message


def test_a_language_speaks_and_an_unknown_one_falls_back() -> None:
    try:
        words.use_language("ja")
        assert words._("Record") == "記録"
        words.use_language("tlh")
        assert words._("Record") == "Record"
    finally:
        words.use_language("en")


def figures(text: str) -> set[str]:
    return set(re.findall(r"\{[^}]*\}", text))
