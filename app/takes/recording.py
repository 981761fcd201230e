"""Takes from the person's side: begun, marked, ended, and what went wrong with them told."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app import intents
from app.board import Board
from app.sounds import Sound
from app.takes.taker import Taker
from handstudio.errors import HandstudioError

_ONCE_S = 0.4  # the space bar is a key of the page, and also presses the button clicked last


@dataclass
class Recording:
    """Owner of what the state tells of the take that is on, or about to be."""

    board: Board
    taker: Taker
    _toggled_s: float = -1.0

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        state = self.board.state
        match intent:
            case intents.ToggleRecording(page=page):
                self._toggle(page)
            case intents.GoOn(page=page) if state.review is None:
                self._toggle(page)
            case intents.PutMark(text=text) if state.newest.recorder is not None:
                if self.taker.mark(text):
                    self.board.sound(Sound.MARK)
            case _:
                return False
        return True

    def begin_or_end(self, page: int) -> None:
        """End the take that is on, or the count before it; else begin to count.

        Raises:
            HandstudioError: there is nothing to record from, or no room.
        """
        board = self.board
        if board.state.newest.recorder is not None:
            self.taker.stop()
            board.sound(Sound.STOP)
            return
        if self.taker.countdown is not None:
            self.taker.cancel()
            return
        if not board.state.can_record:
            raise HandstudioError(
                "There is no device to record from.", "Connect one under Device, then record."
            )
        if board.state.subject is None:
            board.state = replace(board.state, asking=page)
            return
        self.taker.begin(board.settings)
        if board.state.review is not None:
            board.close_review()

    def tick(self, elapsed_s: float) -> None:
        """The countdown, the disk, and the end that comes by itself."""
        board, taker = self.board, self.taker
        away_s = 0.0 if board.state.newest.ready else board.state.away_s + elapsed_s
        board.state = replace(board.state, away_s=away_s)
        try:
            board.sound_all(taker.tick(elapsed_s, board.state, board.settings))
        except HandstudioError as error:
            board.alarm(error)
        board.state = replace(
            board.state, countdown=taker.countdown, disk=taker.disk, marks=taker.marks
        )

    def _toggle(self, page: int) -> None:
        if self.board.now_s - self._toggled_s >= _ONCE_S:
            self._toggled_s = self.board.now_s
            self.begin_or_end(page)
