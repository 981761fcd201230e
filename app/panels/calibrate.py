"""Calibrate: what the model of this hand rests on now, what is missing, how long it takes."""

from __future__ import annotations

import viser

from app.panels.base import put
from app.state import State
from app.views import calibration as calibration_view


class CalibratePanel:
    """The steps towards a hand that can be trusted, each with where it stands."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._sheet = gui.add_html("")

    def render(self, state: State) -> None:
        """Show where each step stands."""
        put(self._sheet, content=calibration_view.as_html(calibration_view.steps_of(state)))
