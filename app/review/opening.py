"""Takes are opened, and what is seen of the open one is brought up to what is asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from app import intents
from app.board import Board
from app.devices.filtering import Chooser
from app.review.reviewer import Reviewer
from app.shown import comparison
from app.shown import review as reviewing
from app.shown.review import Review
from app.work.jobs import Stopped
from app.work.outcomes import (
    Computed,
    FoundIn,
    Outcome,
    Previewed,
    Surveyed,
    Uncomputed,
    Unseen,
    WayFound,
    Written,
)
from handstudio.analysis.stretches import Stretch
from handstudio.errors import HandstudioError
from handstudio.recording import notes as noting
from handstudio.recording.take import Take, open_take
from handstudio.setup import Setup


@dataclass
class Opening:
    """Opens takes, and brings the open one up to what is asked for and to what is there."""

    board: Board
    reviewer: Reviewer
    chooser: Chooser

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        match intent:
            case intents.OpenTake(path=path):
                self.open(path)
            case intents.ShowLive():
                self.board.close_review()
            case intents.Smooth(on=on):
                self.ask(smooth=on)
            case intents.Compare(name=name):
                self.ask(compare=name)
            case intents.ChooseCurves(name=name, sensor=sensor):
                self.reviewer.sensor = sensor or self.reviewer.sensor
                self.board.change(curves=name)
                self.ask()
            case intents.ComputeRest():
                review = self.board.state.review
                if review is not None:
                    self._put(self.reviewer.completed(review))
            case _:
                return False
        return True

    def open(self, path: Path) -> None:
        """Show a take, now or as soon as it is computed.

        Raises:
            HandstudioError: it cannot be opened.
        """
        take = open_take(path)
        preview = self.chooser.serves(take.header.setup.filter)
        review = self.reviewer.opened(take, preview=preview)
        if review is not None:
            self._show(review)

    def open_or_say(self, path: Path) -> None:
        """Show a take; what is amiss is told."""
        try:
            self.open(path)
        except HandstudioError as error:
            self.board.say(error)

    def ask(self, **asked: Any) -> None:
        """Of the open take, where there is one, other fields of the review are wanted."""
        review = self.board.state.review
        if review is not None:
            self._bring(replace(review, **asked))

    def renamed(self, before: Path, path: Path) -> None:
        """A take that is open stays open where it is, under its other name."""
        review = self.board.state.review
        if review is not None and review.take.path == before:
            self._put(replace(review, take=replace(review.take, path=path)))

    def taken_back(self, path: Path) -> None:
        """What was taken back may be a name or the notes of the take that is open."""
        review = self.board.state.review
        if review is None:
            return
        if not review.take.path.exists():
            self.renamed(review.take.path, path)
        review = self.board.state.review
        if review is not None and review.take.path == path:
            self._put(replace(review, notes=noting.load_notes(path)))

    # --- work that is done ----------------------------------------------------------------------

    def done(self, outcome: Outcome) -> bool:
        """Take in what was ordered; False: it is about something else, or no longer wanted."""
        match outcome:
            case Computed(take=take, setup=None):
                self._computed(take)
            case Computed(take=take) if self._concerns(take):
                self.ask()
            case Surveyed(take=take, setup=setup, stretches=found) if self._is_open(take):
                self._look_at(setup or take.header.setup, found)
            case Written(take=take) | WayFound(take=take) if self._is_open(take):
                self.ask()
            case Previewed(take=take, motion=motion):
                review = self.reviewer.head(take, motion)
                if review is not None:
                    self._show(review)
            case Uncomputed():
                self._uncomputed(outcome)
            case Unseen(take=take, what=what, error=error):
                self.board.tell_why(error)
                if what != "way" or isinstance(error, Stopped):
                    self._forget_order(take, what)  # what the track says stays as it is
            case FoundIn(take=take, setup=setup, found=found) if self._is_open(take):
                review = self.board.state.review
                if review is not None and review.setup == setup:
                    self._put(replace(review, found=found))
            case _:
                return False
        return True

    def complete(self) -> None:
        """An export, too, may have computed what was missing of the open take."""
        review = self.board.state.review
        if review is not None and review.rest == "missing":
            self._computed(review.take)

    def _computed(self, take: Take) -> None:
        before = self.board.state.review
        try:
            review = self.reviewer.computed(take, before)
        except HandstudioError as error:
            self.board.say(error)
            return
        if review is None:
            return
        if before is not None and before.take.path == take.path:
            self._bring(review)
        else:
            self._show(review)

    def _uncomputed(self, outcome: Uncomputed) -> None:
        self.board.tell_why(outcome.error)
        review, take = self.board.state.review, outcome.take
        if outcome.own:
            shown = self.reviewer.uncomputed(take, review)
            if shown is not None:
                self._put(shown)
        elif review is not None and self._concerns(take):
            self._bring(reviewing.settled(review))

    def _forget_order(self, take: Take, what: str) -> None:
        review = self.board.state.review
        if review is not None and self._is_open(take):
            self._put(replace(review, ordered=review.ordered - {what}))

    def _look_at(self, setup: Setup, found: tuple[Stretch, ...]) -> None:
        review = self.board.state.review
        if review is not None and review.setup == setup:
            self._put(replace(review, stretches=found))

    def _concerns(self, take: Take) -> bool:
        """Whether it is open, or compared with the one that is."""
        review = self.board.state.review
        beside = f"{comparison.OF_TAKE}{take.path}"
        return self._is_open(take) or (review is not None and review.compare == beside)

    def _is_open(self, take: Take) -> bool:
        review = self.board.state.review
        return review is not None and review.take.path == take.path

    # --- showing --------------------------------------------------------------------------------

    def _show(self, review: Review) -> None:
        """A take that was not open before."""
        notes = noting.Notes()
        try:
            notes = noting.load_notes(review.take.path)
        except HandstudioError as error:
            self.board.say(error)
        self.board.state = replace(self.board.state, yaw=None)
        self._bring(replace(review, notes=notes))

    def _bring(self, review: Review) -> None:
        """With all that is asked for, as far as it is there."""
        self.reviewer.curves = self.board.settings.curves
        try:
            review = self.reviewer.brought(review)
        except HandstudioError as error:  # what it is compared with is gone
            self.board.say(error)
            review = self.reviewer.brought(reviewing.settled(review))
        self._put(review)

    def _put(self, review: Review) -> None:
        self.board.state = replace(self.board.state, review=review)
