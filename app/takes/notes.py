"""What is written beside the open take: words, names of parts, marks."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app import intents
from app.board import Board
from app.shown.review import Review
from app.takes.keeping import Keeper
from handstudio.recording import notes as noting


@dataclass
class NoteTaker:
    """Writes notes; they can be taken back as any change to the library."""

    board: Board
    keeper: Keeper

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else, or no take is open."""
        review = self.board.state.review
        if review is None:
            return False
        notes = _with(review, intent)
        if notes is None:
            return False
        if notes != review.notes:
            self.keeper.write_notes(review.take.path, notes)
            self.board.state = replace(self.board.state, review=replace(review, notes=notes))
        return True


def _with(review: Review, intent: intents.Intent) -> noting.Notes | None:
    match intent:
        case intents.SetNotes(text=text):
            return noting.with_text(review.notes, text)
        case intents.NamePart(label=label):
            return noting.with_label(review.notes, review.in_s, review.end_s, label)
        case intents.PutMark(text=text):
            return noting.with_mark(review.notes, review.at_s, text)
        case intents.RemoveMark(at_s=at_s):
            there = [mark for mark in review.notes.marks if mark.at_s == at_s]
            return noting.without_mark(review.notes, there[-1]) if there else review.notes
    return None
