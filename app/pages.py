"""The open pages: how many, what they speak, and from where they look at the hand."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app import intents, words
from app.board import Board
from app.devices.devices import Devices
from app.shown.look import LASTING, View, facing
from handstudio.device.capture import Capture
from handstudio.device.orders import NotePage


@dataclass
class Pages:
    """Owner of language and view.

    Attributes:
        language: Asked for at the start; until another is chosen on the page.
    """

    board: Board
    capture: Capture
    devices: Devices
    language: str | None = None

    def __post_init__(self) -> None:
        kept = [view for view in LASTING if view.value == self.board.settings.camera]
        self.board.state = replace(self.board.state, view=kept[0] if kept else View.DESK)
        self._speak(())

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        board = self.board
        match intent:
            case intents.PagesOpen(count=count, languages=languages):
                board.state = replace(board.state, pages=count)
                if languages:
                    self._speak(languages)
            case intents.PageShown(ms=ms):
                board.state = replace(board.state, page_ms=ms)
                if ms is not None:
                    self.capture.send(NotePage(ms))
            case intents.SetLanguage(language=language):
                board.change(language=language)
                self.language = None
                self._speak(())
            case intents.SetView(view=view):
                board.change(camera=view.value if view in LASTING else "")
                board.state = replace(board.state, view=view, aimed=board.state.aimed + 1)
            case intents.FaceForward():
                self.devices.face_anew()
                board.state = replace(board.state, yaw=None, aimed=board.state.aimed + 1)
            case _:
                return False
        return True

    def tick(self) -> None:
        """Choose the turn of the picture once there is a first pose to choose it by."""
        state = self.board.state
        review, newest = state.review, state.newest
        if state.yaw is not None:
            return
        if review is not None:
            yaw = facing(review.setup, review.instant)
        elif newest.setup is not None and newest.motion is not None:
            yaw = facing(newest.setup, newest.motion)
        else:
            return
        self.board.state = replace(state, yaw=yaw)

    def _speak(self, languages: tuple[str, ...]) -> None:
        """The language that was chosen, else that of the newest page, else the system's."""
        chosen = self.language or words.spoken([self.board.settings.language])
        language = chosen or words.spoken(languages) or words.system_language()
        words.use_language(language)
        self.board.state = replace(self.board.state, language=language)
