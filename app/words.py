"""Words come from catalogues: ``_("...")`` marks and translates what a person reads."""

from __future__ import annotations

import gettext
from pathlib import Path

_DOMAIN = "handstudio"
_FOLDER = Path(__file__).parent / "locale"

_catalogue: gettext.NullTranslations = gettext.NullTranslations()


def use_language(language: str | None) -> None:
    """Speak this language from now on; the system's own where none is given, else English."""
    global _catalogue  # noqa: PLW0603 - one language a process
    languages = None if language is None else [language]
    _catalogue = gettext.translation(_DOMAIN, _FOLDER, languages, fallback=True)


def _(message: str) -> str:
    """The words in the person's language."""
    return _catalogue.gettext(message)
