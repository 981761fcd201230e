"""The surface of a hand: shaped to its links, mirrored, moved with its bones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from handstudio.hand.angles import compose
from handstudio.hand.pose import Pose, posed
from handstudio.hand.rig import BONES, MOST_BONES, SEGMENT_OF_BONE, hand_length, rig_of
from handstudio.hand.skeleton import (
    DISTALS,
    FINGERS,
    JOINTS,
    PARENTS,
    SEGMENTS,
    HandSide,
    Skeleton,
    nominal_skeleton,
)
from handstudio.hand.surface import MIRROR, SkinnedMesh, Surface, shaped
from handstudio.hand_surface import drawn_surface, skinned
from handstudio.maths import so3
from handstudio.simulation.subject import subject

RIGHT = nominal_skeleton("right")
sides = pytest.mark.parametrize("side", ["right", "left"])

# full flexion of everything that bends [deg], as people can
FIST = {"mcp": 85.0, "pip": 100.0, "dip": 70.0, "ip": 60.0}


def bent(skeleton: Skeleton, share: float = 1.0) -> Pose:
    """From the flat hand, 0, to the fist, 1."""
    q = np.empty((len(SEGMENTS), 4))
    for index, (joint, parent) in enumerate(zip(JOINTS, PARENTS, strict=True)):
        flexion = np.deg2rad(share * FIST.get(joint.name.rpartition("_")[2], 0.0))
        turned = so3.multiply(skeleton.q_parent_rest[index], compose(np.array([-flexion, 0, 0])))
        q[index] = turned if parent < 0 else so3.multiply(q[parent], turned)
    return posed(skeleton, q)


def distances(points: np.ndarray, skeleton: Skeleton, pose: Pose) -> np.ndarray:
    """From points to every bone, (point, bone)."""
    out = []
    for start, end in zip(*rig_of(skeleton).ends(pose), strict=True):
        along = end - start
        share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        out.append(np.linalg.norm(points - start - share[:, None] * along, axis=1))
    return np.stack(out, axis=1)


def lengthened(segment: str, by_m: float) -> Skeleton:
    """The nominal right hand with one link longer."""
    joint = RIGHT.t_parent_joint.copy()
    joint[SEGMENTS.index(segment), 1] += by_m
    return replace(RIGHT, t_parent_joint=joint)


def test_it_is_closed_faces_outwards_and_is_small() -> None:
    surface = drawn_surface()
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.area_faces.min() > 1e-8
    assert len(surface.faces) <= 6000
    assert 0.9e-3 < mesh.volume < 1.3e-3  # m³; a hand alone has some 0.35 litres


def test_at_most_four_bones_share_a_point_and_share_all_of_it() -> None:
    surface = drawn_surface()
    assert surface.bones.shape == (len(surface.vertices), MOST_BONES)
    np.testing.assert_allclose(surface.weights.sum(axis=1), 1.0, rtol=1e-12)
    assert surface.weights.min() >= 0.0
    assert skinned(RIGHT).dense_weights().sum() == pytest.approx(len(surface.vertices))


@sides
def test_boundas_it_is_nothing_moves(side: HandSide) -> None:
    mesh = skinned(nominal_skeleton(side))
    np.testing.assert_allclose(mesh.moved(mesh.bound), mesh.vertices, atol=1e-12)


def test_around_the_average_hand_it_is_as_it_was_drawn() -> None:
    np.testing.assert_allclose(skinned(RIGHT).vertices, drawn_surface().vertices, atol=1e-12)


def test_a_left_hand_is_the_right_one_mirrored_however_it_is_bent() -> None:
    left = nominal_skeleton("left")
    right_mesh, left_mesh = skinned(RIGHT), skinned(left)
    np.testing.assert_allclose(left_mesh.vertices, right_mesh.vertices * MIRROR, atol=1e-12)
    moved = left_mesh.moved(bent(left)), right_mesh.moved(bent(RIGHT))
    np.testing.assert_allclose(moved[0], moved[1] * MIRROR, atol=1e-12)
    assert trimesh.Trimesh(left_mesh.vertices, left_mesh.faces, process=False).volume > 0.0


@pytest.mark.parametrize("person", [1, 2, 7])
def test_joints_of_the_drawing_come_to_lie_in_the_joints_of_the_hand(person: int) -> None:
    """Points in the joints, carried by both bones that meet there, as if they were skin."""
    own = subject(person).skeleton
    surface = drawn_surface()
    drawn = posed(RIGHT, surface.q_world_segment)
    for index, bone in enumerate(BONES):
        if not bone.finger or index + 1 == len(BONES) or BONES[index + 1].finger != bone.finger:
            continue
        child = SEGMENT_OF_BONE[index + 1]
        bones = np.array([[index, index + 1, 0, 0]])
        point = Surface(
            drawn.t_world_joint[[child]],
            np.zeros((1, 3), dtype=np.int64),
            bones,
            np.array([[0.3, 0.7, 0.0, 0.0]]),
            surface.q_world_segment,
        )
        mesh = shaped(point, own)
        off = np.linalg.norm(mesh.vertices[0] - mesh.bound.t_world_joint[child])
        assert off < 1e-9, bone


@pytest.mark.parametrize("by_m", [-0.006, 0.006])
def test_a_longer_link_moves_what_is_beyond_it_by_that_and_nothing_else(by_m: float) -> None:
    before, after = skinned(RIGHT), skinned(lengthened("index_distal", by_m))
    moved = after.vertices - before.vertices
    carried = before.dense_weights()
    beyond = carried[:, SEGMENTS.index("index_distal")] > 0.999
    along = so3.rotate(
        before.bound.q_world_segment[SEGMENTS.index("index_intermediate")], np.array([0, by_m, 0])
    )
    assert beyond.sum() > 8
    np.testing.assert_allclose(moved[beyond], np.broadcast_to(along, (beyond.sum(), 3)), atol=1e-4)
    finger = [i for i, name in enumerate(SEGMENTS) if name.startswith("index")]
    elsewhere = carried[:, finger].sum(axis=1) == 0.0
    assert np.abs(moved[elsewhere]).max() < 1e-12


def test_a_larger_hand_is_larger_in_every_direction() -> None:
    size = 1.15 * hand_length(RIGHT)
    larger = nominal_skeleton("right", 0.187 * 1.15)
    assert hand_length(larger) == pytest.approx(size)
    np.testing.assert_allclose(skinned(larger).vertices, 1.15 * skinned(RIGHT).vertices, atol=1e-9)


@sides
def test_fingertips_end_where_the_skeleton_says(side: HandSide) -> None:
    own = nominal_skeleton(side, 0.2)
    mesh, pose = skinned(own), bent(own, 0.4)
    vertices = mesh.moved(pose)
    for tip, segment in zip(pose.t_world_tip, DISTALS, strict=True):
        index = SEGMENTS.index(segment)
        q = so3.conjugate(pose.q_world_segment[index])
        local = so3.rotate(q, vertices[mesh.part(index)[0]] - pose.t_world_joint[index])
        length = np.linalg.norm(tip - pose.t_world_joint[index])
        assert abs(local[:, 1].max() - length) < 5e-4, segment


@pytest.mark.parametrize("person", [1, 2, 7])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_skin_stays_within_reach_of_the_bones(person: int, share: float) -> None:
    own = subject(person).skeleton
    mesh, pose = skinned(own), bent(own, share)
    vertices, size = mesh.moved(pose), hand_length(own)
    reach = distances(vertices, own, pose)
    assert reach.min(axis=1).max() < 0.25 * size  # the forearm's belly
    for finger in FINGERS[1:]:
        for kind in ("intermediate", "distal"):
            part = mesh.part(SEGMENTS.index(f"{finger}_{kind}"))[0]
            bones = [i for i, b in enumerate(BONES) if b.finger == finger]
            assert reach[np.ix_(part, bones)].min(axis=1).max() < 0.07 * size


def test_hardly_a_triangle_turns_over_in_a_fist() -> None:
    mesh, fist = skinned(RIGHT), bent(RIGHT)
    assert _turned_over(mesh, mesh.bound) == 0.0
    assert _turned_over(mesh, fist) < 0.02


def _turned_over(mesh: SkinnedMesh, pose: Pose) -> float:
    """Share of triangles whose normal is a right angle or more from where bones take it."""
    before, after = (_normals(v, mesh.faces) for v in (mesh.vertices, mesh.moved(pose)))
    back = so3.conjugate(mesh.bound.q_world_segment)
    turn = so3.multiply(pose.q_world_segment, back)
    taken = so3.rotate(turn[None], before[:, None])
    share = mesh.dense_weights()[mesh.faces].mean(axis=1)
    expected = (share[..., None] * taken).sum(axis=1)
    return float((np.sum(expected * after, axis=1) < 0.0).mean())


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return np.cross(b - a, c - a)


def test_every_face_is_part_of_one_segment() -> None:
    mesh = skinned(RIGHT)
    parts = [mesh.part(index) for index in range(len(SEGMENTS))]
    assert sum(len(faces) for _, faces in parts) == len(mesh.faces)
    assert all(len(faces) > 10 for _, faces in parts)
    vertices, faces = parts[SEGMENTS.index("thumb_distal")]
    assert faces.max() == len(vertices) - 1
