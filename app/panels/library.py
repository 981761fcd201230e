"""Review: the takes, and what to make of the one that is open."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import viser

from app import intents
from app.panels.base import Send, put
from app.studio import State
from app.view import clock_of
from app.words import _
from handstudio.export.csv import Content
from handstudio.recording.library import Entry


class LibraryPanel:
    """Open a take, export it."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._labels: dict[str, Entry] = {}
        self._entries: tuple[Entry, ...] | None = None
        self._choice = gui.add_dropdown(_("Take"), (_("Choose a take"),))
        self._facts = gui.add_markdown("")
        self._recover = gui.add_button(
            _("Recover this recording"), icon=viser.Icon.LIFEBUOY, visible=False
        )
        self._csv = gui.add_button(
            _("Export CSV"), icon=viser.Icon.DOWNLOAD, hint=_("Joint angles; key: E"), visible=False
        )
        self._more = gui.add_dropdown(
            _("Contents"), ("angles", "orientations", "positions"), visible=False
        )
        self._opened: Path | None = None
        self._choice.on_update(self._chosen)
        self._recover.on_click(lambda _event: self._ask_recovery())
        self._csv.on_click(self.export)

    def render(self, state: State) -> None:
        """Show the library and the open take."""
        if state.takes is not self._entries:
            self._entries = state.takes
            self._labels = {_label(entry, state.sessions): entry for entry in state.takes}
            self._choice.options = (_("Choose a take"), *self._labels)
        review = state.review
        self._follow(review.take.path if review else None)
        put(self._csv, visible=review is not None)
        put(self._more, visible=review is not None)
        put(self._facts, content=self._words(state))
        entry = self._labels.get(self._choice.value)
        interrupted = entry is not None and entry.take is None
        put(self._recover, visible=interrupted and review is None)
        if review is not None:
            contents = _contents(review.setup.layout.is_hand)
            if self._more.options != contents:
                self._more.options = contents

    def export(self, event: Any) -> None:
        """Send the open take's file to the page that asked."""
        page = event.client.client_id if event.client is not None else -1
        content: Content = self._more.value  # type: ignore[assignment]
        self._send(intents.Export(content, page))

    def _chosen(self, event: Any) -> None:
        entry = self._labels.get(self._choice.value)
        # an interrupted recording has nothing to open: the words and the button below speak of it
        if event.client is not None and entry is not None and entry.take is not None:
            self._send(intents.OpenTake(entry.path))

    def _ask_recovery(self) -> None:
        entry = self._labels.get(self._choice.value)
        if entry is not None:
            self._send(intents.RecoverTake(entry.path))

    def _follow(self, path: Path | None) -> None:
        """The list shows the take that is open, whoever opened it."""
        if path == self._opened:
            return
        self._opened = path
        shown = [label for label, entry in self._labels.items() if entry.path == path]
        put(self._choice, value=shown[0] if shown else _("Choose a take"))

    def _words(self, state: State) -> str:
        review = state.review
        if review is None:
            entry = self._labels.get(self._choice.value)
            if entry is not None and entry.take is None:
                return entry.problem + "\n\n" + _("What was saved can be had back.")
            return "" if self._labels else _("No takes yet: record one.")
        header, summary = review.take.header, review.take.summary
        start = datetime.fromtimestamp(header.start_utc_ns * 1e-9).astimezone()
        counts = _("{instants} instants, {lost} lost").format(
            instants=len(review.time_s), lost=summary.missing if summary else "?"
        )
        zero = _("Zero of angles: {zero}").format(zero=header.setup.zero)
        return (
            f"**{review.take.path.stem}** · {header.subject} · {start:%Y-%m-%d %H:%M:%S}\n\n"
            f"{clock_of(review.duration_s)} · {counts}\n\n{zero}"
        )


def _contents(hand: bool) -> tuple[str, ...]:
    return ("angles", "orientations", "positions") if hand else ("orientations",)


def _label(entry: Entry, sessions: Path) -> str:
    try:
        place = entry.path.relative_to(sessions)
    except ValueError:
        place = entry.path
    subject, visit = (*place.parts[:2], "", "")[:2]
    name = place.name.removesuffix(".mcap")
    mark = " ⚠" if entry.take is None else ""
    return f"{name} · {subject} · {visit}{mark}"
