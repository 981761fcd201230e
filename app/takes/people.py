"""Whose takes these are: people chosen, made known, and deleted with all that is theirs."""

from __future__ import annotations

from dataclasses import dataclass

from app import intents
from app.board import Board
from app.takes.library import Library
from app.takes.recording import Recording
from handstudio.device.capture import Capture
from handstudio.device.orders import SetHand


@dataclass
class People:
    """Chooses whose hand it is."""

    board: Board
    capture: Capture
    library: Library
    recording: Recording

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        match intent:
            case intents.ChooseSubject(code=code):
                self._choose(code)
            case intents.SaveSubject(then_record=then_record):
                self.save(intent)
                if then_record:
                    self.recording.begin_or_end(page=-1)
            case intents.DeleteSubject(code=code, typed=typed):
                self._delete(code, typed)
            case _:
                return False
        return True

    def save(self, typed: intents.SaveSubject) -> None:
        """A person, new or known, is the one who is recorded from now on.

        Raises:
            TakeError: it cannot be kept.
        """
        saved = self.library.keeper.save_subject(typed)
        self.library.show()
        self._choose(saved.code)

    def _choose(self, code: str) -> None:
        self.board.change(subject=code)
        self.capture.send(SetHand(self.board.state.hand))

    def _delete(self, code: str, typed: str) -> None:
        self.library.refuse_while_working()
        review = self.board.state.review
        if review is not None and review.take.header.subject == code:
            self.board.close_review()
        self.board.tell(self.library.keeper.delete_subject(code, typed))
        if self.board.settings.subject == code:
            self.board.change(subject="")
