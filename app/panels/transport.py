"""The transport: where in the take we are, play, pause, speed; back to the live hand."""

from __future__ import annotations

from typing import Any

import viser

from app import intents
from app.panels.base import QUIET, Send, put, typed
from app.shown.review import SPEEDS, Review
from app.state import State
from app.views import timeline
from app.views.course import sheet_of
from app.views.joint import sheet_is_open
from app.views.recording import clock_of
from app.views.written import grasp_words, trace_picture
from app.words import _

WIDTH_PX = 370.0
"""So wide, and it stands beside plots and the way of working on a page of 1024 pixels."""

_STEP_S = 0.01


class TransportPanel:
    """Moves through an opened take; there while one is open and no sheet is in its place."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._panel = gui.add_panel(visible=False)
        with self._panel.add_tab(_("Replay"), viser.Icon.TIMELINE):
            self._overlay = gui.add_html("")
            self._strip = gui.add_html("")
            self._below = gui.add_html("")
            self._written_page = gui.add_html("", visible=False)
            self._time = gui.add_slider(_("Time [s]"), 0.0, 1.0, _STEP_S, 0.0)
            self._clock = gui.add_markdown("")
            self._moves = gui.add_button_group(
                _("Move"),
                ("−10", "−1", _("Play"), "+1", "+10"),
                hint=_("Instants back and on: arrow keys; play: space"),
            )
            labels = tuple(f"{speed:g}x" for speed in SPEEDS)
            self._speed = gui.add_dropdown(_("Speed"), labels, initial_value="1x")
            self._window = gui.add_button_group(
                _("Part"),
                (_("Begin here"), _("End here"), _("Whole")),
                hint=_("The part that is played and exported; keys: I, O, W"),
            )
            self._zoom = gui.add_button_group(
                _("Plots"),
                ("−", "+", "◀", "▶", _("Fit")),
                hint=_("More or less time, back and on, all; keys: page up and down, home, end, P"),
            )
            self._marks = gui.add_button_group(
                _("Marks"),
                (_("Before"), _("Mark here"), _("Next")),
                hint=_("Keys: J, M, K"),
            )
            self._loop = gui.add_checkbox(_("Loop"), initial_value=False)
            self._live = gui.add_button(
                _("Back to the live hand"), icon=viser.Icon.HAND_STOP, color=QUIET
            )
        self._panel.float(x=12.0, y=-12.0, width=WIDTH_PX, height=404.0)
        self._drawn: object = None
        self._playing = False
        self._written = 0.0
        self._time.on_update(typed(lambda at_s: send(intents.Seek(at_s))))
        self._moves.on_click(lambda event: self._moved(event, send))
        self._live.on_click(lambda _event: send(intents.ShowLive()))
        self._speed.on_update(typed(lambda text: send(intents.SetSpeed(float(text.rstrip("x"))))))
        self._loop.on_update(typed(lambda on: send(intents.SetLoop(on))))
        _on_choice(self._window, send, (intents.MarkIn(), intents.MarkOut(), intents.WholeTake()))
        _on_choice(
            self._zoom,
            send,
            (
                *(intents.ZoomPlots(factor) for factor in (0.5, 2.0)),
                *(intents.PanPlots(share) for share in (-0.5, 0.5)),
                intents.FitPlots(),
            ),
        )
        _on_choice(
            self._marks,
            send,
            (
                intents.GoToMark(forward=False),
                intents.PutMark(),
                intents.GoToMark(forward=True),
            ),
        )

    def render(self, state: State, *, reading: bool) -> None:
        """Show where in the take we are; ``reading``: a sheet of the page's own is in its place."""
        review = state.review
        covered = reading or sheet_is_open(state) or sheet_of(state) is not None
        put(self._panel, visible=review is not None and not covered)
        if review is None:
            return
        self._render_time(review)
        put(self._overlay, content=timeline.overlay(review))
        drawn = timeline.drawn_from(review)
        if drawn != self._drawn:
            self._drawn = drawn
            put(self._strip, content=timeline.strip(review))
        put(self._below, content=timeline.below(review))
        picture = trace_picture(review)
        put(self._written_page, content=picture, visible=bool(picture))
        put(self._clock, content=_here(review))
        if review.playing != self._playing:
            self._playing = review.playing
            middle = _("Pause") if review.playing else _("Play")
            self._moves.options = ("−10", "−1", middle, "+1", "+10")
        put(self._speed, value=f"{review.speed:g}x")
        put(self._loop, value=review.loop)

    def _render_time(self, review: Review) -> None:
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

    def _moved(self, event: Any, send: Send) -> None:
        steps = {"−10": -10, "−1": -1, "+1": 1, "+10": 10}
        instants = steps.get(event.target.value)
        send(intents.TogglePlay() if instants is None else intents.Step(instants))


def _here(review: Review) -> str:
    here = f"**{clock_of(review.at_s)}** / {clock_of(review.duration_s)}"
    if review.in_s > 0.0 or review.out_s is not None:
        here += " · " + _("part {begin} to {end}").format(
            begin=clock_of(review.in_s), end=clock_of(review.end_s)
        )
    grasp = None if review.found is None else review.found.grasp_at(review.at_s)
    return here if grasp is None else f"{here} · {grasp_words(grasp)}"


def _on_choice(
    group: viser.GuiButtonGroupHandle, send: Send, choices: tuple[intents.Intent, ...]
) -> None:
    by_words = dict(zip(group.options, choices, strict=True))
    group.on_click(lambda event: send(by_words[event.target.value]))
