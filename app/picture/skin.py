"""Hands with their skin on: the surface of a hand, moved with it, patched where it is in doubt."""

from __future__ import annotations

from typing import Any

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
_INFLUENCES = 4  # bones that carry a vertex, at most, in a page
_TURNED = 1e-4  # of a quaternion's parts: less, and less than that far, nobody sees
_MOVED_M = 5e-5


class SkinNodes:
    """The skin of one hand in the scene; patches are made when they are first needed.

    Nothing of it is ever removed: a page may fail as a whole where a skinned mesh leaves it. Who is
    not wanted is hidden, and another hand takes its shape.

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
        self._outgrown: set[tuple[int, bool]] = set()  # patches that have another hand's shape

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
            self._skeleton, self._mesh = skeleton, skinned(skeleton)
            mesh = self._mesh
            self._skin = self._carried(
                self._skin,
                self._name,
                mesh.vertices,
                mesh.faces,
                weights=mesh.dense_weights(),
                bound=mesh.bound,
                color=colour,
                opacity=opacity,
                cast_shadow=self._shadow,
            )
            self._outgrown = set(self._patches)
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
            if self._mesh is not None:
                self._patch(self._mesh, segment, gone).show(pose)

    def hide(self) -> None:
        """Out of sight, but kept."""
        for patch in self._patches.values():
            patch.hide()
        if self._skin is not None:
            self._skin.hide()

    def _patch(self, mesh: SkinnedMesh, segment: int, dead: bool) -> _Carried:
        key = segment, dead
        if key in self._patches and key not in self._outgrown:
            return self._patches[key]
        part, faces = mesh.part(segment)
        self._patches[key] = self._carried(
            self._patches.get(key),
            f"{self._name}/{SEGMENTS[segment]}{'-dead' if dead else ''}",
            mesh.vertices[part] + _ABOVE_M * mesh.normals()[part],
            faces,
            weights=mesh.dense_weights()[part],
            bound=mesh.bound,
            color=colours.DEAD if dead else colours.DOUBT,
            wireframe=not dead,
            opacity=None if dead else _HATCHING,
            cast_shadow=False,
        )
        self._outgrown.discard(key)
        return self._patches[key]

    def _carried(
        self,
        kept: _Carried | None,
        name: str,
        vertices: Array,
        faces: Array,
        *,
        weights: Array,
        bound: Pose,
        **looks: Any,
    ) -> _Carried:
        """A skinned mesh: one that is there takes this shape, else it is made."""
        if kept is not None:
            kept.reshape(self._server, vertices, faces, weights, bound)
            return kept
        node = self._server.scene.add_mesh_skinned(
            name,
            vertices,
            faces,
            bone_wxyzs=bound.q_world_segment,
            bone_positions=bound.t_world_joint,
            skin_weights=weights,
            receive_shadow=False,
            **looks,
        )
        return _Carried(node)


class _Carried:
    """A skinned mesh that is carried by segments; only what has moved to be seen is sent."""

    def __init__(self, node: viser.MeshSkinnedHandle) -> None:
        self.node = node
        self._q, self._place = np.zeros((len(SEGMENTS), 4)), np.zeros((len(SEGMENTS), 3))

    def reshape(
        self, server: viser.ViserServer, vertices: Array, faces: Array, weights: Array, bound: Pose
    ) -> None:
        """Take the shape of another hand."""
        most = np.argsort(weights, axis=1)[:, -_INFLUENCES:]
        with server.atomic():
            self.node.vertices, self.node.faces = vertices, faces
            self.node.skin_indices = most.astype(np.uint16)
            self.node.skin_weights = np.take_along_axis(weights, most, axis=1)
            self.node.bone_wxyzs = bound.q_world_segment
            self.node.bone_positions = bound.t_world_joint
        self._q[:] = 0.0  # it stands as it was bound until it is moved

    def show(self, pose: Pose, beside: Array | None = None) -> None:
        """In a single pose; ``beside`` is where it stands from where the pose has it [m]."""
        if not self.node.visible:
            self.node.visible = True
        q, place = pose.q_world_segment, pose.t_world_joint
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
