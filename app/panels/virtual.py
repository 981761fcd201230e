"""Who wears the virtual glove, what that person does, and how bad the sensors are."""

from __future__ import annotations

import viser

from app import intents
from app.panels.base import QUIET, Send, put
from app.words import _
from handstudio.device.addresses import VirtualWearer
from handstudio.simulation.imperfections.strengths import PRESETS
from handstudio.simulation.motions.catalogue import motions
from handstudio.simulation.subject import DEVELOPMENT

_PEOPLE = (0, *DEVELOPMENT[:12])


class VirtualPanel:
    """Shown where the virtual glove is chosen or connected."""

    def __init__(self, gui: viser.GuiApi, send: Send, address: str) -> None:
        wearer = VirtualWearer.of(address) or VirtualWearer()
        people = {_person(number): number for number in _PEOPLE}
        people.setdefault(_person(wearer.subject), wearer.subject)
        self._people, self._send = people, send
        self._person = gui.add_dropdown(
            _("Wearer"),
            tuple(people),
            initial_value=_person(wearer.subject),
            hint=_("The average hand has ideal joints; every person's bones and joints differ"),
        )
        described = tuple(motion.described for motion in motions().values())
        errors = wearer.imperfections
        known = wearer.motion in described
        self._motion = gui.add_dropdown(
            _("Does"), described, initial_value=wearer.motion if known else described[0]
        )
        self._phrase = gui.add_text(
            _("or described"),
            "" if known else wearer.motion,
            hint=_("Motions joined by + or, at the same time, &: open_close+scissors&elbow_moving"),
        )
        self._errors = gui.add_dropdown(
            _("Sensors"),
            tuple(PRESETS),
            initial_value=errors if errors in PRESETS else next(iter(PRESETS)),
            hint=_("How far the sensors, the skin below them and the room are from perfect"),
        )
        self._perform = gui.add_button(
            _("Do this now"), icon=viser.Icon.PLAYER_PLAY, color=QUIET, visible=False
        )
        self._perform.on_click(lambda _event: send(intents.Perform(self.motion)))

    @property
    def motion(self) -> str:
        """The motions asked for."""
        return self._phrase.value.strip() or self._motion.value

    @property
    def address(self) -> str:
        """Of a virtual glove as chosen."""
        person = self._people[self._person.value]
        return VirtualWearer(person, self.motion, self._errors.value).address

    def render(self, *, chosen: bool, connected: bool) -> None:
        """Show what can be chosen: all before, the motion while it is connected."""
        for fixed in (self._person, self._errors):
            put(fixed, visible=chosen, disabled=connected)
        put(self._motion, visible=chosen)
        put(self._phrase, visible=chosen)
        put(self._perform, visible=chosen and connected)


def _person(number: int) -> str:
    return _("Person {number}").format(number=number) if number else _("Average hand")
