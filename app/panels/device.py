"""Device: which glove, how it does, which of its sensors is which."""

from __future__ import annotations

import viser

from app import intents
from app.devices.filtering import wanted_of
from app.panels.base import QUIET, Send, put, typed
from app.panels.tracker import TrackerPanel
from app.panels.virtual import VirtualPanel
from app.state import State
from app.views.filters import filter_words, preparing_of
from app.words import _
from handstudio.device.addresses import is_virtual
from handstudio.device.find import VIRTUAL, Found
from handstudio.device.orders import Phase


class DevicePanel:
    """Choose a device and see what it says of itself."""

    def __init__(self, gui: viser.GuiApi, send: Send, state: State) -> None:
        self._send = send
        self._addresses: dict[str, str] = {}
        self._wanted = state.settings.last_address  # to be shown as chosen once it is found
        self._choice = gui.add_dropdown(
            _("Device"), (_("Virtual glove"),), hint=_("Devices that were found")
        )
        self._address = gui.add_text(
            _("or address"),
            self._wanted if self._wanted.startswith(("tcp:", "replay:")) else "",
            hint=_("serial:/dev/ttyACM0, tcp:HOST:PORT or replay:TAKE.mcap"),
        )
        self._virtual = VirtualPanel(gui, send, self._wanted)
        self._connect = gui.add_button(_("Connect"), icon=viser.Icon.PLUG_CONNECTED)
        self._find = gui.add_button(_("Look for devices"), icon=viser.Icon.REFRESH, color=QUIET)
        self._facts = gui.add_markdown("")
        self._blink_choice = gui.add_dropdown(_("Sensor"), ("SN1",), visible=False)
        self._blink = gui.add_button(
            _("Blink this sensor"),
            icon=viser.Icon.BULB,
            color=QUIET,
            hint=_("Its light on the glove blinks for three seconds"),
            visible=False,
        )
        self._words = filter_words()
        self._filter = gui.add_dropdown(
            _("Filter"),
            tuple(self._words.values()),
            initial_value=self._words[wanted_of(state)],
            hint=_("What turns readings into orientations; another one begins anew at a rest"),
        )
        self._preparing = gui.add_markdown("", visible=False)
        self._tracker = TrackerPanel(gui, send, state)
        self._connected = False
        self._connect.on_click(lambda _event: self._toggle())
        self._find.on_click(lambda _event: send(intents.FindDevices()))
        self._blink.on_click(lambda _event: send(intents.BlinkSensor(self._blink_choice.value)))
        names = {words: name for name, words in self._words.items()}
        self._filter.on_update(typed(lambda words: send(intents.SetFilter(names[words]))))

    def render(self, state: State) -> None:
        """Show devices and what the present one says of itself."""
        labels = {_label(found): found.address for found in state.devices}
        if labels != self._addresses:
            self._addresses = labels
            self._choice.options = tuple(labels)
            self._choose_the_last()
        newest = state.newest
        self._connected = newest.phase in (Phase.CONNECTING, Phase.STREAMING, Phase.LOST)
        put(self._connect, label=_("Disconnect") if self._connected else _("Connect"))
        put(self._choice, disabled=self._connected)
        put(self._address, disabled=self._connected)
        worn = newest.address if self._connected and is_virtual(newest.address) else ""
        unheard = not self._connected and not self._address.value.strip()
        chosen = unheard and is_virtual(self._addresses.get(self._choice.value, ""))
        self._virtual.render(worn, chosen=bool(worn) or chosen)
        looking = _("Looking …") if state.searching else _("Look for devices")
        put(self._find, label=looking, disabled=state.searching)
        put(self._filter, value=self._words[wanted_of(state)])
        preparing = preparing_of(state)
        put(self._preparing, visible=bool(preparing), content=preparing)
        self._render_facts(state)
        self._tracker.render(state)

    def _choose_the_last(self) -> None:
        """The device of the time before, where it is there; once, as choosing is the person's."""
        for label, address in self._addresses.items():
            if address == self._wanted or (
                self._wanted.startswith(address) and is_virtual(address)
            ):
                self._wanted = ""
                put(self._choice, value=label)

    def _toggle(self) -> None:
        if self._connected:
            self._send(intents.DisconnectDevice())
            return
        address = self._address.value.strip() or self._addresses.get(self._choice.value, "virtual:")
        if address == VIRTUAL.address:
            address = self._virtual.address
        self._send(intents.ConnectDevice(address))

    def _render_facts(self, state: State) -> None:
        description = state.newest.description
        present = description is not None and state.newest.setup is not None
        put(self._blink_choice, visible=present)
        put(self._blink, visible=present)
        put(self._facts, content=_facts(state))
        if present and state.newest.setup is not None:
            names = state.newest.setup.layout.names
            if self._blink_choice.options != names:
                self._blink_choice.options = names


def _label(found: Found) -> str:
    return _("Virtual glove") if found == VIRTUAL else found.label


def _facts(state: State) -> str:
    newest = state.newest
    description = newest.description
    if description is None:
        return ""
    side = {"left": _("left hand"), "right": _("right hand")}.get(
        description.side, _("side not told")
    )
    rows = [
        (description.name, f"{description.serial_number}, {side}"),
        (_("Firmware"), description.firmware),
        (_("Sensors"), f"{len(description.sensors)} @ {description.rate_hz} Hz"),
    ]
    return "\n".join(["| | |", "|---|---|", *(f"| {key} | {value} |" for key, value in rows)])
