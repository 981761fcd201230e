"""Names of files that every system takes, and the files that belong to a take."""

from __future__ import annotations

import unicodedata
from pathlib import Path
from typing import Literal

from handstudio.errors import TakeError

UNFINISHED = ".recording"
"""Suffix of a take that is being written, or was when the computer went down."""

TAKE = ".mcap"

VIEW = "~motion.mcap"
"""What an export that viewers open ends in: it is no take, and none can be called so."""

LONGEST = 80, 180
"""Characters, and bytes in UTF-8, of a name: with what is added to it a file system takes 255."""

_BESIDE = (
    *(".notes.json", ".notes.json.bak", ".notes.json.new"),
    *(".motion", ".reference.npz", ".truth.npz", ".track.npz"),
)

# Windows takes these for devices, whatever comes after a dot
_DEVICES = {"CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$"} | {
    kind + number for kind in ("COM", "LPT") for number in "0123456789¹²³"
}


def file_name(text: str, what: Literal["subject", "visit", "take"]) -> str:
    """Words as a file name that every system accepts; letters of any language stay.

    Args:
        text: What a person typed.
        what: What is named, for the error.

    Raises:
        TakeError: nothing is left.
    """
    composed = unicodedata.normalize("NFC", text)
    allowed = "".join(sign if _may_stand(sign) else " " for sign in composed)
    clean = cut("_".join(allowed.split()).strip("._")).rstrip("._")
    if not clean:
        raise _nameless(what)
    return f"_{clean}" if clean.split(".")[0].upper() in _DEVICES else clean


def cut(text: str) -> str:
    """The beginning of a text that is short enough for a name."""
    characters, length = LONGEST
    return text[:characters].encode(errors="ignore")[:length].decode(errors="ignore")


def same_name(one: str, other: str) -> bool:
    """Whether some system takes two names for the same: by case, or by how accents are written."""
    return _folded(one) == _folded(other)


def take_stem(path: Path) -> str:
    """The name of a take, closed or not."""
    return path.name.removesuffix(UNFINISHED).removesuffix(TAKE)


def closed_path(path: Path) -> Path:
    """Where a take lies once it is closed: ``NAME.mcap`` for ``NAME.mcap.recording`` too."""
    return path.with_name(path.name.removesuffix(UNFINISHED))


def is_unfinished(path: Path) -> bool:
    """Whether a path is that of a recording that goes on, or was interrupted."""
    return path.name.endswith(UNFINISHED)


def belongings(path: Path) -> list[Path]:
    """What there is of a take: what stands beside it first, its own file last; no exports."""
    stem = take_stem(path)
    beside = [path.with_name(stem + suffix) for suffix in _BESIDE]
    return [each for each in (*beside, path) if each.exists()]


def is_free(path: Path) -> bool:
    """Whether no take is there, nor notes or motion of one, which a new one would inherit."""
    closed = closed_path(path)
    names = (TAKE, TAKE + UNFINISHED, *_BESIDE)
    return not any(path.with_name(take_stem(closed) + suffix).exists() for suffix in names)


def free_path(path: Path) -> Path:
    """This path, or the same with a number added where it is taken.

    Raises:
        TakeError: ten thousand are taken.
    """
    stem, suffix = take_stem(path), path.name.removeprefix(take_stem(path))
    for candidate in (stem, *(f"{stem}-{n}" for n in range(2, 10_000))):
        if is_free(path.with_name(candidate + suffix)):
            return path.with_name(candidate + suffix)
    raise TakeError(
        "{folder}: ten thousand takes are called {name}.",
        "Choose another name.",
        folder=path.parent,
        name=stem,
    )


def _nameless(what: Literal["subject", "visit", "take"]) -> TakeError:
    match what:
        case "subject":
            return TakeError("The subject has no name.", "Type a name with letters or digits.")
        case "visit":
            return TakeError("The visit has no name.", "Type a name with letters or digits.")
        case "take":
            return TakeError("The take has no name.", "Type a name with letters or digits.")


def _may_stand(sign: str) -> bool:
    # accents and vowel signs are part of a letter in many languages
    return sign.isalnum() or sign in "_-+." or unicodedata.category(sign).startswith("M")


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFKC", name).casefold())
