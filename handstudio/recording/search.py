"""Finding takes by words."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable

from handstudio.recording.library import Entry


def search(entries: Iterable[Entry], text: str) -> list[Entry]:
    """The entries in which every word of a text stands somewhere, in their order.

    It is looked for in subject, visit, name, notes, labels, marks and the day of the recording,
    whatever the case and the width of letters; no words find everything.
    """
    words = _plain(text).split()
    return [entry for entry in entries if _holds(entry, words)]


def _holds(entry: Entry, words: list[str]) -> bool:
    hay = _plain("\n".join(_told(entry))) if words else ""
    return all(word in hay for word in words)


def _told(entry: Entry) -> list[str]:
    notes = entry.notes
    labels = [label.label for label in notes.labels]
    marks = [mark.text for mark in notes.marks]
    return [entry.subject, entry.visit, entry.name, notes.text, *labels, *marks, _day(entry)]


def _day(entry: Entry) -> str:
    return f"{entry.start.astimezone():%Y-%m-%d}" if entry.start else ""


def _plain(text: str) -> str:
    return unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", text).casefold())
