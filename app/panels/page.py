"""The whole page: status line, way of working on the left, plots, transport, keys."""

from __future__ import annotations

import html
from collections.abc import Callable

import viser
from viser._messages import HotkeyKey

from app import intents, view
from app.panels.base import Send, put
from app.panels.device import DevicePanel
from app.panels.library import LibraryPanel
from app.panels.plots import PlotsPanel
from app.panels.record import RecordButton, RecordPanel
from app.panels.transport import TransportPanel
from app.studio import State
from app.words import _

PLOTS_EVERY = 5  # ticks between two drawings of the plots: about 12 a second
TEXTS_EVERY = 8

_LEFT_PX = 330.0
_NARROW_PX = 1200  # a page this narrow has no room for hand and plots at once


class Page:
    """Everything around the hand."""

    def __init__(self, server: viser.ViserServer, send: Send, state: State) -> None:
        gui = server.gui
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        gui.set_panel_label("handstudio")
        gui.main_panel.dock_left()
        gui.main_panel.set_width(_LEFT_PX)
        self._status = gui.add_html(view.as_html(view.status_of(state)))
        self._caption = gui.add_html("")
        self._work = gui.add_markdown("", visible=False)
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._button = RecordButton(gui, send)
        tabs = gui.add_tab_group()
        with tabs.add_tab(_("Device"), viser.Icon.PLUG_CONNECTED):
            self._device = DevicePanel(gui, send)
        with tabs.add_tab(_("Record"), viser.Icon.PLAYER_RECORD):
            self._record = RecordPanel(gui, send, state)
        with tabs.add_tab(_("Review"), viser.Icon.TIMELINE):
            self._library = LibraryPanel(gui, send)
        self._server = server
        self._plots: dict[int, PlotsPanel] = {}
        self._transport = TransportPanel(gui, send)
        self._tick = 0
        _add_commands(gui, send, self._library)

    def render(self, state: State) -> None:
        """Bring the page up to date; what changes fast more often than what is read."""
        if self._tick % PLOTS_EVERY == 0:
            self._transport.render(state)
            self._render_plots(state)
        if self._tick % TEXTS_EVERY == 0 or state.messages:
            self._render_texts(state)
        self._tick += 1

    def _render_plots(self, state: State) -> None:
        """Every page has plots of its own, so that a narrow one can begin with them put away."""
        clients = self._server.get_clients()
        for gone in self._plots.keys() - clients.keys():
            del self._plots[gone]
        curves = view.curves_of(state)
        for number, client in clients.items():
            if number not in self._plots:
                narrow = client.camera.image_width < _NARROW_PX
                self._plots[number] = PlotsPanel(client.gui, narrow)
            self._plots[number].render(curves)

    def _render_texts(self, state: State) -> None:
        put(self._status, content=view.as_html(view.status_of(state)))
        caption = view.caption_of(state)
        put(self._caption, content=f'<div style="{_CAPTION}">{html.escape(caption)}</div>')
        work = state.work
        put(self._work, visible=work is not None, content=work.words if work else "")
        put(self._bar, visible=work is not None)
        if work is not None:
            put(self._bar, value=100.0 * work.share)
        self._button.render(state)
        self._record.render(state)
        self._library.render(state)
        self._device.render(state)


_CAPTION = "font-size:.8rem;padding:0 .75em .5em;opacity:.75"


def _add_commands(gui: viser.GuiApi, send: Send, library: LibraryPanel) -> None:
    """Keys and palette for what one does twice."""
    commands: tuple[tuple[str, HotkeyKey, intents.Intent], ...] = (
        (_("Record or stop"), "R", intents.ToggleRecording()),
        (_("Play or pause"), "space", intents.TogglePlay()),
        (_("One instant on"), "arrowright", intents.Step(1)),
        (_("One instant back"), "arrowleft", intents.Step(-1)),
        (_("Ten instants on"), "arrowup", intents.Step(10)),
        (_("Ten instants back"), "arrowdown", intents.Step(-10)),
        (_("The part begins here"), "I", intents.MarkIn()),
        (_("The part ends here"), "O", intents.MarkOut()),
        (_("The whole take again"), "W", intents.WholeTake()),
        (_("Back to the live hand"), "L", intents.ShowLive()),
        (_("Turn the forearm away from me"), "F", intents.FaceForward()),
    )
    for label, key, intent in commands:
        gui.add_command(label, hotkey=key).on_trigger(_sending(send, intent))
    export = gui.add_command(_("Export CSV of the open take"), hotkey="E")
    export.on_trigger(library.export)


def _sending(send: Send, intent: intents.Intent) -> Callable[[object], None]:
    return lambda _event: send(intent)
