"""The drawn bones join the joints they belong to."""

from __future__ import annotations

import numpy as np
import pytest

from app.picture.boards import BOARD_M, boards_of
from app.picture.meshes import mesh
from app.shown.bones import bone_sets
from handstudio.hand.angles import compose
from handstudio.hand.pose import posed
from handstudio.hand.skeleton import (
    DISTALS,
    PARENTS,
    SEGMENTS,
    HandSide,
    nominal_skeleton,
)
from handstudio.hand_surface import skinned
from handstudio.layout import glove
from handstudio.maths import so3


@pytest.mark.parametrize("side", ["left", "right"])
def test_every_bone_of_a_digit_reaches_from_its_joint_to_the_next(side: HandSide) -> None:
    skeleton = nominal_skeleton(side)
    q = compose(np.random.default_rng(4).normal(0.0, 0.4, (len(SEGMENTS), 3)))
    pose = posed(skeleton, q)
    ends = dict(zip(DISTALS, pose.t_world_tip, strict=True))
    for bones in bone_sets(skeleton):
        q_bone, start = bones.placed(pose)
        along = so3.rotate(q_bone, np.array([0.0, 1.0, 0.0])) * bones.scale[:, 1:2]
        for segment, tail, head in zip(bones.segment, start, start + along, strict=True):
            name = SEGMENTS[segment]
            children = [c for c, parent in enumerate(PARENTS) if parent == segment]
            goals = [pose.t_world_joint[c] for c in children] or [ends[name]]
            assert min(np.linalg.norm(head - goal) for goal in goals) < 1e-9, name
            if name.split("_")[0] in ("thumb", "index", "middle", "ring", "little"):
                np.testing.assert_allclose(tail, pose.t_world_joint[segment], atol=1e-12)


def test_a_left_forearm_is_the_right_one_mirrored() -> None:
    right, left = mesh("forearm")[0], mesh("forearm", mirrored=True)[0]
    np.testing.assert_allclose(left * [-1.0, 1.0, 1.0], right)


@pytest.mark.parametrize("side", ["left", "right"])
def test_boards_lie_on_the_skin(side: HandSide) -> None:
    skeleton = nominal_skeleton(side)
    mesh, boards = skinned(skeleton), boards_of(glove(side), skeleton)
    _, places = boards.placed(mesh.bound)
    assert len(places) == 20
    for name, place in zip(boards.names, places, strict=True):
        offset = np.linalg.norm(mesh.vertices - place, axis=1)
        nearest = int(offset.argmin())
        assert offset[nearest] < 0.008, name
        outside = float((place - mesh.vertices[nearest]) @ mesh.normals()[nearest])
        assert -0.1 * BOARD_M < outside < 0.6 * BOARD_M, name
