"""Errors: words in any language, and whole on the other side of a process."""

from __future__ import annotations

import pickle
from pathlib import Path

from handstudio.errors import HandstudioError, LayoutError, TakeError


def test_values_stand_in_the_words_of_any_language() -> None:
    error = TakeError("{path}: {rows} rows are damaged.", "Copy {path} again.", path="a", rows=3)
    assert error.what == "a: 3 rows are damaged."
    assert error.remedy == "Copy a again."
    catalogue = {"{path}: {rows} rows are damaged.": "{rows} de {path}"}
    assert error.in_words(lambda text: catalogue.get(text, text)) == ("3 de a", "Copy a again.")


def test_the_same_error_about_something_else() -> None:
    error = TakeError("{path}: {rows} rows.", "Copy {path}.", path="/tmp/x/a", rows=3)
    other = error.about(path="a", unheard_of=1)
    assert isinstance(other, TakeError)
    assert (other.what, other.remedy) == ("a: 3 rows.", "Copy a.")
    assert error.what == "/tmp/x/a: 3 rows."


def test_words_without_values_are_taken_literally() -> None:
    assert HandstudioError("{not a name", "{}").what == "{not a name"


def test_values_may_hold_braces() -> None:
    assert TakeError("{path}: gone.", "Look.", path="{odd}.mcap").what == "{odd}.mcap: gone."


def test_an_error_comes_whole_out_of_another_process() -> None:
    why = LayoutError("{sensor} is loose.", "Tape {sensor} on.", sensor="SN4")
    error = TakeError(
        "{path}, {seconds:.1f} s, {row:04d}: {why}",
        "{why.remedy}",
        path=Path("x.mcap"),
        seconds=1.25,
        row=7,
        why=why,
    )
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is TakeError
    assert (again.what, again.remedy) == ("x.mcap, 1.2 s, 0007: SN4 is loose.", "Tape SN4 on.")
    assert str(again) == str(error)
    catalogue = {"{sensor} is loose.": "{sensor} flojo", "{why.remedy}": "! {why.remedy}"}
    assert again.in_words(lambda text: catalogue.get(text, text)) == (
        "x.mcap, 1.2 s, 0007: SN4 flojo",
        "! Tape SN4 on.",
    )


def test_a_value_may_be_called_anything() -> None:
    assert TakeError("{what} {remedy} {self}", "-", what=1, remedy=2, self=3).what == "1 2 3"
