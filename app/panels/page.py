"""The whole page: status line, way of working on the left, plots, transport, keys."""

from __future__ import annotations

import html
from collections.abc import Callable

import viser
from viser._messages import HotkeyKey

from app import intents, sounds
from app.panels.base import QUIET, Send, page_of, put
from app.panels.calibrate import CalibratePanel, CoursePanel
from app.panels.device import DevicePanel
from app.panels.joint import JointSheet
from app.panels.library import LibraryPanel
from app.panels.looks import LooksPanel
from app.panels.plots import PlotsPanel
from app.panels.record import RecordButton, RecordingPanel, RecordPanel, ask_subject
from app.panels.transport import TransportPanel
from app.shown.look import View
from app.state import State
from app.views import health as health_view
from app.views import page as view
from app.words import _

PLOTS_EVERY = 5  # ticks between two drawings of the plots: about 12 a second
TEXTS_EVERY = 8
HEALTH_EVERY = 30

_LEFT_PX = 330.0
_NARROW_PX = 1030
"""A picture this narrow has no room for plots beside it. When a page first tells its width the left
column may be off it or not: 1024 px are narrow, and 1366 px are not, either way."""
_SOUND_TICKS = 90  # a sound is taken away again, or a page opened later would play it


class Page:
    """Everything around the hand, on all pages that are open."""

    def __init__(self, server: viser.ViserServer, send: Send, state: State) -> None:
        gui = server.gui
        self._theme = state.settings.theme
        _set_theme(gui, self._theme)
        gui.set_panel_label("handstudio")
        gui.main_panel.dock_left()
        gui.main_panel.set_width(_LEFT_PX)
        self._status = gui.add_html(view.as_html(view.status_of(state)))
        self._caption = gui.add_html("")
        self._work = gui.add_markdown("", visible=False)
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._cancel = gui.add_button(_("Cancel"), color=QUIET, visible=False)
        self._cancel.on_click(lambda _event: send(intents.CancelWork()))
        self._button = RecordButton(gui, send)
        tabs = gui.add_tab_group()
        with tabs.add_tab(_("Device")):
            self._device = DevicePanel(gui, send, state)
        with tabs.add_tab(_("Calibrate")):
            self._calibrate = CalibratePanel(gui, send)
        with tabs.add_tab(_("Record")):
            self._record = RecordPanel(gui, send, state)
        with tabs.add_tab(_("Review")):
            self._library = LibraryPanel(gui, send)
        self._sound = gui.add_html("")
        self._server = server
        self._send = send
        self._plots: dict[int, PlotsPanel] = {}
        self._transport = TransportPanel(gui, send)
        self._recording = RecordingPanel(gui, send)
        self._course = CoursePanel(gui, send)
        self._joint = JointSheet(gui, send)
        self._looks = LooksPanel(gui, send, state)
        self._tick = 0
        self._silence_at = 0
        _add_commands(gui, send, self._library)

    def render(self, state: State) -> None:
        """Bring the page up to date; what changes fast more often than what is read."""
        if state.settings.theme != self._theme:
            self._theme = state.settings.theme
            _set_theme(self._server.gui, self._theme)
        if self._tick % PLOTS_EVERY == 0:
            self._transport.render(state, reading=self._library.sheet_is_open)
            self._recording.render(state)
            self._course.render(state)
            self._joint.render(state)
            self._render_plots(state)
        if self._tick % TEXTS_EVERY == 0 or state.messages:
            self._render_texts(state)
        self._render_sounds(state)
        self._ask(state)
        self._tick += 1

    def remove(self) -> None:
        """Take everything off all pages, to be made anew."""
        for plots in self._plots.values():
            plots.remove()
        self._plots.clear()
        self._server.gui.reset()

    def _render_plots(self, state: State) -> None:
        """Every page has plots of its own, so that a narrow one can begin with them put away."""
        clients = self._server.get_clients()
        for gone in self._plots.keys() - clients.keys():
            del self._plots[gone]
        curves = view.curves_of(state)
        for number, client in clients.items():
            if number not in self._plots:
                narrow = client.camera.image_width < _NARROW_PX
                self._plots[number] = PlotsPanel(client.gui, self._send, narrow)
                self._plots[number].render_health(health_view.as_html(state))
            self._plots[number].render(curves, dark=state.settings.theme == "dark")
        if self._tick % HEALTH_EVERY == 0:
            health = health_view.as_html(state)
            for plots in self._plots.values():
                plots.render_health(health)

    def _render_texts(self, state: State) -> None:
        put(self._status, content=view.as_html(view.status_of(state)))
        caption = view.caption_of(state)
        put(self._caption, content=f'<div style="{_CAPTION}">{html.escape(caption)}</div>')
        work = state.work
        put(self._work, visible=work is not None, content=work.words if work else "")
        put(self._bar, visible=work is not None)
        put(self._cancel, visible=work is not None)
        if work is not None:
            put(self._bar, value=100.0 * work.share)
        self._button.render(state)
        self._calibrate.render(state)
        self._record.render(state)
        self._library.render(state)
        self._device.render(state)
        self._looks.render(state)

    def _render_sounds(self, state: State) -> None:
        if state.sounds:
            # the number makes the same sound a new one
            self._sound.content = f"<!--{self._tick}-->" + sounds.as_html(state.sounds[-1])
            self._silence_at = self._tick + _SOUND_TICKS
        elif self._tick == self._silence_at:
            put(self._sound, content="")

    def _ask(self, state: State) -> None:
        """Whose hand it is, of the page that wants to record."""
        if state.asking is None:
            return
        clients = self._server.get_clients()
        asked = clients.get(state.asking) or next(iter(clients.values()), None)
        if asked is not None:
            course = state.asking_for
            ask_subject(asked, self._send, state, None, then_record=not course, then_begin=course)


_CAPTION = "font-size:.8rem;padding:0 .75em .5em;opacity:.75"


def _set_theme(gui: viser.GuiApi, theme: str) -> None:
    gui.configure_theme(dark_mode=theme == "dark", show_logo=False, show_share_button=False)


def _add_commands(gui: viser.GuiApi, send: Send, library: LibraryPanel) -> None:
    """Keys and palette for what one does twice."""
    commands: tuple[tuple[str, HotkeyKey | None, intents.Intent], ...] = (
        (_("Mark this moment"), "M", intents.PutMark()),
        (_("On to the next mark"), "K", intents.GoToMark(forward=True)),
        (_("Back to the mark before"), "J", intents.GoToMark(forward=False)),
        (_("One instant on"), "arrowright", intents.Step(1)),
        (_("One instant back"), "arrowleft", intents.Step(-1)),
        (_("Ten instants on"), "arrowup", intents.Step(10)),
        (_("Ten instants back"), "arrowdown", intents.Step(-10)),
        (_("The part begins here"), "I", intents.MarkIn()),
        (_("The part ends here"), "O", intents.MarkOut()),
        (_("The whole take again"), "W", intents.WholeTake()),
        (_("Less time in the plots"), "pageup", intents.ZoomPlots(2.0)),
        (_("More time in the plots"), "pagedown", intents.ZoomPlots(0.5)),
        (_("Plots on in time"), "end", intents.PanPlots(0.5)),
        (_("Plots back in time"), "home", intents.PanPlots(-0.5)),
        (_("The part fills the plots, or the whole take"), "P", intents.FitPlots()),
        (_("Back to the live hand"), "L", intents.ShowLive()),
        (_("Turn the forearm away from me"), "F", intents.FaceForward()),
        (_("Seen from the desk"), "1", intents.SetView(View.DESK)),
        (_("Seen from the palm"), "2", intents.SetView(View.PALM)),
        (_("Seen from the back"), "3", intents.SetView(View.BACK)),
        (_("Seen from the thumb"), "4", intents.SetView(View.THUMB)),
        (_("Follow the hand"), "5", intents.SetView(View.FOLLOW)),
        (_("Show or hide the skin"), "G", intents.ToggleShown("skin")),
        (_("Show or hide bones"), "B", intents.ToggleShown("bones")),
        (_("Show or hide sensors"), "S", intents.ToggleShown("sensors")),
        (_("Show or hide sensor axes"), "X", intents.ToggleShown("axes")),
        (_("Show or hide sensor names"), "N", intents.ToggleShown("labels")),
        (_("Take the heading of all sensors anew"), "H", intents.ResetHeading()),
        (_("Leave the course of calibration"), None, intents.LeaveCourse()),
        (_("Look for devices"), None, intents.FindDevices()),
        (_("Disconnect"), None, intents.DisconnectDevice()),
        (_("Light page"), None, intents.SetTheme(dark=False)),
        (_("Dark page"), None, intents.SetTheme(dark=True)),
    )
    for label, key, intent in commands:
        gui.add_command(label, hotkey=key).on_trigger(_sending(send, intent))
    record = gui.add_command(_("Record or stop"), hotkey="R")
    record.on_trigger(lambda event: send(intents.ToggleRecording(page_of(event))))
    go_on = gui.add_command(_("Go on: record or stop, play or pause"), hotkey="space")
    go_on.on_trigger(lambda event: send(intents.GoOn(page_of(event))))
    undo = gui.add_command(_("Undo"), hotkey="Z", modifier="cmd/ctrl")
    undo.on_trigger(_sending(send, intents.Undo()))
    to_bin = gui.add_command(_("Move the chosen take to the bin"), hotkey="delete")
    to_bin.on_trigger(lambda _event: library.bin())
    export = gui.add_command(_("Export the open take"), hotkey="E")
    export.on_trigger(library.export)
    diagnostics = gui.add_command(_("Diagnostics"))
    diagnostics.on_trigger(lambda event: send(intents.SendDiagnostics(page_of(event))))


def _sending(send: Send, intent: intents.Intent) -> Callable[[object], None]:
    return lambda _event: send(intent)
