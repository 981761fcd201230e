"""Files that are made for a page: exports and parcels of the open take, and diagnostics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import msgspec

from app import diagnostics, intents
from app.board import Board
from app.words import _
from app.work.outcomes import Exported, Gathered, Outcome
from app.work.workshop import Workshop
from handstudio.export.part import Window


@dataclass
class Files:
    """Orders files, and sends them."""

    board: Board
    workshop: Workshop

    def hear(self, intent: intents.Intent) -> bool:
        """Do what is asked for; False: it is about something else."""
        review = self.board.state.review
        match intent:
            case intents.Export():
                self._export(intent)
            case intents.ShareTake(page=page):
                if review is not None:
                    self.workshop.share(review.take, page)
            case intents.SendDiagnostics(page=page):
                self._gather_diagnostics(page)
            case intents.CancelWork():
                self.workshop.cancel()
            case _:
                return False
        return True

    def done(self, outcome: Outcome) -> bool:
        """Send what was made; False: it is about something else."""
        match outcome:
            case Exported(download=download):
                self.board.tell(_("Exported {path}.").format(path=download.content))
                self.board.send_file(download)
            case Gathered(download=download):
                self.board.send_file(download)
            case _:
                return False
        return True

    def _export(self, order: intents.Export) -> None:
        review = self.board.state.review
        if review is None:
            return
        window, page = Window(review.in_s, review.out_s), order.page
        path, setup = review.take.path, review.used
        self.workshop.export(path, order.format, order.content, window, page=page, setup=setup)

    def _gather_diagnostics(self, page: int) -> None:
        state, settings = self.board.state, self.board.settings
        work = partial(
            diagnostics.make,
            state.newest,
            settings=msgspec.to_builtins(settings),
            sessions=state.sessions,
            takes=state.shelf.takes,
            names=(settings.subject, settings.take_name),
        )
        self.workshop.gather(work, page)
