"""Words come from catalogues: ``_("...")`` marks and translates what a person reads."""

from __future__ import annotations

import gettext
import locale
import os
from collections.abc import Sequence
from pathlib import Path

from handstudio.errors import HandstudioError

_FOLDER = Path(__file__).parent / "locale"

LANGUAGES = {"en": "English", "ja": "日本語"}
"""The languages spoken, each by its own name."""

_catalogue = gettext.NullTranslations()
_errors = gettext.NullTranslations()
_language = "en"


def use_language(language: str | None) -> None:
    """Speak this language from now on; the system's own where none is given, else English."""
    global _catalogue, _errors, _language  # noqa: PLW0603 - one language a process
    _language = system_language() if language is None else language
    _catalogue = gettext.translation("handstudio", _FOLDER, [_language], fallback=True)
    _errors = gettext.translation("errors", _FOLDER, [_language], fallback=True)


def language() -> str:
    """The language that is spoken now."""
    return _language


def spoken(wanted: Sequence[str]) -> str | None:
    """The first of these language tags (``ja-JP``) that is spoken here; None: none is."""
    for tag in wanted:
        language = tag.replace("_", "-").split("-", maxsplit=1)[0].lower()
        if language in LANGUAGES:
            return language
    return None


def system_language() -> str:
    """The language of the system, else English."""
    names = ("LC_ALL", "LC_MESSAGES", "LANG")  # in the order in which they count
    said = next((os.environ[name] for name in names if os.environ.get(name)), None)
    return spoken([said or locale.getlocale()[0] or ""]) or "en"


def _(message: str) -> str:
    """The words in the person's language."""
    return _catalogue.gettext(message)


def in_words(error: HandstudioError) -> tuple[str, str]:
    """What happened and what to do next, in the person's language."""
    return error.in_words(lambda words: _errors.gettext(words) if words else "")
