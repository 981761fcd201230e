"""Sheets for what cannot be taken back: deleting a subject, emptying the bin."""

from __future__ import annotations

import viser

from app import intents
from app.panels.base import QUIET, Send, typed
from app.state import State
from app.words import _, in_words
from handstudio.errors import HandstudioError
from handstudio.recording.deletion import Removal, what_deleting_removes


def ask_deletion(client: viser.ClientHandle, send: Send, state: State) -> None:
    """A sheet for one page: who, what goes, and the code once more."""
    gui = client.gui
    codes = tuple(subject.code for subject in state.shelf.subjects)
    if not codes:
        return
    modal = gui.add_modal(_("Delete a subject"))
    with modal:
        who = gui.add_dropdown(_("Subject"), codes, initial_value=codes[0])
        what = gui.add_markdown(_what_goes(state, codes[0]))
        again = gui.add_text(_("Type the code"), "")
        delete = gui.add_button(
            _("Delete for good"), icon=viser.Icon.TRASH, color="red", disabled=True
        )
        leave = gui.add_button(_("Cancel"), color=QUIET)

    def chosen(code: str) -> None:
        what.content = _what_goes(state, code)
        delete.disabled = again.value != code

    def deleted(_event: object) -> None:
        send(intents.DeleteSubject(who.value, again.value))
        modal.close()

    who.on_update(typed(chosen))
    again.on_update(typed(lambda text: setattr(delete, "disabled", text != who.value)))
    delete.on_click(deleted)
    leave.on_click(lambda _event: modal.close())


def ask_emptying(client: viser.ClientHandle, send: Send, count: int) -> None:
    """A sheet for one page: whether what is in the bin may go."""
    modal = client.gui.add_modal(_("Empty the bin"))
    with modal:
        words = _("{count} takes go for good. This cannot be taken back.").format(count=count)
        client.gui.add_markdown(words)
        empty = client.gui.add_button(_("Empty it"), icon=viser.Icon.TRASH, color="red")
        leave = client.gui.add_button(_("Cancel"), color=QUIET)

    def emptied(_event: object) -> None:
        send(intents.EmptyBin())
        modal.close()

    empty.on_click(emptied)
    leave.on_click(lambda _event: modal.close())


def _what_goes(state: State, code: str) -> str:
    try:
        removal = what_deleting_removes(state.sessions, code)
    except HandstudioError as error:
        return "\n\n".join(in_words(error))
    return _in_figures(removal)


def _in_figures(removal: Removal) -> str:
    figures = _(
        "{takes} takes and {binned} in the bin, {minutes:.0f} min, {megabytes:.1f} MB, with notes, "
        "motion and exports."
    ).format(
        takes=removal.takes,
        binned=removal.in_bin,
        minutes=removal.minutes,
        megabytes=removal.bytes / 1e6,
    )
    return f"**{removal.code}**: {figures}\n\n" + _("This cannot be taken back.")
