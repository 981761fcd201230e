"""A tracker on hand or forearm: which one, where it sits, and how it does."""

from __future__ import annotations

import viser

from app import intents
from app.panels.base import QUIET, Send, put, typed
from app.state import State
from app.views.tracker import tracker_words
from app.words import _

_NOBODY = ""


class TrackerPanel:
    """Choose a tracker and see whether the hand stands in its room."""

    def __init__(self, gui: viser.GuiApi, send: Send, state: State) -> None:
        self._send = send
        self._sources = _sources(state)
        with gui.add_folder(_("Tracker"), expand_by_default=bool(state.settings.tracker)):
            self._source = gui.add_dropdown(
                _("Tracker"),
                tuple(self._sources),
                hint=_("What sees where hand or forearm is, streamed by the Lab Streaming Layer"),
            )
            self._terminals: dict[str, str] = {}
            self._terminal = gui.add_dropdown(_("Terminal"), ("",), visible=False)
            self._sensors = {_("found from the motion"): ""}
            self._sensor = gui.add_dropdown(
                _("Sits on"),
                tuple(self._sensors),
                visible=False,
                hint=_("The sensor of the glove that its terminal is fixed to"),
            )
            self._find = gui.add_button(
                _("Look for trackers"), icon=viser.Icon.REFRESH, color=QUIET
            )
            self._state = gui.add_markdown("", visible=False)
        self._find.on_click(lambda _event: send(intents.FindTrackers()))
        self._source.on_update(typed(self._choose_source))
        self._terminal.on_update(typed(lambda _words: self._choose()))
        self._sensor.on_update(typed(lambda _words: self._choose()))

    def render(self, state: State) -> None:
        """Show what can be chosen, what is, and how it does."""
        settings, now = state.settings, state.tracker.now
        sources = _sources(state)
        if sources != self._sources:
            self._sources = sources
            self._source.options = tuple(sources)
        put(self._source, value=_of(sources, settings.tracker))
        chosen = bool(settings.tracker)
        names = () if now is None else now.tracker.terminals
        terminals = {name: name for name in names} or {"": ""}
        if terminals != self._terminals:
            self._terminals = terminals
            self._terminal.options = tuple(terminals)
        several = len(names) > 1
        wanted = settings.tracker_terminal if settings.tracker_terminal in terminals else None
        put(self._terminal, visible=chosen and several)
        if wanted is not None:
            put(self._terminal, value=wanted)
        setup = state.newest.setup
        known = () if setup is None else setup.layout.names
        known = known or tuple(filter(None, [settings.tracker_sensor]))
        sensors = {_("found from the motion"): "", **{name: name for name in known}}
        if sensors != self._sensors:
            self._sensors = sensors
            self._sensor.options = tuple(sensors)
        put(self._sensor, visible=chosen, value=_of(sensors, settings.tracker_sensor))
        looking = state.tracker.searching
        put(
            self._find,
            label=_("Looking …") if looking else _("Look for trackers"),
            disabled=looking,
        )
        words = tracker_words(state)
        put(self._state, visible=bool(words), content=words)

    def _choose_source(self, words: str) -> None:
        self._send(intents.ChooseTracker(self._sources[words]))

    def _choose(self) -> None:
        self._send(
            intents.ChooseTracker(
                self._sources[self._source.value],
                self._terminals.get(self._terminal.value, _NOBODY),
                self._sensors.get(self._sensor.value, _NOBODY),
            )
        )


def _sources(state: State) -> dict[str, str]:
    """What can be chosen, in words, and how it is called."""
    sources = {
        _("none"): "",
        _("Virtual, on the hand"): "virtual:hand",
        _("Virtual, on the forearm"): "virtual:forearm",
    }
    named = {f"lsl:{name}" for name in state.tracker.streams} | {state.settings.tracker}
    return sources | {
        name.removeprefix("lsl:"): name for name in sorted(named) if name.startswith("lsl:")
    }


def _of(words: dict[str, str], value: str) -> str:
    return next((word for word, each in words.items() if each == value), next(iter(words)))
