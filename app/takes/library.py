"""The library from the page: takes found, renamed, thrown away, had back, and brought in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from app import intents
from app.board import Board
from app.review.opening import Opening
from app.takes.keeping import Keeper
from app.words import _
from app.work.outcomes import Added, Outcome, Trimmed
from app.work.workshop import Workshop
from handstudio.errors import HandstudioError
from handstudio.recording.recovery import recover


@dataclass
class Library:
    """Owner of the shelf in the state."""

    board: Board
    keeper: Keeper
    opening: Opening
    workshop: Workshop

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        tell, keeper = self.board.tell, self.keeper
        match intent:
            case intents.Search(text=text):
                keeper.search(text)
            case intents.RenameTake(path=path, name=name):
                self.refuse_while_working()
                self.opening.renamed(path, keeper.rename(path, name))
            case intents.BinTake(path=path):
                self._bin(path)
            case intents.Undo():
                self._undo()
            case intents.RestoreTake(key=key):
                tell(keeper.restore(key))
            case intents.EmptyBin():
                tell(keeper.empty_bin())
            case intents.AddTake(name=name, content=content):
                self.workshop.add(name, content, self.board.state.sessions)
            case intents.TrimTake(name=name):
                self._trim(name)
            case intents.RecoverTake(path=path):
                self._recover(path)
            case _:
                return False
        return True

    def done(self, outcome: Outcome) -> bool:
        """Take in what was made; False: it is about something else."""
        match outcome:
            case Added(path=path):
                self.board.tell(_("Added {name}.").format(name=path.stem))
                self.refresh()
                self.opening.open_or_say(path)
            case Trimmed(path=path):
                text = _("Trimmed: {name} is a take of its own.")
                self.board.tell(text.format(name=path.stem))
                self.refresh()
            case _:
                return False
        return True

    def recorded(self, path: Path) -> None:
        """A take is whole; it is opened, where not another one is on."""
        text = _("Recorded {name}. Replay it below, export it under Review.")
        self.board.tell(text.format(name=path.stem))
        if self.board.state.newest.recorder is None:
            self.opening.open_or_say(path)

    def refresh(self) -> None:
        """Read the library again."""
        self.keeper.refresh()
        self.show()

    def show(self) -> None:
        """The state shows the shelf as it is now."""
        self.board.state = replace(self.board.state, shelf=self.keeper.shelf)

    def refuse_while_working(self) -> None:
        """Nothing is moved that a job may be reading.

        Raises:
            HandstudioError: one is on.
        """
        if self.workshop.work is not None:
            raise HandstudioError(
                "A take is being computed or exported.", "Wait until it is done, or cancel it."
            )

    def _bin(self, path: Path) -> None:
        self.refuse_while_working()
        review = self.board.state.review
        if review is not None and review.take.path == path:
            self.board.close_review()
        self.board.tell(self.keeper.bin(path))

    def _undo(self) -> None:
        undone = self.keeper.undo()
        if undone is None:
            return
        text, path = undone
        self.board.tell(text)
        self.opening.taken_back(path)
        if self.board.state.review is None:  # the one that was open when it went to the bin
            self.opening.open(path)

    def _trim(self, name: str) -> None:
        review = self.board.state.review
        if review is not None:
            self.workshop.trim(review.take.path, review.in_s, review.out_s, name)

    def _recover(self, path: Path) -> None:
        recovered = recover(path)
        text = _("Recovered {seconds:.1f} s as {name}.")
        self.board.tell(text.format(seconds=recovered.duration_s, name=recovered.path.stem))
        self.refresh()
        self.opening.open(recovered.path)
