"""Settings that nothing follows from but that they are kept, and shown."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from app import intents
from app.board import Board


@dataclass
class Preferences:
    """Changes settings as they are asked for."""

    board: Board

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        change = self.board.change
        match intent:
            case intents.SetVisit(name=name):
                change(visit=name)
            case intents.SetTakeName(name=name):
                change(take_name=name)
            case intents.SetHandType(hand_type=hand_type):
                change(hand_type=hand_type)
            case intents.SetCountdown(seconds=seconds):
                change(countdown_s=seconds)
            case intents.SetSounds(on=on):
                change(sounds=on)
            case intents.SetFilter(name=name):
                change(filter=name)
            case intents.SetTheme(dark=dark):
                change(theme="dark" if dark else "light")
            case intents.SetShown(part=part, on=on):
                self._show(part, on=on)
            case intents.ToggleShown(part=part):
                self._show(part, on=not getattr(self.board.settings.shown, part))
            case _:
                return False
        return True

    def _show(self, part: str, *, on: bool) -> None:
        shown = msgspec.structs.replace(self.board.settings.shown, **{part: on})
        self.board.change(shown=shown)
