"""Review: finding takes, and what to make of the one that is chosen or open."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import viser

from app import intents
from app.panels.base import QUIET, Send, page_of, put, typed
from app.panels.measures import MeasuresFolder
from app.panels.sheets import ask_deletion, ask_emptying
from app.shown.comparison import OF_TAKE
from app.shown.review import Review
from app.state import Shelf, State
from app.views.comparison import choices
from app.views.filters import fused_by
from app.views.formats import contents, offered
from app.views.recording import clock_of
from app.words import _, in_words
from handstudio.export.formats import Format
from handstudio.export.part import Content
from handstudio.layout import Layout, glove
from handstudio.recording.library import Entry


class LibraryPanel:
    """Search, open, recover and export takes."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._labels: dict[str, Entry] = {}
        self._entries: tuple[Entry, ...] | None = None
        self._search = gui.add_text(
            _("Search"), "", hint=_("Words of name, subject, visit, notes or marks")
        )
        self._choice = gui.add_dropdown(_("Take"), (_("Choose a take"),))
        self._facts = gui.add_markdown("")
        self._rest = gui.add_button(
            _("Compute the rest"), icon=viser.Icon.PLAYER_TRACK_NEXT, visible=False
        )
        self._recover = gui.add_button(
            _("Recover this recording"), icon=viser.Icon.LIFEBUOY, visible=False
        )
        self._export = ExportFields(gui, send)
        self._motion = MotionFields(gui, send)
        self._measures = MeasuresFolder(gui, send)
        self._notes = NotesFolder(gui, send)
        self._shelf = ShelfFolder(gui, send, self._selected)
        self._elsewhere = ElsewhereFolder(gui, send)
        self._opened: Path | None = None
        self._search.on_update(typed(lambda text: send(intents.Search(text))))
        self._choice.on_update(typed(self._chosen))
        self._rest.on_click(lambda _event: send(intents.ComputeRest()))
        self._recover.on_click(lambda _event: self._ask_recovery())

    def render(self, state: State) -> None:
        """Show the library and the open take."""
        review = state.review
        if state.shelf.found is not self._entries:
            self._entries = state.shelf.found
            self._labels = {_label(entry): entry for entry in state.shelf.found}
            options = (_("Choose a take"), *self._labels)
            if self._choice.options != options:
                self._choice.options = options
                self._opened = None
        self._follow(review.take.path if review else None)
        put(self._facts, content=self._words(state))
        entry = self._labels.get(self._choice.value)
        interrupted = entry is not None and entry.take is None and not entry.recording
        put(self._recover, visible=interrupted and review is None)
        put(self._rest, visible=review is not None and review.rest == "missing")
        self._export.render(review)
        self._motion.render(review, state.shelf.found)
        self._measures.render(state)
        self._notes.render(review)
        self._shelf.render(state)
        self._elsewhere.render(review)

    @property
    def sheet_is_open(self) -> bool:
        """Whether all measures are read now."""
        return self._measures.sheet_is_open

    def export(self, event: Any) -> None:
        """Send the open take's file to the page that asked."""
        self._export.export(event)

    def bin(self) -> None:
        """The chosen take goes to the bin."""
        self._shelf.bin()

    def _selected(self) -> Path | None:
        """The file that is chosen in the list, open or not."""
        entry = self._labels.get(self._choice.value)
        return entry.path if entry is not None else self._opened

    def _chosen(self, label: str) -> None:
        entry = self._labels.get(label)
        # an interrupted recording has nothing to open: the words and the button below speak of it
        if entry is not None and entry.take is not None:
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
        if state.review is not None:
            nothing = _shelf_words(state.shelf) if not state.shelf.found else ""
            return "\n\n".join(filter(None, [nothing, _facts(state.review)]))
        entry = self._labels.get(self._choice.value)
        if entry is not None and entry.recording:
            return _("This take is being recorded.")
        if entry is not None and entry.error is not None:
            return in_words(entry.error)[0] + "\n\n" + _("What was saved can be had back.")
        return _shelf_words(state.shelf)


class ExportFields:
    """The open take as a file: which format, what it holds, and the button."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._layout: Layout | None = None
        self._formats: dict[str, Format] = offered(glove())
        self._contents: dict[str, Content] = {}
        self._button = gui.add_button(
            _("Export {format}").format(format="CSV"),
            icon=viser.Icon.DOWNLOAD,
            hint=_("The part between in and out, or all of the take; key: E"),
            visible=False,
        )
        self._format = gui.add_dropdown(_("Format"), tuple(self._formats), visible=False)
        self._content = gui.add_dropdown(_("Contents"), (_("Joint angles"),), visible=False)
        self._button.on_click(self.export)
        self._format.on_update(lambda _event: self._offer())

    def render(self, review: Review | None) -> None:
        """Show what the open take can become."""
        layout = None if review is None else review.setup.layout
        if layout is not None and layout is not self._layout:
            self._formats = offered(layout)
            if self._format.options != tuple(self._formats):
                self._format.options = tuple(self._formats)
        self._layout = layout
        put(self._button, visible=review is not None)
        put(self._format, visible=review is not None)
        self._offer()

    def export(self, event: Any) -> None:
        """Send the open take's file to the page that asked."""
        content = self._contents.get(self._content.value)
        self._send(intents.Export(content, page_of(event), self._chosen.name))

    @property
    def _chosen(self) -> Format:
        return self._formats.get(self._format.value) or next(iter(self._formats.values()))

    def _offer(self) -> None:
        chosen = self._chosen
        self._contents = {} if self._layout is None else contents(chosen, self._layout)
        if self._contents and self._content.options != tuple(self._contents):
            self._content.options = tuple(self._contents)
        put(self._content, visible=len(self._contents) > 0)
        put(self._button, label=_("Export {format}").format(format=chosen.name.upper()))


class MotionFields:
    """How the motion of the open take is computed, and what it is compared with."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._smooth = gui.add_checkbox(
            _("Smooth"),
            initial_value=False,
            hint=_("Takes in what came after, by the whole-hand filter; exported so as well"),
            visible=False,
        )
        self._words = choices()
        self._entries: tuple[Entry, ...] | None = None
        self._of: Path | None = None
        self._compare = gui.add_dropdown(
            _("Compare with"),
            tuple(self._words.values()),
            hint=_("The second hand is pale, its curves dashed; figures are RMS differences"),
            visible=False,
        )
        self._shift = gui.add_number(
            _("It begins at [s]"),
            0.0,
            step=0.01,
            hint=_("Of this take: where the other one's begin is laid"),
            visible=False,
        )
        self._smooth.on_update(typed(lambda on: send(intents.Smooth(on))))
        self._compare.on_update(typed(lambda words: send(intents.Compare(self._names()[words]))))

        self._shift.on_update(typed(lambda at_s: send(intents.ShiftComparison(float(at_s)))))

    def _names(self) -> dict[str, str]:
        return {words: name for name, words in self._words.items()}

    def _offer(self, review: Review, entries: tuple[Entry, ...]) -> None:
        """Motions of the same take, then other takes."""
        if entries is self._entries and review.take.path == self._of:
            return
        self._entries, self._of = entries, review.take.path
        others = {
            f"{OF_TAKE}{entry.path}": _label(entry)
            for entry in entries
            if entry.take is not None and entry.path != review.take.path
        }
        self._words = {**choices(), **others}
        if self._compare.options != tuple(self._words.values()):
            self._compare.options = tuple(self._words.values())

    def render(self, review: Review | None, entries: tuple[Entry, ...]) -> None:
        """Show what was asked for."""
        if review is not None:
            self._offer(review, entries)
        second = review.comparison if review is not None else None
        put(self._shift, visible=second is not None and bool(second.take))
        if second is not None:
            put(self._shift, value=second.later_s)
        for handle in (self._smooth, self._compare):
            put(handle, visible=review is not None)
        if review is not None:
            put(self._smooth, value=review.smooth)
            put(self._compare, value=self._words.get(review.compare, self._words[""]))


class NotesFolder:
    """What a person adds to the open take: words, names of stretches, marks."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._folder = gui.add_folder(_("Notes"), expand_by_default=False, visible=False)
        with self._folder:
            self._text = gui.add_text(_("Notes"), "", multiline=True)
            self._list = gui.add_markdown("")
            self._label = gui.add_text(
                _("Name of the part"), "", hint=_("What happens between begin and end")
            )
            self._name = gui.add_button(_("Name this part"), color=QUIET)
            self._trim = gui.add_button(
                _("Trim to this part"),
                color=QUIET,
                hint=_("A new take of the part from begin to end; this one stays as it is"),
            )
            self._mark = gui.add_dropdown(_("Mark"), ("",), visible=False)
            self._remove = gui.add_button(_("Remove this mark"), color=QUIET, visible=False)
        self._marks: dict[str, float] = {}
        self._written = ""
        self._of: Path | None = None
        self._text.on_update(typed(lambda text: send(intents.SetNotes(text))))
        self._name.on_click(lambda _event: send(intents.NamePart(self._label.value)))
        self._trim.on_click(lambda _event: send(intents.TrimTake(self._label.value)))
        self._mark.on_update(typed(lambda text: send(intents.Seek(self._marks.get(text, 0.0)))))
        self._remove.on_click(
            lambda _event: send(intents.RemoveMark(self._marks.get(self._mark.value, -1.0)))
        )

    def render(self, review: Review | None) -> None:
        """Show the notes of the open take."""
        put(self._folder, visible=review is not None)
        if review is None:
            return
        whole = review.in_s <= 0.0 and review.out_s is None
        put(self._trim, disabled=whole or review.partial)
        notes = review.notes
        # written only where they changed by themselves: else words just typed would be overwritten
        if (review.take.path, notes.text) != (self._of, self._written):
            if self._of != review.take.path:
                put(self._text, value=notes.text)
            self._of, self._written = review.take.path, notes.text
        stretches = [
            f"- {label.label}: {clock_of(label.start_s)} – {clock_of(label.end_s)}"
            for label in notes.labels
        ]
        put(self._list, content="\n".join(stretches))
        self._marks = {
            f"{clock_of(mark.at_s)} {mark.text}".strip(): mark.at_s for mark in notes.marks
        }
        options = tuple(self._marks) or ("",)
        if self._mark.options != options:
            self._mark.options = options
        put(self._mark, visible=bool(self._marks))
        put(self._remove, visible=bool(self._marks))


class ElsewhereFolder:
    """Takes that come from another computer, or go there."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        with gui.add_folder(_("From elsewhere"), expand_by_default=False):
            upload = gui.add_upload_button(
                _("Add a take"),
                icon=viser.Icon.UPLOAD,
                color=QUIET,
                hint=_("A file .mcap or .take.zip of your computer is copied into the library"),
            )
            path = gui.add_text(
                _("or path"), "", hint=_("Of the studio's computer: a take, or a folder to import")
            )
            self._open = gui.add_button(_("Add from the path"), color=QUIET)
            self._share = gui.add_button(
                _("Share as one file"),
                icon=viser.Icon.SHARE,
                color=QUIET,
                hint=_("The take with its notes, to be added elsewhere"),
            )
        upload.on_upload(
            lambda event: send(intents.AddTake(event.target.value.name, event.target.value.content))
        )
        self._open.on_click(
            lambda _event: send(intents.AddTake(path.value)) if path.value else None
        )
        self._share.on_click(lambda event: send(intents.ShareTake(page_of(event))))

    def render(self, review: Review | None) -> None:
        """Only an open take can be shared."""
        put(self._share, disabled=review is None)


class ShelfFolder:
    """Keeping the library tidy: names, the bin, subjects; and taking it back."""

    def __init__(self, gui: viser.GuiApi, send: Send, selected: Any) -> None:
        self._send = send
        self._state: State | None = None
        with gui.add_folder(_("Keep tidy"), expand_by_default=False):
            self._name = gui.add_text(_("New name"), "")
            self._rename = gui.add_button(_("Rename the take"), color=QUIET)
            self._bin = gui.add_button(
                _("Move to the bin"), icon=viser.Icon.TRASH, color=QUIET, hint=_("Key: Delete")
            )
            self._undo = gui.add_button(_("Undo"), icon=viser.Icon.ARROW_BACK_UP, color=QUIET)
            self._binned = gui.add_dropdown(_("In the bin"), ("",), visible=False)
            self._restore = gui.add_button(_("Put it back"), color=QUIET, visible=False)
            self._empty = gui.add_button(_("Empty the bin"), color=QUIET, visible=False)
            self._delete = gui.add_button(
                _("Delete a subject"), icon=viser.Icon.USER_X, color=QUIET, visible=False
            )
        self._selected = selected
        self._keys: dict[str, str] = {}
        self._rename.on_click(lambda _event: self._ask_rename())
        self._bin.on_click(lambda _event: self.bin())
        self._undo.on_click(lambda _event: send(intents.Undo()))
        self._restore.on_click(lambda _event: self._put_back())
        self._empty.on_click(self._ask_emptying)
        self._delete.on_click(self._ask_deletion)

    def render(self, state: State) -> None:
        """Show what can be done."""
        self._state = state
        chosen = self._selected() is not None
        put(self._rename, disabled=not chosen)
        put(self._bin, disabled=not chosen)
        undo = state.shelf.undo
        label = _("Undo: {what}").format(what=undo) if undo else _("Nothing to undo")
        put(self._undo, label=label, disabled=not undo)
        binned = state.shelf.binned
        self._keys = {f"{one.name} · {one.subject} · {one.visit}": one.key for one in binned}
        options = tuple(self._keys) or ("",)
        if self._binned.options != options:
            self._binned.options = options
        for handle in (self._binned, self._restore, self._empty):
            put(handle, visible=bool(binned))
        empty = _("Empty the bin ({count})").format(count=len(binned))
        put(self._empty, label=empty)
        put(self._delete, visible=bool(state.shelf.subjects))

    def bin(self) -> None:
        """The chosen take goes to the bin."""
        path = self._selected()
        if path is not None:
            self._send(intents.BinTake(path))

    def _ask_rename(self) -> None:
        path = self._selected()
        if path is not None and self._name.value.strip():
            self._send(intents.RenameTake(path, self._name.value))

    def _put_back(self) -> None:
        key = self._keys.get(self._binned.value)
        if key is not None:
            self._send(intents.RestoreTake(key))

    def _ask_emptying(self, event: Any) -> None:
        if event.client is not None:
            ask_emptying(event.client, self._send, len(self._keys))

    def _ask_deletion(self, event: Any) -> None:
        if event.client is not None and self._state is not None:
            ask_deletion(event.client, self._send, self._state)


def _shelf_words(shelf: Shelf) -> str:
    if not shelf.takes:
        return _("No takes yet: record one.")
    if not shelf.found:
        return _("No take has all these words.")
    if shelf.search.strip():
        return _("Takes: {found} of {all}").format(found=len(shelf.found), all=len(shelf.takes))
    return _("Takes: {all}").format(all=len(shelf.takes))


def _facts(review: Review) -> str:
    header, summary = review.take.header, review.take.summary
    start = datetime.fromtimestamp(header.start_utc_ns * 1e-9).astimezone()
    counts = _("{instants} instants, {lost} lost").format(
        instants=len(review.time_s), lost=summary.missing if summary else "?"
    )
    zero = _("Zero of angles: {zero}").format(zero=_zero(header.setup.zero))
    fused = _("Fused by: {filter}").format(filter=fused_by(review.setup))
    return (
        f"**{review.take.path.stem}** · {header.subject} · {start:%Y-%m-%d %H:%M:%S}\n\n"
        f"{clock_of(review.duration_s)} · {counts}\n\n{fused}\n\n{zero}"
    )


def _zero(zero: str) -> str:
    """What angles are measured from, in the page's language; files keep the English."""
    known = {
        "nominal mounting: sensor axes taken as segment axes": _(
            "nominal mounting: sensor axes taken as segment axes"
        )
    }
    return known.get(zero, zero)


def _label(entry: Entry) -> str:
    mark = " ●" if entry.recording else " ⚠" if entry.take is None else ""
    return f"{entry.name} · {entry.subject} · {entry.visit}{mark}"
