"""What was written, in the picture: desk and page on its plane, and the ink so far."""

from __future__ import annotations

import numpy as np
import viser

from app.views.written import TraceView
from handstudio.analysis.writing import Writing
from handstudio.arrays import Array

_INK_M = 0.0015
_ABOVE_M = 0.0005  # of the ink over the page, or the two would flicker
_UNDER_M = 0.001  # of the desk under the page, for the same reason
_INK, _PAPER, _DESK = (37, 99, 235), (250, 250, 245), (150, 122, 92)
_SEE_THROUGH, _DESK_SEE_THROUGH = 0.35, 0.22
_FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)


class InkNodes:
    """The page is made once a writing; ink only when there is more or less of it."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._root = server.scene.add_frame("/ink", show_axes=False)
        self._writing: Writing | None = None
        self._count = -1
        self._sheets: list[viser.MeshHandle] = []  # desk and page
        self._ink: viser.LineSegmentsHandle | None = None

    def render(self, view: TraceView | None) -> None:
        """Show what is written by now, or nothing."""
        if view is None:
            self.clear()
            return
        stand = view.stand
        self._root.wxyz, self._root.position = stand.q_still_world, stand.t_still_elbow
        if view.writing is not self._writing:
            self.clear()
            self._writing = view.writing
            under = _UNDER_M * view.writing.plane.normal
            self._sheets = [
                self._sheet("desk", view.desk - under, _DESK, _DESK_SEE_THROUGH),
                self._sheet("page", view.page, _PAPER, _SEE_THROUGH),
            ]
        if view.count != self._count:
            self._count = view.count
            self._draw(view.lines + _ABOVE_M * view.writing.plane.normal)

    def clear(self) -> None:
        """Take desk, page and ink away."""
        for handle in (*self._sheets, self._ink):
            if handle is not None:
                handle.remove()
        self._sheets, self._ink, self._writing, self._count = [], None, None, -1

    def _sheet(
        self, name: str, corners: Array, colour: tuple[int, int, int], opacity: float
    ) -> viser.MeshHandle:
        return self._server.scene.add_mesh_simple(
            f"/ink/{name}",
            corners,
            _FACES,
            color=colour,
            opacity=opacity,
            side="double",
            cast_shadow=False,
        )

    def _draw(self, lines: Array) -> None:
        if self._ink is not None:
            self._ink.remove()
            self._ink = None
        if len(lines):
            self._ink = self._server.scene.add_line_segments(
                "/ink/lines", lines.astype(np.float32), _INK, thickness=_INK_M
            )
