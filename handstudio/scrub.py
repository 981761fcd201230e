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
from typing import Any, TypeAlias
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

    What was private once remains so: a log speaks of what was. A pattern of thousands of names
    takes long to make, so those that came since are kept in a small one, which is asked first.
    """

    def __init__(self, home: Path | None = None) -> None:
        self._lock = threading.Lock()
        self._seen: set[str] = set()  # words whose spellings are known
        self._names: set[str] = set()  # each spelling of each
        self._recent: set[str] = set()  # those that are not in the large pattern, or would cut it
        self._current: frozenset[str] = frozenset()
        self._tokens: set[str] = set()
        self._folders: set[str] = set()
        self._home = {each for each in _spellings(str(home or Path.home())) if len(each) > 1}
        self._small: re.Pattern[str] | None = None
        self._large: re.Pattern[str] | None = None

    def names(self, names: Iterable[str]) -> None:
        """Subject codes, names of takes, words of notes: from now on never said."""
        fresh = {name.strip() for name in names} - self._seen
        if not fresh:
            return
        new = _all_spellings(fresh)
        with self._lock:
            self._seen |= fresh
            self._recent |= new | self._longer_than(new)
            self._names |= new
            self._small = None
            if len(self._recent) > _FEW:
                self._recent, self._large = set(), None

    def now(self, names: Iterable[str]) -> None:
        """Names that are being typed: not said until there are others in their place."""
        current = frozenset(names)
        if current != self._current:
            with self._lock:
                self._current, self._small = current, None

    def tokens(self, tokens: Iterable[str]) -> None:
        """What opens doors."""
        with self._lock:
            self._tokens |= _all_spellings(tokens)
            self._small = None

    def sessions(self, folder: Path) -> None:
        """Where takes live: neither the folder nor anything below it is said."""
        with self._lock:
            for path in {str(folder), str(folder.absolute())} - {"/", ".", ""}:
                self._folders |= _spellings(path)
            self._small = None

    def clean(self, text: str) -> str:
        """The text without what is private."""
        with self._lock:
            self._small = self._small or self._compiled_small()
            self._large = self._large or _pattern([*_of_names(self._names)])
            patterns = self._small, self._large
        for pattern in patterns:
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

    def _longer_than(self, new: set[str]) -> set[str]:
        """Names that hold one of the new: who takes out these first leaves a rest of those."""
        low = {word.lower() for word in new}
        return {old for old in self._names if any(word in old.lower() for word in low)}

    def _compiled_small(self) -> re.Pattern[str]:
        current = _all_spellings(self._current)
        names = self._recent | current | self._longer_than(current)
        return _pattern(
            [
                ("sessions", self._folders, "", _REST_OF_PATH),
                ("token", self._tokens, "", ""),
                *_of_names(names),
                ("home", self._home, "", r"(?![\w-])"),
            ]
        )


_Part: TypeAlias = tuple[str, Iterable[str], str, str]
"""What it is, its words, and what has to be before and behind them."""

_FEW = 300


def _of_names(names: Iterable[str]) -> list[_Part]:
    """Short names count as words of their own only, or nothing would be left of a text."""
    short = [each for each in names if len(each) < _SHORT]
    long = [each for each in names if len(each) >= _SHORT]
    return [("name", long, "", ""), ("word", short, r"(?<![^\W_])", r"(?![^\W_])")]


def _pattern(parts: Iterable[_Part]) -> re.Pattern[str]:
    given = [
        f"(?P<{kind}>{before}(?:{_any_of(words)}){after})"
        for kind, words, before, after in parts
        if words
    ]
    return re.compile("|".join(given) or r"(?!)", re.IGNORECASE)


_SHORT = 4
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
