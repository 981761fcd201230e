"""What was written, in the picture: a page on its plane and the ink that is on it by now."""

from __future__ import annotations

import numpy as np
import viser

from app.views.written import TraceView
from handstudio.analysis.writing import Writing
from handstudio.arrays import Array

_INK_M = 0.0015
_ABOVE_M = 0.0005  # of the ink over the page, or the two would flicker
_INK, _PAPER = (37, 99, 235), (250, 250, 245)
_SEE_THROUGH = 0.35
_FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)


class InkNodes:
    """The page is made once a writing; ink only when there is more or less of it."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._writing: Writing | None = None
        self._count = -1
        self._page: viser.MeshHandle | None = None
        self._ink: viser.LineSegmentsHandle | None = None

    def render(self, view: TraceView | None) -> None:
        """Show what is written by now, or nothing."""
        if view is None:
            self.clear()
            return
        if view.writing is not self._writing:
            self.clear()
            self._writing = view.writing
            self._page = self._server.scene.add_mesh_simple(
                "/hand/page",
                view.page,
                _FACES,
                color=_PAPER,
                opacity=_SEE_THROUGH,
                side="double",
                cast_shadow=False,
            )
        if view.count != self._count:
            self._count = view.count
            self._draw(view.lines + _ABOVE_M * view.writing.plane.normal)

    def clear(self) -> None:
        """Take page and ink away."""
        for handle in (self._page, self._ink):
            if handle is not None:
                handle.remove()
        self._page, self._ink, self._writing, self._count = None, None, None, -1

    def _draw(self, lines: Array) -> None:
        if self._ink is not None:
            self._ink.remove()
            self._ink = None
        if len(lines):
            self._ink = self._server.scene.add_line_segments(
                "/hand/ink", lines.astype(np.float32), _INK, thickness=_INK_M
            )
