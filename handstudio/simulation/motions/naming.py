"""From what a person types to the name of a motion: ``Index MP flexion`` is index_mcp:flexion."""

from __future__ import annotations

import re
from difflib import get_close_matches

from handstudio.errors import SetupError
from handstudio.simulation.motions.catalogue import motions
from handstudio.simulation.motions.language import parse

# flexion and extension are one motion, as are abduction and adduction
_SAME = {
    "mp": "mcp",
    "cm": "cmc",
    "flex": "flexion",
    "extension": "flexion",
    "abd": "abduction",
    "adduction": "abduction",
    "pinky": "little",
}
_NOTHING = {"finger", "joint", "of", "the", "and"}
"""Said by many, and no part of a name."""


def resolve(text: str) -> str:
    """What `language.perform` understands, from a phrase of it or a motion's name in plain words.

    Raises:
        SetupError: it is neither.
    """
    spoken = {frozenset(_words(name)): name for name in motions()}
    said = _words(text)
    if frozenset(said) in spoken:
        return spoken[frozenset(said)]
    try:
        parse(text)
    except SetupError:
        by_words = {" ".join(_words(name)): name for name in motions()}
        near = get_close_matches(" ".join(said), list(by_words), n=3)
        if not near:
            raise
        raise SetupError(
            "There is no motion {name!r}.",
            "Nearest are {near}; see handstudio motions for all.",
            name=text,
            near=", ".join(by_words[words] for words in near),
        ) from None
    return text.strip()


def _words(text: str) -> list[str]:
    words = [word for word in re.split(r"[^a-z0-9]+", text.lower()) if word]
    return [_SAME.get(word, word) for word in words if word not in _NOTHING]
