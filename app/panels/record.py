"""Record: the biggest button in reach, whose hand it is, what the take is called."""

from __future__ import annotations

import viser

from app import intents
from app.panels.base import QUIET, Send, page_of, put, typed
from app.state import HAND_LENGTH_MM, State
from app.views import recording as recording_view
from app.words import _
from handstudio.recording.subjects import Subject

RED = (200, 52, 52)


class RecordButton:
    """Start and stop takes, in reach whatever else is open."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._button = gui.add_button(
            _("Record"), icon=viser.Icon.PLAYER_RECORD, color=RED, hint=_("Key: R, or space")
        )
        self._button.on_click(lambda event: send(intents.ToggleRecording(page_of(event))))

    def render(self, state: State) -> None:
        """Show whether a take is on."""
        newest = state.newest
        recording, counting = newest.recorder is not None, state.countdown is not None
        ready = recording or counting or state.can_record
        label = _("Stop") if recording else _("Call it off") if counting else _("Record")
        icon = viser.Icon.PLAYER_STOP if recording else viser.Icon.PLAYER_RECORD
        if self._button.label != label:
            self._button.icon = icon
        put(self._button, label=label, disabled=not ready)


class RecordingPanel:
    """The sheet that is read from two metres away; there only while a take is on."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._panel = gui.add_panel(visible=False)
        with self._panel.add_tab(_("Recording"), viser.Icon.PLAYER_RECORD):
            self._sheet = gui.add_html("")
            self._buttons = gui.add_button_group(
                _("Take"), (_("Mark"), _("Stop")), hint=_("Keys: M, R")
            )
        self._panel.float(x=16.0, y=-16.0, width=480.0, height=156.0)
        mark = self._buttons.options[0]
        self._buttons.on_click(
            lambda event: send(
                intents.PutMark()
                if event.target.value == mark
                else intents.ToggleRecording(page_of(event))
            )
        )

    def render(self, state: State) -> None:
        """Show the count before a take, or how it stands."""
        sheet = recording_view.sheet_of(state)
        put(self._panel, visible=bool(sheet))
        # before a take there is nothing to mark
        put(self._buttons, visible=state.countdown is None)
        if sheet:
            put(self._sheet, content=sheet)


class RecordPanel:
    """Whose hand it is, which visit, what the next take is called."""

    def __init__(self, gui: viser.GuiApi, send: Send, state: State) -> None:
        self._send = send
        self._state = state
        self._nobody = _("Nobody yet")
        self._subject = gui.add_dropdown(_("Subject"), (self._nobody,))
        self._facts = gui.add_markdown("")
        self._edit = gui.add_button_group(_("Details"), (_("New"), _("Change")))
        settings = state.settings
        self._visit = gui.add_text(
            _("Visit"), settings.visit, hint=_("Empty: the day it is recorded")
        )
        self._name = gui.add_text(_("Take name"), settings.take_name)
        self._countdown = gui.add_number(
            _("Countdown [s]"), int(settings.countdown_s), min=0, max=30, step=1
        )
        self._sounds = gui.add_checkbox(
            _("Sounds"), settings.sounds, hint=_("Count, start, stop, marks and alarms are heard")
        )
        self._note = gui.add_markdown("")
        new = self._edit.options[0]
        self._subject.on_update(typed(self._chosen))
        self._edit.on_click(lambda event: self._ask(event.client, new=event.target.value == new))
        self._visit.on_update(typed(lambda text: send(intents.SetVisit(text))))
        self._name.on_update(typed(lambda text: send(intents.SetTakeName(text))))
        self._countdown.on_update(typed(lambda count: send(intents.SetCountdown(int(count)))))
        self._sounds.on_update(typed(lambda on: send(intents.SetSounds(on))))

    def render(self, state: State) -> None:
        """What a take was begun with stays as it is until it ends."""
        self._state = state
        busy = state.newest.recorder is not None or state.countdown is not None
        codes = tuple(subject.code for subject in state.shelf.subjects) or (self._nobody,)
        chosen = state.subject.code if state.subject is not None else self._nobody
        options = codes if chosen in codes else (self._nobody, *codes)
        if self._subject.options != options:
            self._subject.options = options
        put(self._subject, value=chosen)
        for field in (self._subject, self._visit, self._name, self._countdown):
            put(field, disabled=busy)
        put(self._edit, visible=not busy)
        put(self._facts, content=_subject_words(state.subject))
        trust = recording_view.trust_of(state)
        lines = [
            _("Trust: {word}").format(word=trust.word),
            trust.why,
            recording_view.disk_of(state),
            _("Takes go to {folder}").format(folder=state.sessions),
        ]
        put(self._note, content="\n\n".join(filter(None, lines)))

    def _chosen(self, code: str) -> None:
        if code != self._nobody:
            self._send(intents.ChooseSubject(code))

    def _ask(self, client: viser.ClientHandle | None, *, new: bool) -> None:
        if client is not None:
            subject = None if new else self._state.subject
            ask_subject(client, self._send, self._state, subject, then_record=False)


def ask_subject(
    client: viser.ClientHandle,
    send: Send,
    state: State,
    subject: Subject | None,
    *,
    then_record: bool,
    then_begin: str = "",
) -> None:
    """A sheet for one page: whose hand it is."""
    gui = client.gui
    modal = gui.add_modal(_("Whose hand is it?") if subject is None else subject.code)
    with modal:
        gui.add_markdown(_("A code is enough; no name is needed."))
        code = gui.add_text(_("Code"), _next_code(state) if subject is None else subject.code)
        code.disabled = subject is not None
        sides = {"right": _("right hand"), "left": _("left hand")}
        known = (subject.side if subject else "") or _side_of_device(state)
        side = gui.add_dropdown(_("Which hand"), tuple(sides.values()), initial_value=sides[known])
        shortest, longest = HAND_LENGTH_MM
        measured = subject.hand_length_mm if subject is not None else None
        length = gui.add_number(
            _("Hand length [mm]"),
            round(state.settings.hand_length_mm if measured is None else measured),
            min=round(shortest),
            max=round(longest),
            step=1,
            hint=_("From the wrist crease to the tip of the middle finger"),
        )
        save = gui.add_button(
            _("Save and record")
            if then_record
            else _("Save and begin")
            if then_begin
            else _("Save"),
            icon=viser.Icon.CHECK,
            color=RED if then_record else None,
        )
        leave = gui.add_button(_("Cancel"), color=QUIET)

    def saved(_event: object) -> None:
        chosen = next(name for name, words in sides.items() if words == side.value)
        send(intents.SaveSubject(code.value, chosen, float(length.value), then_record, then_begin))
        modal.close()

    save.on_click(saved)
    leave.on_click(lambda _event: modal.close())


def _next_code(state: State) -> str:
    taken = {subject.code.lower() for subject in state.shelf.subjects}
    return next(code for n in range(1, 10_000) if (code := f"S{n:02d}").lower() not in taken)


def _side_of_device(state: State) -> str:
    description = state.newest.description
    told = description.side if description is not None else ""
    return told if told in ("left", "right") else state.settings.side


def _subject_words(subject: Subject | None) -> str:
    if subject is None:
        return _("You are asked before the first take.")
    side = {"left": _("left hand"), "right": _("right hand")}.get(subject.side, "")
    length = "" if subject.hand_length_mm is None else f"{subject.hand_length_mm:.0f} mm"
    return " · ".join(filter(None, [side, length])) or _("Side and length are not known.")
