"""Record: the biggest button in reach, whose hand it is, what the take is called."""

from __future__ import annotations

from typing import Any

import viser

from app import intents
from app.panels.base import Send, put
from app.studio import HAND_LENGTH_MM, State
from app.view import recording_of
from app.words import _
from handstudio.device.orders import Phase

RED = (200, 52, 52)


class RecordButton:
    """Start and stop takes, in reach whatever else is open."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._button = gui.add_button(
            _("Record"), icon=viser.Icon.PLAYER_RECORD, color=RED, hint=_("Key: R")
        )
        self._note = gui.add_markdown("")
        self._button.on_click(lambda _event: send(intents.ToggleRecording()))

    def render(self, state: State) -> None:
        """Show whether a take is on."""
        newest = state.newest
        recording = newest.recorder is not None
        ready = recording or newest.phase is Phase.STREAMING
        put(self._button, label=_("Stop") if recording else _("Record"), disabled=not ready)
        put(self._note, content=recording_of(newest), visible=recording)


class RecordPanel:
    """Whose hand it is and what the next take is called."""

    def __init__(self, gui: viser.GuiApi, send: Send, state: State) -> None:
        self._subject = gui.add_text(
            _("Subject"), state.subject, hint=_("A code; no name is needed")
        )
        self._name = gui.add_text(_("Take name"), state.take_name)
        shortest, longest = HAND_LENGTH_MM
        self._hand = gui.add_number(
            _("Hand length [mm]"),
            round(state.hand_length_mm),
            min=round(shortest),
            max=round(longest),
            step=1,
            hint=_("From the wrist crease to the tip of the middle finger"),
        )
        self._note = gui.add_markdown("")
        self._subject.on_update(_typed(lambda text: send(intents.SetSubject(text))))
        self._name.on_update(_typed(lambda text: send(intents.SetTakeName(text))))
        self._hand.on_update(_typed(lambda mm: send(intents.SetHandLength(mm))))

    def render(self, state: State) -> None:
        """What a take was begun with stays as it is until it ends."""
        recording = state.newest.recorder is not None
        for field in (self._subject, self._name, self._hand):
            put(field, disabled=recording)
        put(self._note, content=_("Takes go to {folder}").format(folder=state.sessions))


def _typed(use: Any) -> Any:
    """Only what a person typed counts, not what the studio wrote into the field."""
    return lambda event: use(event.target.value) if event.client is not None else None
