"""The transport: where in the take we are, play, pause, speed; back to the live hand."""

from __future__ import annotations

from typing import Any

import viser

from app import intents
from app.panels.base import Send, put
from app.review import SPEEDS
from app.studio import State
from app.view import clock_of
from app.words import _

_STEP_S = 0.01


class TransportPanel:
    """Moves through an opened take; there only while one is open."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._panel = gui.add_panel(visible=False)
        with self._panel.add_tab(_("Replay")):
            self._time = gui.add_slider(_("Time [s]"), 0.0, 1.0, _STEP_S, 0.0)
            self._clock = gui.add_markdown("")
            self._play = gui.add_button(
                _("Play"), icon=viser.Icon.PLAYER_PLAY, hint=_("Key: space")
            )
            labels = tuple(f"{speed:g}x" for speed in SPEEDS)
            self._speed = gui.add_dropdown(_("Speed"), labels, initial_value="1x")
            self._window = gui.add_button_group(
                _("Part"),
                (_("Begin here"), _("End here"), _("Whole")),
                hint=_("The part that is played and exported; keys: I, O, W"),
            )
            self._loop = gui.add_checkbox(_("Loop"), initial_value=False)
            self._live = gui.add_button(_("Back to the live hand"), icon=viser.Icon.HAND_STOP)
        self._panel.float(x=16.0, y=-16.0, width=400.0, height=290.0)
        self._playing = False
        self._written = 0.0
        self._time.on_update(
            lambda event: send(intents.Seek(event.target.value)) if event.client else None
        )
        self._play.on_click(lambda _event: send(intents.TogglePlay()))
        self._live.on_click(lambda _event: send(intents.ShowLive()))
        self._speed.on_update(lambda event: _set_speed(event, send))
        self._loop.on_update(
            lambda event: send(intents.SetLoop(event.target.value)) if event.client else None
        )
        parts: dict[str, intents.Intent] = dict(
            zip(
                self._window.options,
                (intents.MarkIn(), intents.MarkOut(), intents.WholeTake()),
                strict=True,
            )
        )
        self._window.on_click(lambda event: send(parts[event.target.value]))

    def render(self, state: State) -> None:
        """Show where in the take we are."""
        review = state.review
        put(self._panel, visible=review is not None)
        if review is None:
            return
        end = max(review.duration_s, _STEP_S)
        if self._time.max != end:
            self._written = 0.0
            put(self._time, value=0.0)
            put(self._time, max=end)
        # rounded down: a value above the end would be refused by the page
        at = min(int(review.at_s / _STEP_S) * _STEP_S, end)
        # only where the take moved by itself: else a time just typed, whose intent is still on its
        # way, would be overwritten
        if at != self._written:
            self._written = at
            put(self._time, value=at)
        here = f"{clock_of(review.at_s)} / {clock_of(review.duration_s)}"
        if review.in_s > 0.0 or review.out_s is not None:
            here += " · " + _("part {begin} to {end}").format(
                begin=clock_of(review.in_s), end=clock_of(review.end_s)
            )
        put(self._clock, content=here)
        if review.playing != self._playing:
            self._playing = review.playing
            put(self._play, label=_("Pause") if review.playing else _("Play"))
            icon = viser.Icon.PLAYER_PAUSE if review.playing else viser.Icon.PLAYER_PLAY
            self._play.icon = icon
        put(self._speed, value=f"{review.speed:g}x")
        put(self._loop, value=review.loop)


def _set_speed(event: Any, send: Send) -> None:
    if event.client is not None:
        send(intents.SetSpeed(float(event.target.value.removesuffix("x"))))
