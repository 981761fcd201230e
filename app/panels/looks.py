"""View and settings: from where the hand is seen, what of it, and how the page is."""

from __future__ import annotations

from typing import Any

import viser

from app import intents
from app.panels.base import QUIET, Send, page_of, put, typed
from app.shown.look import View
from app.state import State
from app.words import LANGUAGES, _


class LooksPanel:
    """A small menu in the corner of the picture."""

    def __init__(self, gui: viser.GuiApi, send: Send, state: State) -> None:
        self._panel = gui.add_panel()
        with self._panel.add_tab(_("View"), viser.Icon.EYE):
            words = {
                _("Desk"): View.DESK,
                _("Palm"): View.PALM,
                _("Back"): View.BACK,
                _("Thumb"): View.THUMB,
                _("Follow"): View.FOLLOW,
            }
            self._views = gui.add_dropdown(
                _("Seen from"), tuple(words), hint=_("Keys: 1 to 5; F turns the forearm away")
            )
            shown = state.settings.shown
            self._shown = {
                part: gui.add_checkbox(label, getattr(shown, part), hint=hint)
                for part, label, hint in (
                    ("skin", _("Skin"), _("Key: G; the bones are seen through it")),
                    ("bones", _("Bones"), _("Key: B")),
                    ("sensors", _("Sensors"), _("Key: S; shake one and it lights up")),
                    ("axes", _("Sensor axes"), _("Key: X; red x, green y, blue z")),
                    ("labels", _("Sensor names"), _("Key: N")),
                    (
                        "room",
                        _("In the room"),
                        _("Where a tracker saw it; else at its elbow"),
                    ),
                )
            }
        with self._panel.add_tab(_("Settings"), viser.Icon.SETTINGS):
            self._languages = {_("As the browser"): "", **{v: k for k, v in LANGUAGES.items()}}
            self._language = gui.add_dropdown(_("Language"), tuple(self._languages))
            self._light = gui.add_checkbox(_("Light page"), state.settings.theme == "light")
            self._diagnostics = gui.add_button(
                _("Diagnostics"),
                icon=viser.Icon.FILE_ZIP,
                color=QUIET,
                hint=_("A file for whoever helps; nothing of the people recorded is in it"),
            )
        self._panel.float(x=-16.0, y=16.0, width=236.0, height=312.0)
        self._panel.minimize()
        self._words = {view: label for label, view in words.items()}
        self._views.on_update(typed(lambda label: send(intents.SetView(words[label]))))
        for part, box in self._shown.items():
            box.on_update(_showing(part, send))
        self._language.on_update(
            typed(lambda label: send(intents.SetLanguage(self._languages[label])))
        )
        self._light.on_update(typed(lambda on: send(intents.SetTheme(dark=not on))))
        self._diagnostics.on_click(lambda event: send(intents.SendDiagnostics(page_of(event))))

    def render(self, state: State) -> None:
        """Show what was chosen, by whatever way."""
        put(self._views, value=self._words[state.view])
        for part, box in self._shown.items():
            put(box, value=getattr(state.settings.shown, part))
        room = state.review is not None and state.review.way is not None
        put(self._shown["room"], visible=room)
        put(self._light, value=state.settings.theme == "light")
        by_tag = {tag: label for label, tag in self._languages.items()}
        put(self._language, value=by_tag.get(state.settings.language, by_tag[""]))


def _showing(part: str, send: Send) -> Any:
    return typed(lambda on: send(intents.SetShown(part, on)))
