"""Filters in words. Pure."""

from __future__ import annotations

from app.state import State
from app.words import _
from handstudio.setup import FILTERS


def filter_words() -> dict[str, str]:
    """Every filter's name, and what a person reads."""
    known = {"tree": _("Tree (whole hand)"), "vqf": _("VQF (each sensor)")}
    return {name: known.get(name, name) for name in FILTERS}


def preparing_of(state: State) -> str:
    """What to say while the whole-hand filter is awaited; empty: nothing."""
    return {
        "no": "",
        "yes": _("Preparing the whole-hand filter …"),
        "failed": _("The whole-hand filter cannot be prepared; VQF serves."),
    }[state.preparing]
