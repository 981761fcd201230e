"""What every panel is given, and setting things only when they change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from app.intents import Intent

QUIET = (84, 92, 102)
"""Buttons that are not the first thing to do; on dark and light pages they look alive."""

Send: TypeAlias = Callable[[Intent], None]


def put(handle: Any, **values: Any) -> None:
    """Set properties of a handle that differ from what they are: each costs a message."""
    for name, value in values.items():
        if getattr(handle, name) != value:
            setattr(handle, name, value)


def typed(use: Callable[[Any], None]) -> Callable[[Any], None]:
    """Only what a person typed or chose counts, not what the studio wrote into the field."""
    return lambda event: use(event.target.value) if event.client is not None else None


def page_of(event: Any) -> int:
    """The page an event came from; -1: from none."""
    return int(event.client.client_id) if event.client is not None else -1
