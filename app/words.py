"""Words come from catalogues: ``_("...")`` marks and translates what a person reads."""

from __future__ import annotations

import gettext
from pathlib import Path

from handstudio.errors import HandstudioError

_FOLDER = Path(__file__).parent / "locale"

_catalogue = gettext.NullTranslations()
_errors = gettext.NullTranslations()


def use_language(language: str | None) -> None:
    """Speak this language from now on; the system's own where none is given, else English."""
    global _catalogue, _errors  # noqa: PLW0603 - one language a process
    languages = None if language is None else [language]
    _catalogue = gettext.translation("handstudio", _FOLDER, languages, fallback=True)
    _errors = gettext.translation("errors", _FOLDER, languages, fallback=True)


def _(message: str) -> str:
    """The words in the person's language."""
    return _catalogue.gettext(message)


def in_words(error: HandstudioError) -> tuple[str, str]:
    """What happened and what to do next, in the person's language."""
    return error.in_words(lambda words: _errors.gettext(words) if words else "")
