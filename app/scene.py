"""The hand in the centre of the page."""

from __future__ import annotations

import numpy as np
import viser

from app import colours
from app.bones import BoneSet, bone_sets, joint_radii
from app.meshes import mesh
from app.view import HandView, SensorsView
from handstudio.arrays import Array
from handstudio.hand.skeleton import SEGMENTS, Skeleton
from handstudio.maths import so3

_FLOOR_M = -0.06
_BOARD_M = 0.05  # drawn size of a sensor where there is no hand
_APART_M = 0.12


class Scene:
    """Draws what a view says; nodes are made once and moved."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._skeleton: Skeleton | None = None
        self._sets: tuple[BoneSet, ...] = ()
        self._bones: dict[str, viser.BatchedMeshHandle] = {}
        self._joints: viser.BatchedMeshHandle | None = None
        self._sensors: dict[str, viser.SceneNodeHandle] = {}
        self._root = server.scene.add_frame("/hand", show_axes=False)
        self._shown: tuple[Array, ...] = ()
        _furnish(server)

    def render(self, view: HandView | SensorsView | None, yaw: float | None) -> None:
        """Show a hand, bare sensors, or nothing."""
        self._root.wxyz = so3.about_z(yaw or 0.0)
        match view:
            case HandView():
                self._clear_sensors()
                if view.skeleton is not self._skeleton:
                    self._build(view.skeleton)
                self._move(view)
            case SensorsView():
                self._clear_hand()
                self._show_sensors(view)
            case None:
                self._clear_hand()
                self._clear_sensors()

    def _build(self, skeleton: Skeleton) -> None:
        self._clear_hand()
        self._skeleton = skeleton
        self._sets = bone_sets(skeleton)
        for bones in self._sets:
            vertices, faces = mesh(bones.mesh, mirrored=skeleton.side == "left")
            count = len(bones.segment)
            self._bones[bones.mesh] = self._server.scene.add_batched_meshes_simple(
                f"/hand/{bones.mesh}",
                vertices,
                faces,
                batched_wxyzs=np.tile(so3.IDENTITY, (count, 1)),
                batched_positions=np.zeros((count, 3)),
                batched_scales=bones.scale,
                batched_colors=np.array(bones.colour, dtype=np.uint8),
                lod="off",
            )
        self._build_joints(skeleton)

    def _build_joints(self, skeleton: Skeleton) -> None:
        vertices, faces = mesh("joint")
        size = skeleton.length_m[SEGMENTS.index("forearm")] / 1.352  # hand length
        self._joints = self._server.scene.add_batched_meshes_simple(
            "/hand/joint",
            vertices,
            faces,
            batched_wxyzs=np.tile(so3.IDENTITY, (len(SEGMENTS), 1)),
            batched_positions=np.zeros((len(SEGMENTS), 3)),
            batched_scales=joint_radii()[:, None] * _ball_shape() * size,
            batched_colors=np.array([colours.of_part(s) for s in SEGMENTS], dtype=np.uint8),
            lod="off",
        )

    def _move(self, view: HandView) -> None:
        for bones in self._sets:
            handle = self._bones[bones.mesh]
            handle.batched_wxyzs, handle.batched_positions = bones.placed(view.pose)
        if self._joints is not None:
            self._joints.batched_positions = view.pose.t_world_joint
            self._joints.batched_wxyzs = view.pose.q_world_segment
        self._tint(view)

    def _tint(self, view: HandView) -> None:
        """Colours tell state; sent only when one changes."""
        shown = (view.doubtful, view.dead)
        if len(self._shown) == 2 and all(
            np.array_equal(a, b) for a, b in zip(shown, self._shown, strict=True)
        ):
            return
        self._shown = shown
        for bones in self._sets:
            self._bones[bones.mesh].batched_colors = np.array(
                [
                    _tinted(colour, view.doubtful[segment], view.dead[segment])
                    for segment, colour in zip(bones.segment, bones.colour, strict=True)
                ],
                dtype=np.uint8,
            )
        if self._joints is not None:
            self._joints.batched_colors = np.array(
                [
                    _tinted(colours.of_part(name), view.doubtful[i], view.dead[i])
                    for i, name in enumerate(SEGMENTS)
                ],
                dtype=np.uint8,
            )

    def _show_sensors(self, view: SensorsView) -> None:
        middle = (len(view.names) - 1) / 2
        for i, name in enumerate(view.names):
            if name not in self._sensors:
                self._add_sensor(name, i)
            self._sensors[name].wxyz = view.q_world_sensor[i]
            self._sensors[name].position = np.array([(i - middle) * _APART_M, 0.25, 0.05])

    def _add_sensor(self, name: str, index: int) -> None:
        vertices, faces = mesh("sensor")
        frame = self._server.scene.add_frame(
            f"/sensors/{name}", axes_length=_BOARD_M, axes_radius=_BOARD_M / 40
        )
        self._server.scene.add_mesh_simple(
            f"/sensors/{name}/board",
            vertices * _BOARD_M,
            faces,
            color=colours.of_index(index),
        )
        self._server.scene.add_label(
            f"/sensors/{name}/name", name, position=(0.0, 0.0, 0.7 * _BOARD_M)
        )
        self._sensors[name] = frame

    def _clear_hand(self) -> None:
        for handle in self._bones.values():
            handle.remove()
        self._bones.clear()
        if self._joints is not None:
            self._joints.remove()
            self._joints = None
        self._skeleton, self._sets, self._shown = None, (), ()

    def _clear_sensors(self) -> None:
        for handle in self._sensors.values():
            handle.remove()
        self._sensors.clear()


def _ball_shape() -> Array:
    """Joints are balls; the one of the wrist stands for the whole carpus."""
    shape = np.ones((len(SEGMENTS), 3))
    shape[SEGMENTS.index("hand")] = (1.4, 1.1, 0.8)
    return shape


def _tinted(colour: tuple[int, int, int], doubtful: bool, dead: bool) -> tuple[int, int, int]:
    if dead:
        return colours.DEAD
    return colours.pale(colour) if doubtful else colour


def _furnish(server: viser.ViserServer) -> None:
    server.scene.set_up_direction("+z")
    server.scene.add_grid(
        "/floor",
        width=2.0,
        height=2.0,
        plane="xy",
        cell_size=0.05,
        section_size=0.25,
        cell_color=(58, 62, 70),
        section_color=(84, 90, 100),
        fade_distance=1.6,
        position=(0.0, 0.25, _FLOOR_M),
        shadow_opacity=0.25,
    )
    # dimmer than viser's own light, which bleaches the colours that tell fingers apart
    server.scene.configure_default_lights(enabled=False)
    server.scene.configure_environment_map("warehouse", environment_intensity=0.3)
    server.scene.add_light_directional(
        "/light", intensity=1.1, position=(-0.3, -0.2, 1.0), cast_shadow=True
    )
    server.initial_camera.position = (-0.13, 0.02, 0.40)
    server.initial_camera.look_at = (0.0, 0.31, 0.0)
    server.initial_camera.up = (0.0, 0.0, 1.0)
