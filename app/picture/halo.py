"""Round a joint of the hand: how well trackers found its centre."""

from __future__ import annotations

import numpy as np
import viser

from app.views.joint import HaloView

_SEE_THROUGH = 0.45
_ABOVE_M = 0.006


class HaloNodes:
    """A pale ball and a label, made once an answer and moved along with the hand."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._made_for: tuple[float, tuple[int, int, int], str] | None = None
        self._ball: viser.IcosphereHandle | None = None
        self._label: viser.LabelHandle | None = None

    def render(self, view: HaloView | None) -> None:
        """Show it, or nothing."""
        if view is None:
            self.clear()
            return
        made_for = view.radius_m, view.colour, view.words
        if made_for != self._made_for:
            self.clear()
            self._made_for = made_for
            self._ball = self._server.scene.add_icosphere(
                "/hand/halo",
                view.radius_m,
                view.colour,
                opacity=_SEE_THROUGH,
                cast_shadow=False,
            )
            self._label = self._server.scene.add_label(
                "/hand/halo_words", view.words, font_screen_scale=0.9, anchor="bottom-center"
            )
        if self._ball is not None and self._label is not None:
            self._ball.position = view.place
            self._label.position = view.place + np.array([0.0, 0.0, view.radius_m + _ABOVE_M])

    def clear(self) -> None:
        """Take it away."""
        for handle in (self._ball, self._label):
            if handle is not None:
                handle.remove()
        self._ball, self._label, self._made_for = None, None, None
