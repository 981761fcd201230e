"""The open take is played, and framed: which moment, which part, which stretch of the plots."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app import intents
from app.board import Board
from app.shown import review as reviewing
from app.shown.review import Review


@dataclass
class Playing:
    """Moves through the open take."""

    board: Board

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else, or no take is open."""
        review = self.board.state.review
        if review is None:
            return False
        moved = _played(review, intent) or _framed(review, intent)
        if moved is None:
            return False
        self.board.state = replace(self.board.state, review=moved)
        return True

    def tick(self, elapsed_s: float) -> None:
        """So much later."""
        review = self.board.state.review
        if review is not None and review.playing:
            review = reviewing.advanced(review, elapsed_s)
            self.board.state = replace(self.board.state, review=review)


def _played(review: Review, move: intents.Intent) -> Review | None:
    match move:
        case intents.TogglePlay() | intents.GoOn():
            moved = reviewing.toggled(review)
        case intents.Seek(at_s=at_s):
            moved = reviewing.sought(review, at_s)
        case intents.Step(instants=instants):
            moved = reviewing.stepped(review, instants)
        case intents.GoToMark(forward=forward):
            moved = reviewing.at_next_mark(review, forward=forward)
        case intents.SetSpeed(factor=factor):
            moved = replace(review, speed=factor)
        case intents.SetLoop(on=on):
            moved = replace(review, loop=on)
        case _:
            return None
    return moved


def _framed(review: Review, move: intents.Intent) -> Review | None:
    match move:
        case intents.MarkIn():
            moved = reviewing.marked_in(review)
        case intents.MarkOut():
            moved = reviewing.marked_out(review)
        case intents.WholeTake():
            moved = reviewing.whole(review)
        case intents.ZoomPlots(factor=factor):
            moved = reviewing.zoomed(review, factor)
        case intents.PanPlots(share=share):
            moved = reviewing.panned(review, share)
        case intents.FitPlots():
            moved = reviewing.fitted(review)
        case intents.ShiftComparison(later_s=later_s):
            moved = reviewing.shifted(review, later_s)
        case _:
            return None
    return moved
