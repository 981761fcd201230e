"""The state, and what is told with it: what each concern of the studio is given."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import msgspec

from app import words
from app.sounds import Sound
from app.state import Message, State
from app.work.jobs import Stopped
from app.work.outcomes import Download
from handstudio.errors import HandstudioError
from handstudio.settings import Settings, SettingsStore


@dataclass
class Board:
    """Owner of the state and of the settings in it; for one thread.

    Attributes:
        store: Where the settings are kept.
        state: Everything the page is drawn from; each concern replaces what it is about.
        now_s: Time of the last tick, by a steady clock [s].
    """

    store: SettingsStore
    state: State
    now_s: float = 0.0

    def __post_init__(self) -> None:
        self.change()

    @property
    def settings(self) -> Settings:
        """What is kept from one start to the next."""
        return self.store.settings

    def begin_tick(self) -> None:
        """What was told is told once."""
        told = replace(self.state, messages=(), downloads=(), sounds=())
        self.state = replace(told, asking=None, asking_for="")

    def end_tick(self, elapsed_s: float) -> None:
        """So much later; settings that changed are kept."""
        self.now_s += elapsed_s
        self.store.tick(self.now_s)
        notice = self.store.take_notice()
        if notice is not None:
            self.say(notice)

    def change(self, **values: Any) -> None:
        """Change settings."""
        self.store.put(msgspec.structs.replace(self.store.settings, **values), self.now_s)
        self.state = replace(self.state, settings=self.store.settings)

    def close_review(self) -> None:
        """No take is open any more."""
        self.state = replace(self.state, review=None, yaw=None)

    # --- telling --------------------------------------------------------------------------------

    def tell(self, text: str) -> None:
        """Something went well."""
        self.state = replace(self.state, messages=(*self.state.messages, Message(text)))

    def say(self, error: HandstudioError) -> None:
        """Something went wrong."""
        what, remedy = words.in_words(error)
        message = Message(what, remedy, alarm=True)
        self.state = replace(self.state, messages=(*self.state.messages, message))

    def tell_why(self, error: HandstudioError) -> None:
        """Work will not be done: it failed, or nobody wanted it any more."""
        if isinstance(error, Stopped):
            self.tell(" ".join(words.in_words(error)))
        else:
            self.say(error)

    def alarm(self, error: HandstudioError) -> None:
        """Something went wrong while people's eyes may be elsewhere."""
        self.sound(Sound.ALARM)
        self.say(error)

    def sound(self, sound: Sound) -> None:
        """Something is to be heard, where sounds are wanted."""
        if self.settings.sounds:
            self.state = replace(self.state, sounds=(*self.state.sounds, sound))

    def sound_all(self, sounds: Iterable[Sound]) -> None:
        """All of these are to be heard."""
        for sound in sounds:
            self.sound(sound)

    def send_file(self, download: Download) -> None:
        """A file for a page."""
        self.state = replace(self.state, downloads=(*self.state.downloads, download))
