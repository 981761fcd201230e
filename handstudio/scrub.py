"""Texts without what is private: names of people and takes, folders, tokens.

What is logged says none of this in the first place. This is the last line of defence, for texts
that are not ours, such as those of exceptions.
"""

from __future__ import annotations

import json
import re
import threading
import unicodedata
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

NAME = "[name]"
TOKEN = "[token]"
SESSIONS = "[sessions]"
TAKE = "[take]"

OUR_WORDS = frozenset({"take"})
"""The name a take has unless it is given another one tells nothing, and stands everywhere."""

# what is left of the path of a take, wherever it lies
_TAKE_FILE = re.compile(
    r"[^\s'\"]{0,400}\.(?:mcap|notes\.json|truth\.npz)[^\s'\":,;)]{0,400}", re.IGNORECASE
)
# behind a folder: all that lies in it, up to a colon with a space, a quote or the line's end
_REST_OF_PATH = r"(?:(?:\\\\|[/\\])(?:(?!: )[^\n'\"])*|(?![\w.-]))"


class Scrubber:
    """Knows what is private, and takes it out of texts; for any thread.

    What was private once remains so: a log speaks of what was.
    """

    def __init__(self, home: Path | None = None) -> None:
        self._lock = threading.Lock()
        self._secrets: dict[str, str] = {}  # each spelling, and what stands for it
        self._current: frozenset[str] = frozenset()
        self._folders: dict[str, str] = {}
        self._home = _spellings(str(home or Path.home()))
        self._pattern: re.Pattern[str] | None = None

    def names(self, names: Iterable[str]) -> None:
        """Subject codes, names of takes, words of notes: from now on never said."""
        self._keep(names, NAME)

    def now(self, names: Iterable[str]) -> None:
        """Names that are being typed: not said until there are others in their place."""
        current = frozenset(names)
        if current != self._current:
            with self._lock:
                self._current, self._pattern = current, None

    def tokens(self, tokens: Iterable[str]) -> None:
        """What opens doors."""
        self._keep(tokens, TOKEN)

    def sessions(self, folder: Path) -> None:
        """Where takes live: neither the folder nor anything below it is said."""
        with self._lock:
            for path in {str(folder), str(folder.absolute())} - {"/", ".", ""}:
                self._folders |= dict.fromkeys(_spellings(path), SESSIONS)
            self._pattern = None

    def clean(self, text: str) -> str:
        """The text without what is private."""
        with self._lock:
            self._pattern = self._pattern or self._compiled()
            pattern = self._pattern
        text = pattern.sub(lambda found: _STANDS_FOR[found.lastgroup or "name"], text)
        return _TAKE_FILE.sub(TAKE, text)

    def cleaned(self, value: Any) -> Any:
        """A value of JSON without what is private."""
        if isinstance(value, Mapping):
            return {self.clean(str(key)): self.cleaned(one) for key, one in value.items()}
        if isinstance(value, list | tuple | set | frozenset):
            return [self.cleaned(one) for one in value]
        if value is None or isinstance(value, bool | int | float):
            return value
        return self.clean(str(value))

    def _keep(self, words: Iterable[str], stands_for: str) -> None:
        new = dict.fromkeys(_all_spellings(words), stands_for)
        with self._lock:
            if not new.keys() <= self._secrets.keys():
                self._secrets |= new
                self._pattern = None

    def _compiled(self) -> re.Pattern[str]:
        tokens = [each for each, kind in self._secrets.items() if kind == TOKEN]
        names = [each for each, kind in self._secrets.items() if kind == NAME]
        names += _all_spellings(self._current)
        short = [each for each in names if len(each) < _SHORT]
        long = [each for each in names if len(each) >= _SHORT]
        home = [each for each in self._home if len(each) > 1]
        parts = [
            ("sessions", list(self._folders), "", _REST_OF_PATH),
            ("token", tokens, "", ""),
            ("name", long, "", ""),
            ("word", short, r"(?<![^\W_])", r"(?![^\W_])"),
            ("home", home, "", r"(?![\w-])"),
        ]
        given = [
            f"(?P<{kind}>{before}(?:{_any_of(words)}){after})"
            for kind, words, before, after in parts
            if words
        ]
        return re.compile("|".join(given) or r"(?!)", re.IGNORECASE)


_SHORT = 4
"""A shorter name counts as a word of its own only, or nothing would be left of a text."""

_IN_FILE_NAME = r"(?:_|[^\w\-+.]{1,20})"
"""What ``_`` in the name of a file may have been when it was typed."""

_STANDS_FOR = {"sessions": SESSIONS, "token": TOKEN, "name": NAME, "word": NAME, "home": "~"}


def _any_of(words: Iterable[str]) -> str:
    """A pattern for any of the words, the longest possible; thousands of words cost little."""
    groups: dict[str, list[str]] = {}
    for word in {_small(word) for word in words}:
        groups.setdefault(word[0], []).append(word)
    return "|".join(_beginning_alike(group) for group in groups.values())


def _beginning_alike(words: list[str]) -> str:
    first, last = min(words), max(words)
    alike = (a == b for a, b in zip(first, last, strict=False))
    start = first[: next((k for k, same in enumerate(alike) if not same), len(first))]
    rests = {word[len(start) :] for word in words} - {""}
    pattern = re.escape(start).replace("_", _IN_FILE_NAME)
    if not rests:
        return pattern
    may_end = "?" if start in words else ""
    return f"{pattern}(?:{_any_of(rests)}){may_end}"


def _small(word: str) -> str:
    """Without capitals, where these are as long: letters of either kind are found alike."""
    return word.lower() if len(word.lower()) == len(word) else word


def _all_spellings(words: Iterable[str]) -> set[str]:
    clear = {word.strip() for word in words}
    ours = {word for word in clear if not word or word.lower() in OUR_WORDS}
    return {spelling for word in clear - ours for spelling in _spellings(word)}


def _spellings(word: str) -> set[str]:
    """The ways in which a word comes out of programs."""
    forms = {word, *(unicodedata.normalize(form, word) for form in ("NFC", "NFD", "NFKC"))}
    forms |= {re.sub(r"[^\w\-+.]+", "_", form).strip("._") for form in forms}  # as a file name
    forms |= {line.strip() for form in forms for line in form.splitlines()}
    written = set(forms)
    for form in forms:
        written |= {repr(form)[1:-1], ascii(form)[1:-1], json.dumps(form)[1:-1], quote(form)}
        written |= {quote(form, safe=""), repr(form.encode("utf-8", "replace"))[2:-1]}
        written |= {json.dumps(form, ensure_ascii=False)[1:-1], repr(repr(form)[1:-1])[1:-1]}
    return {each for each in written if each.strip(" _.\"'")}
