"""TRC, C3D, BVH and GLB: other people's readers find the same hand in each, left ones too."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import c3d
import ezc3d
import numpy as np
import pybvh
import pygltflib
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from handstudio.export.part import Processed
from handstudio.export.tables import POINTS
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import FINGERS, SEGMENTS
from handstudio.hand_fit import fit_of
from handstudio.hand_surface import skinned
from handstudio.kinematics import pose_of
from handstudio.pipeline import join
from handstudio.setup import divided

from .conftest import GAP

WITHIN_MM = 0.01


def z_up(points: np.ndarray) -> np.ndarray:
    """From a world with y up to ours."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x, -z, y], axis=-1)


# --- TRC ------------------------------------------------------------------------------------------


def read_trc(path: Path) -> tuple[dict[str, str], np.ndarray, np.ndarray]:
    """Header, times, points [mm]; strict, and our own: OpenSim's is too large to be installed."""
    first, keys, values, names, axes, *rows = path.read_text().split("\n")[:-1]
    assert first.split("\t")[:3] == ["PathFileType", "4", "(X/Y/Z)"]
    about = dict(zip(keys.split("\t"), values.split("\t"), strict=True))
    assert names.split("\t")[2::3] == list(POINTS)
    assert axes.split("\t")[2:5] == ["X1", "Y1", "Z1"]
    cells = [row.split("\t") for row in rows]
    assert {len(row) for row in cells} == {2 + 3 * len(POINTS)}
    numbers = np.array([[float(cell or "nan") for cell in row] for row in cells])
    assert (np.diff(numbers[:, 0]) == 1.0).all()
    assert int(about["NumFrames"]) == len(rows)
    return about, numbers[:, 1], numbers[:, 2:].reshape(len(rows), -1, 3)


def test_trc_holds_the_points_at_their_times(into, whole, points):
    about, time_s, found = read_trc(into("trc", whole))
    assert (about["Units"], about["DataRate"], about["NumMarkers"]) == ("mm", "100", "23")
    np.testing.assert_allclose(found, points, atol=0.50001e-4)
    np.testing.assert_array_equal(time_s, np.round(np.arange(len(points)) * 0.01, 6))


def test_in_a_gap_trc_has_times_and_empty_cells(into, gappy, points):
    _, time_s, found = read_trc(into("trc", gappy))
    assert len(found) == len(points)
    np.testing.assert_array_equal(time_s, np.round(np.arange(len(points)) * 0.01, 6))
    assert np.isnan(found[GAP]).all()
    assert np.isfinite(np.delete(found, GAP, axis=0)).all()


# --- C3D ------------------------------------------------------------------------------------------


def read_c3d(path: Path) -> tuple[Any, np.ndarray, np.ndarray]:
    """By ezc3d: the file, points [mm] and residuals."""
    file = ezc3d.c3d(str(path))
    found = np.moveaxis(file["data"]["points"][:3], -1, 0).swapaxes(1, 2)
    return file, found, file["data"]["meta_points"]["residuals"][0].T


def test_two_other_readers_find_the_points_in_c3d(into, whole, points):
    path = into("c3d", whole, start_s=1.0)
    file, found, residuals = read_c3d(path)
    parameters = file["parameters"]
    assert parameters["POINT"]["LABELS"]["value"] == list(POINTS)
    assert parameters["POINT"]["UNITS"]["value"] == ["mm"]
    assert parameters["POINT"]["RATE"]["value"][0] == 100.0
    assert parameters["SUBJECTS"]["NAMES"]["value"] == ["virtual-0"]
    assert file["header"]["points"]["first_frame"] == 100  # from zero
    np.testing.assert_allclose(found, points[100:], atol=1e-4)
    assert (residuals == 0.0).all()
    told = json.loads("".join(parameters["HANDSTUDIO"]["METADATA"]["value"]))
    assert told["raw_sha256"] == whole.take.sha256()
    assert told["frame_rate_hz"] == 100.0
    with path.open("rb") as stream, warnings.catch_warnings():
        warnings.filterwarnings("ignore", "No analog data")
        other = c3d.Reader(stream)
        frames = list(other.read_frames())
        assert [label.strip() for label in other.point_labels] == list(POINTS)
        assert (other.first_frame, other.point_rate) == (101, 100.0)
    assert [frame[0] for frame in frames] == list(range(101, 101 + len(frames)))
    np.testing.assert_allclose(np.stack([f[1][:, :3] for f in frames]), points[100:], atol=1e-4)


def test_in_a_gap_c3d_has_frames_that_are_invalid(into, gappy, points):
    file, found, residuals = read_c3d(into("c3d", gappy))
    assert len(found) == len(points)
    assert np.isnan(found[GAP]).all()
    assert (residuals[GAP] == -1.0).all()
    there = np.delete(np.arange(len(points)), GAP)
    np.testing.assert_allclose(found[there], points[there], atol=1e-4)
    assert (residuals[there] == 0.0).all()
    assert file["header"]["points"]["last_frame"] == len(points) - 1


def test_c3d_counts_beyond_sixteen_bits(into, whole):
    first, last = whole.motion[:50], whole.motion[50:100]
    apart = join([first, replace(last, time_us=last.time_us + 700_000_000)])
    path = into("c3d", Processed(whole.take, whole.setup, apart))
    with path.open("rb") as stream, warnings.catch_warnings():
        warnings.filterwarnings("ignore", "No analog data")
        file = c3d.Reader(stream)  # ezc3d finds as many, and takes ten seconds for it
        assert (file.first_frame, file.last_frame) == (1, 70_100)
        data = (int(file.get("POINT:DATA_START").int16_value) - 1) * 512
    frames = np.fromfile(path, "<f4", 70_100 * 23 * 4, offset=data).reshape(-1, 23, 4)
    there = [*range(50), *range(70_050, 70_100)]
    assert np.flatnonzero(frames[:, 0, 3] == 0.0).tolist() == there
    assert path.stat().st_size - data - frames.nbytes < 512


# --- BVH ------------------------------------------------------------------------------------------


def bvh_points(path: Path) -> tuple[Any, np.ndarray]:
    """By pybvh: the file, and its joints and ends in our world [mm], in the order of `POINTS`."""
    file = pybvh.read_bvh_file(str(path))
    placed = z_up(file.node_positions()) * 10.0
    names = [node.name for node in file.nodes]
    order = [names.index(segment) for segment in SEGMENTS]
    ends = [_end(file, f"{finger}_distal") for finger in FINGERS]
    return file, placed[:, [*order, *ends]]


def _end(file: Any, name: str) -> int:
    """Index of the node in which a joint ends."""
    ends = enumerate(file.nodes)
    return next(k for k, n in ends if n.is_end_site() and n.parent.name == name)


def test_bvh_places_the_same_points(into, whole, points):
    file, found = bvh_points(into("bvh", whole))
    assert file.frame_time == 0.01
    np.testing.assert_allclose(found, points, atol=WITHIN_MM)


def test_at_zero_bvh_lies_flat_and_its_channels_are_the_fingers_angles(into, whole):
    lines = into("bvh", whole, start_s=5.0).read_text().splitlines()
    names = [line.split()[1] for line in lines if line.split()[0] in ("ROOT", "JOINT")]
    row = np.array(lines[lines.index("MOTION") + 3].split(), dtype=float)[3:].reshape(-1, 3)
    csv = into("csv", whole, start_s=5.0).read_text().splitlines()
    angle = dict(
        zip(csv[0].replace('"', "").split(","), map(float, csv[1].split(",")), strict=True)
    )
    turns = row[names.index("index_proximal")]
    assert turns[0] == pytest.approx(-angle["index_mcp_flexion_deg"], abs=1e-3)
    assert turns[1] == pytest.approx(angle["index_mcp_deviation_ulnar_deg"], abs=1e-3)  # left


def test_in_a_gap_bvh_holds_the_pose_before(into, gappy, points):
    _, found = bvh_points(into("bvh", gappy))
    assert len(found) == len(points)
    held = np.broadcast_to(points[GAP.start - 1], points[GAP].shape)
    np.testing.assert_allclose(found[GAP], held, atol=WITHIN_MM)
    np.testing.assert_allclose(found[GAP.stop :], points[GAP.stop :], atol=WITHIN_MM)


# --- GLB ------------------------------------------------------------------------------------------


def accessor(gltf: pygltflib.GLTF2, index: int) -> np.ndarray:
    one = gltf.accessors[index]
    view = gltf.bufferViews[one.bufferView]
    wide = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[one.type]
    begin = (view.byteOffset or 0) + (one.byteOffset or 0)
    kind = {pygltflib.FLOAT: "<f4", pygltflib.UNSIGNED_SHORT: "<u2"}[one.componentType]
    data = np.frombuffer(gltf.binary_blob(), kind, one.count * wide, begin)
    return data.reshape(one.count, wide).astype(float)


def glb_points(path: Path) -> tuple[pygltflib.GLTF2, np.ndarray, np.ndarray]:
    """By pygltflib: the file, times of the keys, and the nodes in our world [mm], as `POINTS`."""
    gltf = pygltflib.GLTF2().load(str(path))
    (animation,) = gltf.animations
    turns = {}
    moves = {}
    for channel in animation.channels:
        into = {"rotation": turns, "translation": moves}[channel.target.path]
        into[channel.target.node] = accessor(gltf, animation.samplers[channel.sampler].output)
    assert set(moves) <= {gltf.scenes[gltf.scene].nodes[0]}
    time_s = accessor(gltf, animation.samplers[0].input)[:, 0]
    found = {}

    def walk(node: int, q: np.ndarray, place: np.ndarray) -> None:
        here = gltf.nodes[node]
        place = place + (moves[node] if node in moves else turned(q, np.array(here.translation)))
        found[here.name] = place
        if node in turns:
            q = joined(q, turns[node])
        for child in here.children or []:
            walk(child, q, place)

    count = len(time_s)
    root = gltf.scenes[gltf.scene].nodes[0]
    walk(root, np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)), np.zeros((count, 3)))
    names = [*SEGMENTS, *(p for p in POINTS if p.endswith("_tip"))]
    return gltf, time_s, z_up(np.stack([found[name] for name in names], axis=1)) * 1e3


def turned(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A vector turned by quaternions that have their scalar last."""
    u, w = q[:, :3], q[:, 3:]
    t = 2.0 * np.cross(u, v)
    return v + w * t + np.cross(u, t)


def joined(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    a, w, b, v = p[:, :3], p[:, 3:], q[:, :3], q[:, 3:]
    vector = w * b + v * a + np.cross(a, b)
    return np.concatenate([vector, w * v - np.sum(a * b, axis=1, keepdims=True)], axis=1)


def test_glb_animates_the_same_points(into, whole, points):
    gltf, time_s, found = glb_points(into("glb", whole, start_s=1.0))
    np.testing.assert_allclose(found, points[100:], atol=WITHIN_MM)
    np.testing.assert_allclose(time_s, np.arange(len(time_s)) * 0.01, atol=1e-6)
    told = gltf.asset.extras["handstudio"]
    assert told["raw_sha256"] == whole.take.sha256()
    assert told["window_s"][0] == 1.0
    assert gltf.asset.version == "2.0"


def test_in_glb_no_turn_goes_the_long_way_round(into, whole):
    gltf, _, _ = glb_points(into("glb", whole))
    for sampler in gltf.animations[0].samplers:
        q = accessor(gltf, sampler.output)
        np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-6)
        assert (np.sum(q[1:] * q[:-1], axis=1) > 0.0).all()


def test_over_a_gap_glb_holds_the_pose_before(into, gappy, points):
    _, time_s, found = glb_points(into("glb", gappy))
    before = int(np.flatnonzero(np.isclose(time_s, 2.99))[0])
    np.testing.assert_allclose(time_s[before : before + 3], [2.99, 3.39, 3.4], atol=1e-6)
    np.testing.assert_allclose(found[before + 1], points[299], atol=WITHIN_MM)
    np.testing.assert_allclose(found[before + 2], points[340], atol=WITHIN_MM)


def test_another_viewer_shows_the_flat_hand_of_glb(into, whole):
    scene = trimesh.load(into("glb", whole))
    low, high = scene.bounds
    length = whole.setup.hand.hand_length_m
    # forearm and hand along -z, a bone's thickness high but for the thumb, which hangs down
    assert high[2] == pytest.approx(0.0, abs=0.01)
    assert -low[2] == pytest.approx(length * (1.352 + 0.99), abs=0.02)
    assert (high - low)[1] < 0.06
    assert high[0] > -low[0] * 0.5, "the thumb of a left hand lies towards +x"


# --- GLB with skin --------------------------------------------------------------------------------


def matrices(gltf: pygltflib.GLTF2, key: int) -> np.ndarray:
    """Of every joint of the skin at a key of the animation: from its frame to the world."""
    (animation,), (skin,) = gltf.animations, gltf.skins
    turns = {
        channel.target.node: accessor(gltf, animation.samplers[channel.sampler].output)[key]
        for channel in animation.channels
    }
    found = {}

    def walk(node: int, above: np.ndarray) -> None:
        here, local = gltf.nodes[node], np.eye(4)
        q = turns.get(node, np.array(here.rotation or [0.0, 0.0, 0.0, 1.0]))
        local[:3, :3] = Rotation.from_quat(q).as_matrix()
        local[:3, 3] = here.translation or [0.0, 0.0, 0.0]
        found[node] = above @ local
        for child in here.children or []:
            walk(child, found[node])

    walk(gltf.scenes[gltf.scene].nodes[0], np.eye(4))
    return np.stack([found[node] for node in skin.joints])


@pytest.mark.parametrize("hand_type", [2, 3])
def test_the_skin_of_glb_goes_where_the_hand_goes(into, whole, hand_type):
    source = Processed(whole.take, divided(whole.setup, hand_type), whole.motion)
    path = into("glb-skin", source).rename(into.folder / "skin.glb")
    gltf, time_s, found = glb_points(path)
    trc = read_trc(into("trc", source))[2]
    np.testing.assert_allclose(found, trc, atol=0.1)
    (primitive,) = gltf.meshes[0].primitives
    held, parts = primitive.attributes, {}
    for name in ("POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0"):
        parts[name] = accessor(gltf, getattr(held, name))
    joints, weights = parts["JOINTS_0"].astype(int), parts["WEIGHTS_0"]
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(parts["NORMAL"], axis=1), 1.0, atol=1e-5)
    assert (joints[weights == 0.0] == 0).all()
    inverse = accessor(gltf, gltf.skins[0].inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    fit = fit_of(source.setup)
    surface = skinned(fit.skeleton)
    points = np.concatenate([parts["POSITION"], np.ones((len(joints), 1))], axis=1)
    for key in (0, 150, len(time_s) - 1):
        carried = (matrices(gltf, key) @ inverse)[joints]
        moved = np.einsum("vs,vsij,vj->vi", weights, carried, points)[:, :3]
        pose = pose_of(source.setup, whole.motion.q_world_sensor[key : key + 1], fit)
        single = Pose(pose.q_world_segment[0], pose.t_world_joint[0], pose.t_world_tip[0])
        np.testing.assert_allclose(1e3 * z_up(moved), 1e3 * surface.moved(single), atol=0.1)


def test_another_viewer_shows_the_skin_of_glb_closed_and_outside_out(into, whole):
    path = into("glb-skin", whole).rename(into.folder / "skin.glb")
    (mesh,) = trimesh.load(path).geometry.values()
    mesh.merge_vertices()
    assert mesh.is_watertight
    assert mesh.volume > 1e-4  # inside out it would be negative
    assert mesh.extents.max() == pytest.approx(0.175 * (1.352 + 0.99), abs=0.06)


# --- all of them ----------------------------------------------------------------------------------


@pytest.mark.parametrize("hand_type", [1, 2])
def test_palms_that_are_divided_otherwise_are_drawn_too(into, whole, hand_type):
    other = Processed(whole.take, divided(whole.setup, hand_type), whole.motion)
    scene = trimesh.load(into("glb", other))
    assert np.isfinite(scene.bounds).all()
    spread = glb_points(into("glb", other))[2] - bvh_points(into("bvh", other))[1]
    assert np.abs(spread).max() < 0.1


def test_all_formats_agree_to_a_tenth_of_a_millimetre(into, whole):
    each = [
        read_trc(into("trc", whole))[2],
        read_c3d(into("c3d", whole))[1],
        bvh_points(into("bvh", whole))[1],
        glb_points(into("glb", whole))[2],
    ]
    spread = np.ptp(np.stack(each), axis=0).max()
    assert spread < 0.1
    assert np.ptp(each[0], axis=0).max() > 50.0, "a hand that moves"
