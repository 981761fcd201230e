"""Errors: words in any language, and whole on the other side of a process."""

from __future__ import annotations

import pickle
from pathlib import Path

from handstudio.errors import HandstudioError, TakeError


def test_values_stand_in_the_words_of_any_language() -> None:
    error = TakeError("{path}: {rows} rows are damaged.", "Copy {path} again.", path="a", rows=3)
    assert error.what == "a: 3 rows are damaged."
    assert error.remedy == "Copy a again."
    catalogue = {"{path}: {rows} rows are damaged.": "{rows} de {path}"}
    assert error.in_words(lambda text: catalogue.get(text, text)) == ("3 de a", "Copy a again.")


def test_words_without_values_are_taken_literally() -> None:
    assert HandstudioError("{not a name", "{}").what == "{not a name"


def test_values_may_hold_braces() -> None:
    assert TakeError("{path}: gone.", "Look.", path="{odd}.mcap").what == "{odd}.mcap: gone."


def test_an_error_comes_whole_out_of_another_process() -> None:
    error = TakeError("{path}: is no take.", "Choose another.", path=Path("x.mcap"))
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is TakeError
    assert (again.what, again.remedy) == (error.what, error.remedy)
    assert str(again) == str(error)
