"""Hands with their skin on: the surface of a hand, moved with it, patched where it is in doubt."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import viser

from app import colours
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import SEGMENTS, Skeleton
from handstudio.hand.surface import SkinnedMesh
from handstudio.hand_surface import skinned

_ABOVE_M = 0.0006  # a patch lies on the skin


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
        self._node: viser.MeshSkinnedHandle | None = None
        self._patches: dict[tuple[int, bool], _Patch] = {}

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
        if skeleton is not self._skeleton or self._node is None:
            self.clear()
            self._skeleton, self._mesh = skeleton, skinned(skeleton)
            self._node = self._add(self._name, self._mesh, colour, opacity)
        for name, value in (("color", colour), ("opacity", opacity), ("visible", True)):
            if getattr(self._node, name) != value:
                setattr(self._node, name, value)
        _move(self._node, range(len(SEGMENTS)), pose, place)

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
        if self._node is not None and self._node.visible:
            self._node.visible = False

    def clear(self) -> None:
        """Take it off the scene."""
        for patch in self._patches.values():
            patch.node.remove()
        self._patches.clear()
        if self._node is not None:
            self._node.remove()
        self._node, self._mesh, self._skeleton = None, None, None

    def _add(
        self, name: str, mesh: SkinnedMesh, colour: tuple[int, int, int], opacity: float | None
    ) -> viser.MeshSkinnedHandle:
        return self._server.scene.add_mesh_skinned(
            name,
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

    def _patch(self, mesh: SkinnedMesh, segment: int, dead: bool) -> _Patch:
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
            cast_shadow=False,
            receive_shadow=False,
        )
        return _Patch(node, tuple(carrying.tolist()))


class _Patch:
    """What covers the part of the skin that a segment carries."""

    def __init__(self, node: viser.MeshSkinnedHandle, carrying: tuple[int, ...]) -> None:
        self.node, self._carrying = node, carrying

    def show(self, pose: Pose) -> None:
        if not self.node.visible:
            self.node.visible = True
        _move(self.node, self._carrying, pose, None)

    def hide(self) -> None:
        if self.node.visible:
            self.node.visible = False


def _move(
    node: viser.MeshSkinnedHandle, carrying: Iterable[int], pose: Pose, place: Array | None
) -> None:
    at = pose.t_world_joint if place is None else pose.t_world_joint + place
    for bone, segment in zip(node.bones, carrying, strict=True):
        bone.wxyz = pose.q_world_segment[segment]
        bone.position = at[segment]
