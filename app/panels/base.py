"""What every panel is given, and setting things only when they change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from app.intents import Intent

Send: TypeAlias = Callable[[Intent], None]


def put(handle: Any, **values: Any) -> None:
    """Set properties of a handle that differ from what they are: each costs a message."""
    for name, value in values.items():
        if getattr(handle, name) != value:
            setattr(handle, name, value)
