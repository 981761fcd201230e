"""What a hand holds, in the picture: a sphere or a bar of the size that was told."""

from __future__ import annotations

import viser

from app import colours
from app.views.held import HeldView

_SEE_THROUGH = 0.45  # the fingers behind it are to be seen
_ROUND = 40


class HeldNodes:
    """Made once a grasp, then moved with the hand."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._of: object = None
        self._thing: viser.IcosphereHandle | viser.CylinderHandle | None = None

    def render(self, view: HeldView | None) -> None:
        """Show what is held, or nothing."""
        if view is None:
            self.clear()
            return
        if view.size is not self._of or self._thing is None:
            self.clear()
            self._of, self._thing = view.size, self._made(view)
        self._thing.wxyz, self._thing.position = view.q_world_held, view.t_world_held

    def clear(self) -> None:
        """Take it away."""
        if self._thing is not None:
            self._thing.remove()
        self._of, self._thing = None, None

    def _made(self, view: HeldView) -> viser.IcosphereHandle | viser.CylinderHandle:
        scene = self._server.scene
        if view.length_m == 0.0:
            return scene.add_icosphere(
                "/hand/held", view.radius_m, colours.HELD, opacity=_SEE_THROUGH, cast_shadow=False
            )
        return scene.add_cylinder(
            "/hand/held",
            view.radius_m,
            view.length_m,
            colours.HELD,
            radial_segments=_ROUND,
            opacity=_SEE_THROUGH,
            side="double",
            cast_shadow=False,
        )
