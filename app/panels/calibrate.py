"""Calibrate: which courses there are and where they stand, the sheet of a step, heading."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, TypeAlias

import viser

from app import intents
from app.panels.base import QUIET, Send, page_of, put, typed
from app.panels.joint import JointFolder
from app.shown.guided import Stand
from app.state import State
from app.views import calibration as calibration_view
from app.views import course as view
from app.views.steps import course_name
from app.words import _
from handstudio.calibration.course import COURSES
from handstudio.device.orders import Phase
from handstudio.hand.skeleton import HandType
from handstudio.wizards.course import GoByItself

Which: TypeAlias = Literal["none", "again", "previous"]

_SHEET_PX = (660.0, 392.0)
_RESULT_PX = (660.0, 640.0)


class CalibratePanel:
    """The courses towards a hand that can be trusted; while one is on, its steps."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._list = gui.add_html("", visible=False)
        self._steps: dict[str, int] = {}
        self._picked: int | None = None  # by a person, until it is done again
        self._step = gui.add_dropdown(_("Step"), ("",), visible=False)
        self._redo = gui.add_button(
            _("Do this step again"), icon=viser.Icon.REPEAT, color=QUIET, visible=False
        )
        self._by_itself = gui.add_checkbox(
            _("Go on by itself"),
            initial_value=False,
            hint=_("Steps begin and follow one another without the space bar"),
            visible=False,
        )
        self._sheet = gui.add_html("")
        names = sorted(COURSES, key=_ORDER.index) if set(COURSES) <= set(_ORDER) else list(COURSES)
        self._rows = {name: _CourseRow(gui, send, name) for name in names}
        self._none = gui.add_button(_("Use no calibration"), color=QUIET, visible=False)
        self._again = gui.add_button(_("Use the calibration again"), color=QUIET, visible=False)
        self._previous = gui.add_button(_("Use the calibration before"), color=QUIET, visible=False)
        for which, handle in self._uses().items():
            handle.on_click(_using(send, which))
        with gui.add_folder(_("Heading"), expand_by_default=False):
            self._all = _("All sensors")
            self._which = gui.add_dropdown(_("Sensor"), (self._all,))
            self._reset = gui.add_button(
                _("Take the heading anew"),
                icon=viser.Icon.COMPASS,
                color=QUIET,
                hint=_("As the hand lies now, forearm ahead; key: H, all sensors"),
            )
        self._joint = JointFolder(gui, send)
        self._step.on_update(typed(self._pick))
        self._redo.on_click(lambda _event: self._say_redo(send))
        self._by_itself.on_update(typed(lambda on: send(intents.Guide(GoByItself(on)))))
        self._reset.on_click(lambda _event: send(intents.ResetHeading(self._sensor())))

    def render(self, state: State) -> None:
        """Show where each course stands, or each step of the one that is on."""
        guided = state.guided
        on = guided is not None
        for handle in (self._list, self._step, self._redo, self._by_itself):
            put(handle, visible=on)
        put(self._sheet, visible=not on)
        if guided is None:
            self._picked = None
            steps = calibration_view.steps_of(state)
            put(self._sheet, content=calibration_view.as_html(steps))
        else:
            put(self._list, content=view.list_of(guided.course))
            put(self._by_itself, value=guided.course.by_itself)
            self._render_steps(view.step_choices(guided.course), guided.course.index)
        stands = {stand.name: stand for stand in view.stands_of(state)}
        for name, row in self._rows.items():
            row.render(None if on else stands.get(name), state)
        in_use = state.in_use
        put(self._none, visible=not on and in_use.subject is not None)
        put(self._again, visible=not on and in_use.none)
        put(self._previous, visible=not on and bool(in_use.older) and not in_use.none)
        setup = state.newest.setup
        sensors = (self._all, *(setup.layout.names if setup is not None else ()))
        put(self._which, options=sensors)
        put(self._reset, disabled=state.newest.phase is not Phase.STREAMING)
        self._joint.render(state)

    def _render_steps(self, choices: dict[str, int], index: int) -> None:
        """Follow the course; what somebody picked stays theirs while it goes on by itself."""
        if choices != self._steps:
            self._steps = choices
            self._step.options = tuple(choices)
        put(self._step, value=list(choices)[index if self._picked is None else self._picked])

    def _pick(self, label: str) -> None:
        self._picked = self._steps.get(label, self._picked)

    def _say_redo(self, send: Send) -> None:
        send(intents.RedoStep(self._steps.get(self._step.value, -1)))
        self._picked = None

    def _uses(self) -> dict[Which, viser.GuiButtonHandle]:
        return {"none": self._none, "again": self._again, "previous": self._previous}

    def _sensor(self) -> str | None:
        return None if self._which.value == self._all else self._which.value


def _using(send: Send, which: Which) -> Callable[[Any], None]:
    return lambda _event: send(intents.UseCalibration(which))


def _palms() -> dict[str, HandType]:
    return {
        _("Ulnar block hinged to the radial one"): 3,
        _("Two blocks from the wrist"): 2,
        _("One block"): 1,
    }


def _palm(hand_type: HandType) -> str:
    return next(words for words, each in _palms().items() if each == hand_type)


_ORDER = ("hand", "check", "quick_start", "sensors", "noise")


class _PalmField:
    """How the calibration of the hand divides the palm, where the glove leaves a choice."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._choice = gui.add_dropdown(
            _("Palm blocks"),
            tuple(_palms()),
            hint=_("How the calibration divides the palm: hand types 3, 2 and 1"),
        )
        self._choice.on_update(typed(lambda palm: send(intents.SetHandType(_palms()[palm]))))

    def render(self, state: State, *, begins: bool) -> None:
        """There before the course begins."""
        put(self._choice, visible=begins and view.palm_is_chosen(state))
        put(self._choice, value=_palm(state.settings.hand_type))


class _CourseRow:
    """One course: what it is for, and the buttons to begin it or go on."""

    def __init__(self, gui: viser.GuiApi, send: Send, name: str) -> None:
        self._name = name
        self._words = gui.add_html("")
        self._palm = _PalmField(gui, send) if name == "hand" else None
        self._begin = gui.add_button(course_name(name), icon=viser.Icon.PLAYER_PLAY, color=QUIET)
        self._anew = gui.add_button(_("Begin anew"), color=QUIET, visible=False)
        self._begin.on_click(self._beginning(send, anew=False))
        self._anew.on_click(self._beginning(send, anew=True))

    def render(self, stand: Stand | None, state: State) -> None:
        """Show where it stands; None: it is not to be begun now."""
        ready = _ready(state)
        if self._palm is not None:
            self._palm.render(state, begins=stand is not None)
        for handle in (self._words, self._begin):
            put(handle, visible=stand is not None)
        left = stand is not None and stand.settled > 0
        put(self._anew, visible=left, disabled=not ready)
        if stand is not None:
            put(self._words, content=view.stand_of(stand))
            words = _("Go on: {course}") if left else _("Begin: {course}")
            put(
                self._begin,
                label=words.format(course=course_name(self._name)),
                disabled=not ready,
            )

    def _beginning(self, send: Send, *, anew: bool) -> Callable[[Any], None]:
        return lambda event: send(intents.BeginCourse(self._name, anew, page_of(event)))


class CoursePanel:
    """The sheet that is read from two metres away: a step of the course, or what came of it."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._panel = gui.add_panel(visible=False)
        with self._panel.add_tab(_("Calibrate"), viser.Icon.HAND_CLICK):
            self._sheet = gui.add_html("")
            self._first = gui.add_button(" ", hint=_("Key: space"))
            self._others = gui.add_button_group(" ", (" ",))
        self._shown: view.Sheet = view.Sheet("")
        self._large = False
        self._place(large=False)
        self._first.on_click(lambda _event: self._say_first())
        self._others.on_click(lambda event: self._say_other(event.target.value))

    def render(self, state: State) -> None:
        """Show the step, or what came of the course."""
        sheet = view.sheet_of(state)
        put(self._panel, visible=sheet is not None)
        if sheet is None:
            return
        self._shown = sheet
        large = state.result is not None and state.result.answer is not None
        if large != self._large:
            self._large = large
            self._place(large=large)
        put(self._sheet, content=sheet.content)
        put(self._first, visible=sheet.first is not None)
        if sheet.first is not None:
            put(self._first, label=sheet.first[0])
        labels = tuple(label for label, _intent in sheet.others)
        put(self._others, visible=bool(labels))
        if labels and tuple(self._others.options) != labels:
            self._others.options = labels

    def _place(self, *, large: bool) -> None:
        width, height = _RESULT_PX if large else _SHEET_PX
        self._panel.float(x=16.0, y=-16.0, width=width, height=height)

    def _say_first(self) -> None:
        if self._shown.first is not None:
            self._send(self._shown.first[1])

    def _say_other(self, label: str) -> None:
        for words, intent in self._shown.others:
            if words == label:
                self._send(intent)


def _ready(state: State) -> bool:
    return state.newest.phase is Phase.STREAMING and state.newest.recorder is None
