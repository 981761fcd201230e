"""Measures of the open take: against what is usual and an earlier visit, and a report of them."""

from __future__ import annotations

from pathlib import Path

import viser

from app import intents
from app.panels.base import QUIET, Send, page_of, put, typed
from app.state import State
from app.views import measures as view
from app.words import _
from handstudio.measure import Measured


class MeasuresFolder:
    """Measure, look, and take a report along."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._folder = gui.add_folder(_("Measures and report"), visible=False)
        with self._folder:
            self._earlier = gui.add_dropdown(
                _("Earlier visit"),
                (view.none_words(),),
                hint=_("A take of the same hand to compare with"),
            )
            self._other = gui.add_dropdown(
                _("Other hand"),
                (view.none_words(),),
                hint=_("A take of the other hand: ranges and scores as shares of its"),
            )
            self._own = _OwnPostures(gui, send)
            self._measure = gui.add_button(
                _("Measure this part"), icon=viser.Icon.RULER_MEASURE, color=QUIET
            )
            self._short = gui.add_html("")
            self._all = gui.add_button(
                _("All measures"), icon=viser.Icon.TABLE, color=QUIET, visible=False
            )
            self._report = gui.add_button(
                _("Report"),
                icon=viser.Icon.REPORT,
                hint=_("One page with measures, plots, a replay and the calibration, offline"),
            )
        self._sheet = gui.add_panel(visible=False)
        with self._sheet.add_tab(_("Measures"), viser.Icon.RULER_MEASURE):
            self._full = gui.add_html("")
            self._close = gui.add_button(_("Close"), color=QUIET)
        # below the corner of the picture's menu, and no wider than what a page of 1024 px leaves
        self._sheet.float(x=350.0, y=56.0, width=630.0, height=640.0)
        self._takes: dict[str, Path] = {}
        self._others: dict[str, Path] = {}
        self._shown: Measured | None = None
        self._earlier.on_update(
            typed(lambda words: send(intents.CompareVisits(self._takes.get(words))))
        )
        self._other.on_update(
            typed(lambda words: send(intents.CompareSides(self._others.get(words))))
        )
        self._measure.on_click(lambda _event: send(intents.MeasureHand()))
        self._all.on_click(lambda _event: self._show_all())
        self._close.on_click(lambda _event: put(self._sheet, visible=False))
        self._report.on_click(lambda event: send(intents.MakeReport(page_of(event))))

    @property
    def sheet_is_open(self) -> bool:
        """Whether all measures are read now."""
        return self._sheet.visible

    def render(self, state: State) -> None:
        """Show what was measured."""
        review = state.review
        put(self._folder, visible=review is not None)
        if review is None or review.measured is None:
            put(self._sheet, visible=False)
        if review is None:
            return
        self._takes, self._others = view.earlier_takes(state), view.other_hand(state)
        _offer(self._earlier, self._takes, review.earlier)
        _offer(self._other, self._others, review.other_side)
        put(self._other, visible=bool(self._others))
        self._own.render(state)
        if review.measured is not self._shown:
            self._shown = review.measured
            put(self._sheet, visible=False)
        put(self._short, content=view.short_html(review))
        put(self._all, visible=review.measured is not None)

    def _show_all(self) -> None:
        if self._shown is not None:
            put(self._full, content=view.full_html(self._shown))
            put(self._sheet, visible=True)


class _OwnPostures:
    """Postures whose time is counted besides that of the usual ones."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._angles: dict[str, str] = {}  # names by words
        self._names: dict[str, str] = {}
        with gui.add_folder(_("Postures of your own"), expand_by_default=False):
            self._angle = gui.add_dropdown(
                _("Angle"), ("",), hint=_("The time is counted in which it lies between two ends")
            )
            self._above = gui.add_text(_("From [°]"), "", hint=_("Empty: no end on this side"))
            self._below = gui.add_text(_("To [°]"), "", hint=_("Empty: no end on this side"))
            self._name = gui.add_text(
                _("Called"), "", hint=_("Empty: called by its angle and its ends")
            )
            add = gui.add_button(_("Add the posture"), icon=viser.Icon.PLUS, color=QUIET)
            self._kept = gui.add_dropdown(_("Added"), ("",), visible=False)
            self._remove = gui.add_button(
                _("Remove it"), icon=viser.Icon.TRASH, color=QUIET, visible=False
            )
        add.on_click(lambda _event: self._add())
        self._remove.on_click(
            lambda _event: send(intents.RemovePosture(self._names[self._kept.value]))
        )

    def render(self, state: State) -> None:
        """Show what can be chosen, and what was added."""
        if state.review is None:
            return
        angles = view.angle_choices(state.review.setup.layout)
        if angles != self._angles and angles:
            self._angles, self._angle.options = angles, tuple(angles)
        names = view.own_postures(state.settings.postures)
        if names != self._names and names:
            self._kept.options = tuple(names)
        self._names = names
        put(self._kept, visible=bool(names))
        put(self._remove, visible=bool(names))

    def _add(self) -> None:
        words, above, below = self._angle.value, self._above.value, self._below.value
        name = self._name.value.strip() or view.named_by_ends(words, above, below)
        self._send(intents.AddPosture(name, self._angles.get(words, ""), above, below))


def _offer(
    choice: viser.GuiDropdownHandle[str], takes: dict[str, Path], chosen: Path | None
) -> None:
    options = (view.none_words(), *takes)
    if choice.options != options:
        choice.options = options
    words = [words for words, path in takes.items() if path == chosen]
    put(choice, value=words[0] if words else view.none_words())
