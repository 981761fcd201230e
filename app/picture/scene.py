"""The hand in the centre of the page."""

from __future__ import annotations

import numpy as np
import viser

from app import colours
from app.picture.boards import BOARD_M, Boards, boards_of
from app.picture.halo import HaloNodes
from app.picture.held import HeldNodes
from app.picture.ink import InkNodes
from app.picture.meshes import mesh
from app.picture.skin import SkinNodes
from app.shown.bones import BoneSet, bone_sets, hand_length, joint_radii
from app.shown.look import DESK_TARGET, Camera
from app.views.course import GhostView
from app.views.held import HeldView
from app.views.joint import HaloView
from app.views.page import HandView, SensorsView
from app.views.room import standing
from app.views.written import TraceView
from handstudio.arrays import Array
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import FINGERS, SEGMENTS, Skeleton
from handstudio.layout import Layout
from handstudio.maths import so3
from handstudio.settings import Shown
from handstudio.way import Stand

_FLOOR_M = -0.06
_BOARD_ALONE_M = 0.05  # drawn size of a sensor where there is no hand
_APART_M = 0.12
_AXES_M = 0.014
_GHOSTLY = 0.5
_SEE_THROUGH = 0.36  # skin over bones: both are to be seen
_PALE_SKIN = 0.30
_ABOVE = np.array([0.0, 0.02, 0.04])
_MIDDLE = FINGERS.index("middle")
_BESIDE = {side: np.array([x, 0.0, 0.0]) for side, x in (("right", -0.24), ("left", 0.24))}

_CELLS = {True: ((58, 62, 70), (84, 90, 100)), False: ((206, 210, 216), (176, 182, 190))}


class Scene:
    """Draws what a view says; nodes are made once and moved."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._root = server.scene.add_frame("/hand", show_axes=False)
        self._hand = _HandNodes(server)
        # not below the frame that moves: pages leave the bones of a skin where that first was
        self._skin = SkinNodes(server, "/skin")
        self._ghost = _GhostNodes(server)
        self._ink = InkNodes(server)
        self._held = HeldNodes(server)
        self._halo = HaloNodes(server)
        self._boards = _BoardNodes(server)
        self._sensors: dict[str, viser.SceneNodeHandle] = {}
        self._furnished: tuple[bool, float] | None = None
        self._label: viser.LabelHandle | None = None
        self._words = ""
        server.scene.set_up_direction("+z")

    def render(self, view: HandView | SensorsView | None, stand: Stand, shown: Shown) -> None:
        """Show a hand where it stands, bare sensors, or nothing."""
        self._root.wxyz, self._root.position = stand.q_still_world, stand.t_still_elbow
        match view:
            case HandView():
                self._clear_sensors()
                self._hand.render(view, visible=shown.bones)
                self._render_skin(view, standing(view.pose, stand), shown)
                self._boards.render(view, shown)
            case SensorsView():
                self._clear_hand()
                self._show_sensors(view)
            case None:
                self._clear_hand()
                self._clear_sensors()

    def render_ghost(self, view: GhostView | None, shown: Shown) -> None:
        """Show the hand that shows what is asked for, or none."""
        self._ghost.render(view, shown)

    def render_trace(self, view: TraceView | None) -> None:
        """Show what is written by now, or nothing."""
        self._ink.render(view)

    def render_held(self, view: HeldView | None) -> None:
        """Show what the hand holds, or nothing."""
        self._held.render(view)

    def render_halo(self, view: HaloView | None) -> None:
        """Show how well a joint was found, or nothing."""
        self._halo.render(view)

    def say(self, words: str) -> None:
        """Words in the middle of the picture; none: nothing."""
        if words == self._words:
            return
        self._words = words
        if self._label is not None:
            self._label.remove()
            self._label = None
        if words:
            self._label = self._server.scene.add_label(
                "/words", words, position=DESK_TARGET, font_screen_scale=1.3, anchor="center-center"
            )

    def furnish(self, dark: bool, floor_m: float) -> None:
        """Floor, light and background of a dark or a light room; its floor may lie lower."""
        if (dark, floor_m) == self._furnished:
            return
        self._furnished = dark, floor_m
        _furnish(self._server, dark, floor_m)

    def aim(self, camera: Camera) -> None:
        """Point every page's camera, and those of the pages to come."""
        first = self._server.initial_camera
        first.position, first.look_at, first.up = camera.place, camera.target, camera.up
        for client in self._server.get_clients().values():
            with client.atomic():
                client.camera.up_direction = camera.up
                client.camera.position = camera.place
                client.camera.look_at = camera.target

    def _render_skin(self, view: HandView, pose: Pose, shown: Shown) -> None:
        """Bones are seen through skin, and tell what is in doubt; alone it tells so itself."""
        if not shown.skin:
            self._skin.hide()
            return
        opacity = _SEE_THROUGH if shown.bones else None
        self._skin.render(view.skeleton, pose, colours.SKIN, opacity)
        told = np.zeros_like(view.doubtful) if shown.bones else view.doubtful
        self._skin.mark(pose, told, view.dead)

    def _clear_hand(self) -> None:
        self._hand.clear()
        self._skin.hide()
        self._boards.clear()

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
            f"/sensors/{name}", axes_length=_BOARD_ALONE_M, axes_radius=_BOARD_ALONE_M / 40
        )
        self._server.scene.add_mesh_simple(
            f"/sensors/{name}/board",
            vertices * _BOARD_ALONE_M,
            faces,
            color=colours.of_index(index),
        )
        self._server.scene.add_label(
            f"/sensors/{name}/name", name, position=(0.0, 0.0, 0.7 * _BOARD_ALONE_M)
        )
        self._sensors[name] = frame

    def _clear_sensors(self) -> None:
        for handle in self._sensors.values():
            handle.remove()
        self._sensors.clear()


class _HandNodes:
    """Bones and joints."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._skeleton: Skeleton | None = None
        self._sets: tuple[BoneSet, ...] = ()
        self._bones: dict[str, viser.BatchedMeshHandle] = {}
        self._joints: viser.BatchedMeshHandle | None = None
        self._tinted: tuple[Array, ...] = ()

    def render(self, view: HandView, *, visible: bool) -> None:
        if view.skeleton is not self._skeleton:
            self._build(view.skeleton)
        for handle in (*self._bones.values(), self._joints):
            if handle is not None and handle.visible != visible:
                handle.visible = visible
        if visible:
            self._move(view)
            self._tint(view)

    def clear(self) -> None:
        for handle in self._bones.values():
            handle.remove()
        self._bones.clear()
        if self._joints is not None:
            self._joints.remove()
            self._joints = None
        self._skeleton, self._sets, self._tinted = None, (), ()

    def _build(self, skeleton: Skeleton) -> None:
        self.clear()
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
        self._joints = self._server.scene.add_batched_meshes_simple(
            "/hand/joint",
            vertices,
            faces,
            batched_wxyzs=np.tile(so3.IDENTITY, (len(SEGMENTS), 1)),
            batched_positions=np.zeros((len(SEGMENTS), 3)),
            batched_scales=joint_radii()[:, None] * _ball_shape() * hand_length(skeleton),
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

    def _tint(self, view: HandView) -> None:
        """Colours tell state; sent only when one changes."""
        shown = (view.doubtful, view.dead)
        if len(self._tinted) == 2 and all(map(np.array_equal, shown, self._tinted)):
            return
        self._tinted = shown
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


class _GhostNodes:
    """A pale hand beside the live one; what the step is about keeps its colours."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._skeleton: Skeleton | None = None
        self._moving: Array | None = None
        self._sets: tuple[BoneSet, ...] = ()
        self._bones: dict[str, viser.BatchedMeshHandle] = {}
        self._skin = SkinNodes(server, "/ghost/skin", shadow=False)
        self._label: viser.LabelHandle | None = None

    def render(self, view: GhostView | None, shown: Shown) -> None:
        if view is None:
            self.clear()
            return
        if view.skeleton is not self._skeleton or view.moving is not self._moving:
            self._build(view)
        # in the place of the other hand its bones would hide that one's
        apart = view.beside or not shown.skin
        for bones in self._sets:
            handle = self._bones[bones.mesh]
            if handle.visible != apart:
                handle.visible = apart
            q, t = bones.placed(view.pose)
            handle.batched_wxyzs, handle.batched_positions = q, t + _place(view)
        if self._label is not None:
            self._label.position = view.pose.t_world_tip[_MIDDLE] + _place(view) + _ABOVE
        if shown.skin:
            tint = colours.SKIN if view.beside else colours.SECOND
            self._skin.render(view.skeleton, view.pose, tint, _PALE_SKIN, _place(view))
        else:
            self._skin.hide()

    def clear(self) -> None:
        for handle in self._bones.values():
            handle.remove()
        self._bones.clear()
        self._skin.hide()
        if self._label is not None:
            self._label.remove()
            self._label = None
        self._skeleton, self._moving, self._sets = None, None, ()

    def _build(self, view: GhostView) -> None:
        self.clear()
        self._skeleton, self._moving = view.skeleton, view.moving
        self._sets = bone_sets(view.skeleton)
        for bones in self._sets:
            vertices, faces = mesh(bones.mesh, mirrored=view.skeleton.side == "left")
            tints = [
                colour if view.moving[segment] else colours.GHOST
                for segment, colour in zip(bones.segment, bones.colour, strict=True)
            ]
            count = len(bones.segment)
            self._bones[bones.mesh] = self._server.scene.add_batched_meshes_simple(
                f"/ghost/{bones.mesh}",
                vertices,
                faces,
                batched_wxyzs=np.tile(so3.IDENTITY, (count, 1)),
                batched_positions=np.zeros((count, 3)),
                batched_scales=bones.scale,
                batched_colors=np.array(tints, dtype=np.uint8),
                batched_opacities=np.where(view.moving[list(bones.segment)], 0.9, _GHOSTLY),
                cast_shadow=False,
                lod="off",
            )
        if view.words:
            self._label = self._server.scene.add_label(
                "/ghost/words",
                view.words,
                font_screen_scale=1.1 if view.beside else 0.9,
                anchor="bottom-center",
            )


def _place(view: GhostView) -> Array:
    """Where a ghost stands, from where the hand does."""
    return _BESIDE[view.skeleton.side] if view.beside else np.zeros(3)


class _BoardNodes:
    """The sensors on the hand: boards, their axes, their names, and the one that is lit."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._made_for: tuple[Layout, Skeleton] | None = None
        self._boards: Boards | None = None
        self._mesh: viser.BatchedMeshHandle | None = None
        self._axes: viser.BatchedAxesHandle | None = None
        self._names: dict[str, viser.LabelHandle] = {}
        self._lit: frozenset[str] = frozenset()

    def render(self, view: HandView, shown: Shown) -> None:
        if not (shown.sensors or shown.axes or shown.labels or view.lit):
            self.clear()
            return
        if self._made_for is None or self._made_for != (view.layout, view.skeleton):
            self.clear()
            self._made_for = view.layout, view.skeleton
            self._boards = boards_of(view.layout, view.skeleton)
        if self._boards is None or not self._boards.names:
            return
        attitudes, places = self._boards.placed(view.pose)
        self._render_mesh(attitudes, places, shown.sensors or bool(view.lit))
        self._light(view.lit)
        self._render_axes(attitudes, places, shown.axes)
        named = set(self._boards.names) if shown.labels else set(view.lit)
        self._render_names(attitudes, places, named)

    def clear(self) -> None:
        for handle in (self._mesh, self._axes, *self._names.values()):
            if handle is not None:
                handle.remove()
        self._made_for, self._boards, self._mesh, self._axes = None, None, None, None
        self._names.clear()
        self._lit = frozenset()

    def _render_mesh(self, attitudes: Array, places: Array, wanted: bool) -> None:
        if not wanted:
            if self._mesh is not None:
                self._mesh.remove()
                self._mesh, self._lit = None, frozenset()
            return
        if self._mesh is None and self._boards is not None:
            vertices, faces = mesh("sensor")
            self._mesh = self._server.scene.add_batched_meshes_simple(
                "/hand/boards",
                vertices * BOARD_M,
                faces,
                batched_wxyzs=attitudes,
                batched_positions=places,
                batched_colors=np.array(self._tints(frozenset()), dtype=np.uint8),
                lod="off",
            )
        if self._mesh is not None:
            self._mesh.batched_wxyzs, self._mesh.batched_positions = attitudes, places

    def _light(self, lit: frozenset[str]) -> None:
        if self._mesh is not None and lit != self._lit:
            self._lit = lit
            self._mesh.batched_colors = np.array(self._tints(lit), dtype=np.uint8)

    def _tints(self, lit: frozenset[str]) -> list[tuple[int, int, int]]:
        names = self._boards.names if self._boards is not None else ()
        return [colours.LIT if name in lit else colours.BOARD for name in names]

    def _render_axes(self, attitudes: Array, places: Array, wanted: bool) -> None:
        if not wanted:
            if self._axes is not None:
                self._axes.remove()
                self._axes = None
            return
        if self._axes is None:
            self._axes = self._server.scene.add_batched_axes(
                "/hand/axes", attitudes, places, axes_length=_AXES_M, axes_radius=_AXES_M / 16
            )
        self._axes.batched_wxyzs, self._axes.batched_positions = attitudes, places

    def _render_names(self, attitudes: Array, places: Array, wanted: set[str]) -> None:
        for gone in self._names.keys() - wanted:
            self._names.pop(gone).remove()
        if self._boards is None:
            return
        above = places + so3.rotate(attitudes, np.array([0.0, 0.0, 0.6 * BOARD_M]))
        for i, name in enumerate(self._boards.names):
            if name not in wanted:
                continue
            if name not in self._names:
                self._names[name] = self._server.scene.add_label(
                    f"/hand/names/{name}", name, font_screen_scale=0.8, anchor="bottom-center"
                )
            self._names[name].position = above[i]


def _ball_shape() -> Array:
    """Joints are balls; the one of the wrist stands for the whole carpus."""
    shape = np.ones((len(SEGMENTS), 3))
    shape[SEGMENTS.index("hand")] = (1.4, 1.1, 0.8)
    return shape


def _tinted(colour: tuple[int, int, int], doubtful: bool, dead: bool) -> tuple[int, int, int]:
    if dead:
        return colours.DEAD
    return colours.pale(colour) if doubtful else colour


def _furnish(server: viser.ViserServer, dark: bool, floor_m: float) -> None:
    cell, section = _CELLS[dark]
    server.scene.add_grid(
        "/floor",
        width=2.0,
        height=2.0,
        plane="xy",
        cell_size=0.05,
        section_size=0.25,
        cell_color=cell,
        section_color=section,
        fade_distance=1.6,
        position=(0.0, 0.25, _FLOOR_M + floor_m),
        shadow_opacity=0.25 if dark else 0.12,
    )
    # dimmer than viser's own light, which bleaches the colours that tell fingers apart
    server.scene.configure_default_lights(enabled=False)
    server.scene.configure_environment_map("warehouse", environment_intensity=0.3)
    server.scene.add_light_directional(
        "/light", intensity=1.1, position=(-0.3, -0.2, 1.0), cast_shadow=True
    )
    server.scene.add_light_ambient("/fill", intensity=0.55)  # the palm turns away from the light
