"""The open take is measured: alone, against other takes, in numbers or as a report."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from app import intents
from app.board import Board
from app.review.opening import Opening
from app.work.outcomes import MeasuredPart, Outcome
from app.work.workshop import Workshop
from handstudio.export.part import Window
from handstudio.measure import band_from, bands_with


@dataclass
class Measuring:
    """Orders measures of the part that counts."""

    board: Board
    opening: Opening
    workshop: Workshop

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        match intent:
            case intents.CompareVisits(earlier=earlier):
                self._compare(earlier=earlier)
            case intents.CompareSides(other=other):
                self._compare(other_side=other)
            case intents.AddPosture() | intents.RemovePosture():
                self._change_postures(intent)
            case intents.MeasureHand() | intents.MakeReport():
                self._measure(intent)
            case _:
                return False
        return True

    def done(self, outcome: Outcome) -> bool:
        """Take in what was measured; False: it is about something else, or no longer wanted."""
        review = self.board.state.review
        match outcome:
            case MeasuredPart(take=take, measured=measured):
                if review is not None and review.take.path == take.path:
                    self.opening.ask(measured=measured)
            case _:
                return False
        return True

    def _compare(self, **with_: Any) -> None:
        """What was measured without is of no use any more."""
        review = self.board.state.review
        if review is not None:
            review = replace(review, measured=None, **with_)
            self.board.state = replace(self.board.state, review=review)

    def _change_postures(self, intent: intents.AddPosture | intents.RemovePosture) -> None:
        """What was measured without the new one is measured anew."""
        kept = [band for band in self.board.settings.postures if band.name != intent.name.strip()]
        if isinstance(intent, intents.AddPosture):
            kept.append(band_from(intent.name, intent.angle, intent.above, intent.below))
        self.board.change(postures=tuple(kept))
        self._compare()

    def _measure(self, order: intents.MeasureHand | intents.MakeReport) -> None:
        review = self.board.state.review
        if review is None:
            return
        part, beside = Window(review.in_s, review.out_s), (review.earlier, review.other_side)
        bands = bands_with(self.board.settings.postures)
        match order:
            case intents.MeasureHand():
                self.workshop.measure(review.take, part, review.used, beside, bands)
            case intents.MakeReport(page=page):
                self.workshop.report(review.take.path, part, page, review.used, beside, bands=bands)
