"""The surface of a hand: drawn once around the average one, shaped to any other, moved with it.

A point is carried by up to four bones. To shape the surface to a hand, each bone's part of it is
stretched along the bone as the bone is longer, and about it as the hand is larger; to move it, each
segment takes its points along (linear blend skinning). Both blend what their bones make of a point
by its weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64

from handstudio.arrays import Array
from handstudio.hand.pose import Pose, posed
from handstudio.hand.rig import MOST_BONES, SEGMENT_OF_BONE, rig_of
from handstudio.hand.skeleton import SEGMENTS, HandSide, Skeleton, nominal_skeleton
from handstudio.maths import so3

MIRROR = np.array([-1.0, 1.0, 1.0])
_MIRRORED_TURN = np.array([1.0, 1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """As it was drawn: around the nominal right hand, a little spread and bent.

    Attributes:
        vertices: In the world [m], (vertex, 3).
        faces: Vertices of every triangle, anticlockwise seen from outside, (face, 3).
        bones: The bones of `rig.BONES` that carry each vertex, (vertex, MOST_BONES).
        weights: Their shares, which sum to 1.
        q_world_segment: How the hand stood, (segment, 4).
    """

    vertices: Float[Array, "v 3"]
    faces: Int64[Array, "f 3"]
    bones: Int64[Array, "v 4"]
    weights: Float[Array, "v 4"]
    q_world_segment: Float[Array, "k 4"]


@dataclass(frozen=True, slots=True, eq=False)
class SkinnedMesh:
    """The surface of one hand, as skinning wants it.

    Attributes:
        vertices: Of the hand as it is bound, in the world [m], (vertex, 3).
        faces: Vertices of every triangle, anticlockwise seen from outside, (face, 3).
        segments: The segments that carry each vertex, (vertex, MOST_BONES); one that is named
            twice carries nothing the second time.
        weights: Their shares, which sum to 1.
        bound: The pose it is bound in.
    """

    vertices: Float[Array, "v 3"]
    faces: Int64[Array, "f 3"]
    segments: Int64[Array, "v 4"]
    weights: Float[Array, "v 4"]
    bound: Pose

    def dense_weights(self) -> Float[Array, "v k"]:
        """Weight of every segment on every vertex."""
        out = np.zeros((len(self.vertices), len(SEGMENTS)))
        np.add.at(out, (np.arange(len(out))[:, None], self.segments), self.weights)
        return out

    def part(self, segment: int) -> tuple[Int64[Array, " p"], Int64[Array, "g 3"]]:
        """What a segment carries more of than any other: its vertices, and faces of these."""
        carried = self.dense_weights()[self.faces].sum(axis=1).argmax(axis=1)
        vertices, faces = np.unique(self.faces[carried == segment], return_inverse=True)
        return vertices, faces.reshape(-1, 3)

    def normals(self) -> Float[Array, "v 3"]:
        """Outward, of the vertices as bound, of unit length."""
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        of_faces, out = np.cross(b - a, c - a), np.zeros_like(self.vertices)
        for corner in range(3):
            np.add.at(out, self.faces[:, corner], of_faces)
        unit: Array = out / np.linalg.norm(out, axis=1, keepdims=True)
        return unit

    def moved(self, pose: Pose) -> Float[Array, "v 3"]:
        """The vertices of the hand in another pose, a single one [m]."""
        back = so3.conjugate(self.bound.q_world_segment)
        out = np.zeros_like(self.vertices)
        for slot in range(MOST_BONES):
            at = self.segments[:, slot]
            local = so3.rotate(back[at], self.vertices - self.bound.t_world_joint[at])
            place = pose.t_world_joint[at] + so3.rotate(pose.q_world_segment[at], local)
            out += self.weights[:, slot : slot + 1] * place
        return out


def shaped(surface: Surface, skeleton: Skeleton) -> SkinnedMesh:
    """The surface of a hand with these links; a left one is the right one mirrored.

    Bones keep the attitudes they were drawn in, so frames have to mean what CONVENTIONS.md says.
    """
    left = skeleton.side == "left"
    right = _mirrored(skeleton) if left else skeleton
    drawn, own = nominal_skeleton("right"), right
    before, after = posed(drawn, surface.q_world_segment), posed(own, surface.q_world_segment)
    vertices = np.zeros_like(surface.vertices)
    for slot in range(MOST_BONES):
        bones = surface.bones[:, slot]
        place = _wrapped(surface.vertices, bones, (drawn, before), (own, after))
        vertices += surface.weights[:, slot : slot + 1] * place
    segments = np.array(SEGMENT_OF_BONE)[surface.bones]
    faces, bound = surface.faces, after
    if left:
        vertices, faces = vertices * MIRROR, faces[:, ::-1].copy()
        bound = Pose(
            after.q_world_segment * _MIRRORED_TURN,
            after.t_world_joint * MIRROR,
            after.t_world_tip * MIRROR,
        )
    return SkinnedMesh(vertices, faces, *_merged(segments, surface.weights), bound)


def _wrapped(
    points: Array, bones: Array, before: tuple[Skeleton, Pose], after: tuple[Skeleton, Pose]
) -> Array:
    """Where the bone of each point has it on another hand that stands alike."""
    (drawn, stood), (own, stands) = before, after
    old, new = rig_of(drawn), rig_of(own)
    segment = np.array(SEGMENT_OF_BONE)[bones]
    q = stood.q_world_segment[segment]
    local = so3.rotate(so3.conjugate(q), points - stood.t_world_joint[segment])
    along_old = (old.end - old.start) / old.length_m[:, None]
    along_new = (new.end - new.start) / new.length_m[:, None]
    turn = _least_turn(along_old, along_new)[bones]
    local = local - old.start[bones]
    along = np.sum(local * along_old[bones], axis=-1, keepdims=True)
    across = local - along * along_old[bones]
    wide, long = new.size_m / old.size_m, (new.length_m / old.length_m)[bones, None]
    placed = new.start[bones] + along * long * along_new[bones] + so3.rotate(turn, wide * across)
    out: Array = stands.t_world_joint[segment] + so3.rotate(q, placed)
    return out


def _least_turn(a: Array, b: Array) -> Array:
    """The least rotations that take directions to directions, none of them opposite."""
    turn = np.concatenate([1.0 + np.sum(a * b, axis=-1, keepdims=True), np.cross(a, b)], axis=-1)
    return so3.normalize(turn)


def _mirrored(skeleton: Skeleton) -> Skeleton:
    side: HandSide = "left" if skeleton.side == "right" else "right"
    return Skeleton(
        side,
        skeleton.t_parent_joint * MIRROR,
        skeleton.q_parent_rest * _MIRRORED_TURN,
        skeleton.t_distal_tip * MIRROR,
    )


def _merged(segments: Array, weights: Array) -> tuple[Array, Array]:
    """Bones of one segment count as one."""
    merged = weights.copy()
    for slot in range(1, MOST_BONES):
        for earlier in range(slot):
            same = (segments[:, slot] == segments[:, earlier]) & (merged[:, slot] > 0.0)
            merged[same, earlier] += merged[same, slot]
            merged[same, slot] = 0.0
    return segments, merged
