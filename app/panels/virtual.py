"""Who wears the virtual glove, what that person does, and how bad the sensors are."""

from __future__ import annotations

import viser

from app import intents
from app.panels.base import QUIET, Send, put
from app.words import _
from handstudio.device.addresses import VirtualWearer
from handstudio.simulation.motions.catalogue import motions
from handstudio.simulation.subject import DEVELOPMENT

_PEOPLE = (0, *DEVELOPMENT[:12])


class VirtualPanel:
    """Shown where the virtual glove is chosen or connected."""

    def __init__(self, gui: viser.GuiApi, send: Send, address: str) -> None:
        self._people = {_person(number): number for number in _PEOPLE}
        self._errors_of = {
            _("plain: noise and bias"): "plain",
            _("ideal"): "ideal",
            _("typical: with skin and room"): "typical",
            _("harsh: a bad day"): "harsh",
        }
        self._motions = tuple(motion.described for motion in motions().values())
        self._shown = ""  # the address these fields were last filled from
        self._person = gui.add_dropdown(
            _("Wearer"),
            tuple(self._people),
            hint=_("The average hand has ideal joints; every person's bones and joints differ"),
        )
        self._motion = gui.add_dropdown(_("Does"), self._motions)
        self._phrase = gui.add_text(
            _("or described"),
            "",
            hint=_("Motions joined by + or, at the same time, &: open_close+scissors&elbow_moving"),
        )
        self._errors = gui.add_dropdown(
            _("Sensors"),
            tuple(self._errors_of),
            hint=_("How far the sensors, the skin below them and the room are from perfect"),
        )
        self._perform = gui.add_button(
            _("Do this now"), icon=viser.Icon.PLAYER_PLAY, color=QUIET, visible=False
        )
        self._perform.on_click(lambda _event: send(intents.Perform(self.motion)))
        self._fill(address)

    @property
    def motion(self) -> str:
        """The motions asked for."""
        return self._phrase.value.strip() or self._motion.value

    @property
    def address(self) -> str:
        """Of a virtual glove as chosen."""
        person = self._people[self._person.value]
        return VirtualWearer(person, self.motion, self._errors_of[self._errors.value]).address

    def render(self, address: str, *, chosen: bool) -> None:
        """Show what can be chosen: all before, the motion while one is connected at an address."""
        if address and address != self._shown:
            self._fill(address)
        connected = bool(address)
        for fixed in (self._person, self._errors):
            put(fixed, visible=chosen, disabled=connected)
        put(self._motion, visible=chosen)
        put(self._phrase, visible=chosen)
        put(self._perform, visible=chosen and connected)

    def _fill(self, address: str) -> None:
        """Show what an address says; somebody may have described it otherwise than by choosing."""
        self._shown = address
        wearer = VirtualWearer.of(address)
        if wearer is None:
            return
        person = _person(wearer.subject)
        self._people.setdefault(person, wearer.subject)
        if wearer.imperfections not in self._errors_of.values():
            self._errors_of[wearer.imperfections] = wearer.imperfections
        errors = next(k for k, v in self._errors_of.items() if v == wearer.imperfections)
        put(self._person, options=tuple(self._people), value=person)
        put(self._errors, options=tuple(self._errors_of), value=errors)
        known = wearer.motion in self._motions
        put(self._motion, value=wearer.motion if known else self._motions[0])
        put(self._phrase, value="" if known else wearer.motion)


def _person(number: int) -> str:
    return _("Person {number}").format(number=number) if number else _("Average hand")
