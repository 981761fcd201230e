"""Hands with their skin on: the surface of a hand, moved with it, patched where it is in doubt."""

from __future__ import annotations

import numpy as np
import viser

from app import colours
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import SEGMENTS, Skeleton
from handstudio.hand.surface import SkinnedMesh
from handstudio.hand_surface import skinned

_ABOVE_M = 0.0006  # a patch lies on the skin
_HATCHING = 0.4
_TURNED = 1e-4  # of a quaternion's parts: less, and less than that far, nobody sees
_MOVED_M = 5e-5


class SkinNodes:
    """The skin of one hand in the scene; patches are made when they are first needed.

    Args:
        server: Whose scene.
        name: Of the node.
        shadow: Whether it casts one.
    """

    def __init__(self, server: viser.ViserServer, name: str, *, shadow: bool = True) -> None:
        self._server, self._name, self._shadow = server, name, shadow
        self._skeleton: Skeleton | None = None
        self._mesh: SkinnedMesh | None = None
        self._skin: _Carried | None = None
        self._patches: dict[tuple[int, bool], _Carried] = {}

    def render(
        self,
        skeleton: Skeleton,
        pose: Pose,
        colour: tuple[int, int, int],
        opacity: float | None,
        place: Array | None = None,
    ) -> None:
        """Show a hand in a single pose.

        Args:
            skeleton: Whose skin; the same object stands for the same hand.
            pose: Where it is.
            colour: Of the skin.
            opacity: None where nothing is to be seen through it.
            place: Where it stands from where the pose has it [m].
        """
        if skeleton is not self._skeleton or self._skin is None:
            self.clear()
            self._skeleton, self._mesh = skeleton, skinned(skeleton)
            self._skin = self._add(self._mesh, colour, opacity)
        for name, value in (("color", colour), ("opacity", opacity)):
            if getattr(self._skin.node, name) != value:
                setattr(self._skin.node, name, value)
        self._skin.show(pose, place)

    def mark(self, pose: Pose, doubtful: Array, dead: Array) -> None:
        """Hatch the segments that are in doubt, grey those that are dead."""
        wanted = {(i, bool(dead[i])) for i in np.flatnonzero(doubtful | dead).tolist()}
        for key in self._patches.keys() - wanted:
            self._patches[key].hide()
        for segment, gone in wanted:
            if (segment, gone) not in self._patches and self._mesh is not None:
                self._patches[segment, gone] = self._patch(self._mesh, segment, gone)
            self._patches[segment, gone].show(pose)

    def hide(self) -> None:
        """Out of sight, but kept."""
        for patch in self._patches.values():
            patch.hide()
        if self._skin is not None:
            self._skin.hide()

    def clear(self) -> None:
        """Take it off the scene."""
        for patch in self._patches.values():
            patch.node.remove()
        self._patches.clear()
        if self._skin is not None:
            self._skin.node.remove()
        self._skin, self._mesh, self._skeleton = None, None, None

    def _add(
        self, mesh: SkinnedMesh, colour: tuple[int, int, int], opacity: float | None
    ) -> _Carried:
        node = self._server.scene.add_mesh_skinned(
            self._name,
            mesh.vertices,
            mesh.faces,
            bone_wxyzs=mesh.bound.q_world_segment,
            bone_positions=mesh.bound.t_world_joint,
            skin_weights=mesh.dense_weights(),
            color=colour,
            opacity=opacity,
            cast_shadow=self._shadow,
            receive_shadow=False,
        )
        return _Carried(node, np.arange(len(SEGMENTS)))

    def _patch(self, mesh: SkinnedMesh, segment: int, dead: bool) -> _Carried:
        part, faces = mesh.part(segment)
        weights = mesh.dense_weights()[part]
        carrying = np.flatnonzero(weights.any(axis=0))
        lifted = mesh.vertices[part] + _ABOVE_M * mesh.normals()[part]
        node = self._server.scene.add_mesh_skinned(
            f"{self._name}/{SEGMENTS[segment]}{'-dead' if dead else ''}",
            lifted,
            faces,
            bone_wxyzs=mesh.bound.q_world_segment[carrying],
            bone_positions=mesh.bound.t_world_joint[carrying],
            skin_weights=weights[:, carrying],
            color=colours.DEAD if dead else colours.DOUBT,
            wireframe=not dead,
            opacity=None if dead else _HATCHING,
            cast_shadow=False,
            receive_shadow=False,
        )
        return _Carried(node, carrying)


class _Carried:
    """A skinned mesh that is carried by some segments; only what has moved to be seen is sent."""

    def __init__(self, node: viser.MeshSkinnedHandle, segments: Array) -> None:
        self.node, self._segments = node, segments
        self._q, self._place = np.zeros((len(segments), 4)), np.zeros((len(segments), 3))

    def show(self, pose: Pose, beside: Array | None = None) -> None:
        """In a single pose; ``beside`` is where it stands from where the pose has it [m]."""
        if not self.node.visible:
            self.node.visible = True
        q, place = pose.q_world_segment[self._segments], pose.t_world_joint[self._segments]
        if beside is not None:
            place = place + beside
        turned = np.abs(q - self._q).max(axis=1) > _TURNED
        moved = np.abs(place - self._place).max(axis=1) > _MOVED_M
        for i in np.flatnonzero(turned | moved):
            self.node.bones[i].wxyz, self.node.bones[i].position = q[i], place[i]
            self._q[i], self._place[i] = q[i], place[i]

    def hide(self) -> None:
        """Out of sight, but kept."""
        if self.node.visible:
            self.node.visible = False
