"""Joint by trackers: what it is found from and how, and the sheet with what comes of it."""

from __future__ import annotations

from typing import Any

import viser

from app import intents
from app.panels.base import QUIET, Send, put
from app.state import State
from app.views import joint as view
from app.words import _
from app.work.joint_work import ACROSS, Across, JointOrder

_NONE = "–"
_STEP_PX, _ANSWER_PX = (660.0, 300.0), (660.0, 470.0)  # the hand stays in sight above


class JointFolder:
    """The file, its two terminals, the method, the joint; or a virtual finger."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._state: State | None = None
        with gui.add_folder(_("Joint by trackers"), expand_by_default=False):
            upload = gui.add_upload_button(
                _("Give a track file"),
                icon=viser.Icon.UPLOAD,
                color=QUIET,
                hint=_("Poses as .csv, or markers as .trc, .c3d or .tsv, of your computer"),
            )
            self._path = gui.add_text(_("or path"), "", hint=_("Of the studio's computer"))
            take = gui.add_button(_("Use the path"), color=QUIET)
            self._facts = gui.add_html("")
            self._clusters = gui.add_text(
                _("Clusters"),
                "",
                hint=_("Which markers make a terminal: NAME=a,b,c; NAME=d,e,f"),
                visible=False,
            )
            self._upper = gui.add_dropdown(
                _("Upper"), (_NONE,), hint=_("The terminal nearer to the hand")
            )
            self._lower = gui.add_dropdown(
                _("Lower"), (_NONE,), hint=_("The terminal beyond the joint")
            )
            self._across = gui.add_dropdown(
                _("Across"),
                ACROSS,
                initial_value="y",
                hint=_("Axis of the tracker across the finger while it is straight"),
            )
            self._joint = gui.add_dropdown(
                _("Joint"), tuple(view.joint_names()), initial_value=view.joint_name("index_dip")
            )
            self._method = gui.add_dropdown(_("Method"), tuple(view.method_names()))
            self._find = gui.add_button(_("Find the joint"), icon=viser.Icon.TARGET)
            self._try = gui.add_button(
                _("Try a virtual finger"),
                color=QUIET,
                hint=_("Guided as with a tracker: hold it straight for 3 s, bend it for 20 s"),
            )
        upload.on_upload(
            lambda event: send(
                intents.GiveTracks(event.target.value.name, event.target.value.content)
            )
        )
        take.on_click(lambda _event: self._take_path())
        self._find.on_click(lambda _event: self._ask())
        self._try.on_click(lambda _event: self._try_out())

    def render(self, state: State) -> None:
        """Show what was given, and what can be chosen of it."""
        self._state = state
        finding = state.joint
        put(self._facts, content=view.file_html(finding))
        put(self._clusters, visible=finding.file is not None and bool(finding.file.markers))
        names = view.terminals_of(finding.file, self._clusters.value)
        for handle, first in ((self._upper, 0), (self._lower, 1)):
            _offer(handle, names, first)
        put(self._find, disabled=finding.file is None or finding.working)
        put(self._try, disabled=finding.working)

    def _take_path(self) -> None:
        if self._path.value.strip():
            self._send(intents.GiveTracks(self._path.value.strip()))

    def _ask(self) -> None:
        file = self._state.joint.file if self._state is not None else None
        across: Across = next((each for each in ACROSS if each == self._across.value), "y")
        if file is not None:
            order = JointOrder(
                file,
                _chosen(self._upper),
                _chosen(self._lower),
                view.joint_names()[self._joint.value],
                self._clusters.value,
                view.method_names()[self._method.value],
                across,
            )
            self._send(intents.FindJoint(order))

    def _try_out(self) -> None:
        joint = view.joint_names()[self._joint.value]
        self._send(intents.TryVirtualFinger(joint, view.method_names()[self._method.value]))


class JointSheet:
    """Read from two metres away while it goes on; from near when it is found."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._panel = gui.add_panel(visible=False)
        with self._panel.add_tab(_("Joint by trackers"), viser.Icon.TARGET):
            self._sheet = gui.add_html("")
            self._close = gui.add_button(_("Close"), color=QUIET)
        self._large: bool | None = None
        self._close.on_click(lambda _event: send(intents.CloseJoint()))

    def render(self, state: State) -> None:
        """Show the step, or what came of it."""
        content = view.sheet_html(state)
        put(self._panel, visible=bool(content))
        if not content:
            return
        large = state.joint.answer is not None
        if large != self._large:
            self._large = large
            width, height = _ANSWER_PX if large else _STEP_PX
            self._panel.float(x=16.0, y=-16.0, width=width, height=height)
        put(self._sheet, content=content)
        put(self._close, label=_("Close") if large else _("Leave"))


def _offer(handle: Any, names: tuple[str, ...], first: int) -> None:
    """Terminals to choose; one that is gone gives way to the first, or the second."""
    options = names or (_NONE,)
    if tuple(handle.options) != options:
        kept = handle.value
        handle.options = options
        handle.value = kept if kept in options else options[min(first, len(options) - 1)]


def _chosen(handle: Any) -> str:
    return "" if handle.value == _NONE else str(handle.value)
