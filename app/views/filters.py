"""Filters in words. Pure."""

from __future__ import annotations

from app.state import State
from app.words import _
from handstudio.setup import FILTERS, Setup


def filter_words() -> dict[str, str]:
    """Every filter's name, and what a person reads."""
    known = {"tree": _("Tree (whole hand)"), "vqf": _("VQF (each sensor)")}
    return {name: known.get(name, name) for name in FILTERS}


def fused_by(setup: Setup) -> str:
    """What made the motion of a take."""
    name = str(setup.filter.__struct_config__.tag)
    words = filter_words().get(name, name)
    return _("{filter}, smoothed").format(filter=words) if setup.smooth else words


def preparing_of(state: State) -> str:
    """What to say while the whole-hand filter is awaited; empty: nothing."""
    return {
        "no": "",
        "yes": _("Preparing the whole-hand filter; until then VQF serves."),
        "failed": _("The whole-hand filter cannot be prepared; VQF serves."),
    }[state.preparing]
