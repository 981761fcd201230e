"""The skin of the hand in a GLB: one mesh that the nodes of the segments carry (glTF 2.0, 3.7.3).

A viewer moves it as `SkinnedMesh.moved` does, by linear blend skinning: where a segment stands in
the bound pose is taken off by its inverse bind matrix, where it stands now is its node's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.export.gltf import Document
from handstudio.export.y_up import turned_points, turned_rotations
from handstudio.hand.pose import Pose
from handstudio.hand.skeleton import SEGMENTS, Skeleton
from handstudio.hand_surface import skinned
from handstudio.maths import so3

_COLOUR = (0.88, 0.68, 0.56)  # linear; nobody's


def draw(document: Document, skeleton: Skeleton, nodes: range) -> None:
    """Add the mesh, its skin, and a node beside the root that has both.

    Raises:
        HandstudioError: the installation lacks the surface.
    """
    surface = skinned(skeleton)
    weights = surface.weights.astype(np.float32)
    primitive = {
        "attributes": {
            "POSITION": document.add(turned_points(surface.vertices)),
            "NORMAL": document.add(turned_points(surface.normals())),
            # a joint that carries nothing is named as the first, as the specification wants it
            "JOINTS_0": document.add(np.where(weights > 0.0, surface.segments, 0).astype("<u2")),
            "WEIGHTS_0": document.add(weights / weights.sum(axis=1, keepdims=True)),
        },
        "indices": document.add(surface.faces.ravel().astype("<u2")),
        "material": 0,
    }
    paint = {"baseColorFactor": [*_COLOUR, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}
    about: dict[str, Any] = document.about
    about["materials"] = [{"name": "skin", "pbrMetallicRoughness": paint}]
    about["meshes"] = [{"name": "skin", "primitives": [primitive]}]
    about["skins"] = [
        {
            "joints": list(nodes),
            "skeleton": nodes[0],
            "inverseBindMatrices": document.add(_inverse_bind(surface.bound)),
        }
    ]
    about["scenes"][0]["nodes"].append(len(about["nodes"]))
    about["nodes"].append({"name": "skin", "mesh": 0, "skin": 0})


def _inverse_bind(bound: Pose) -> Float[Array, "k 16"]:
    """From the world into each segment as it was bound, column by column."""
    back = so3.conjugate(turned_rotations(bound.q_world_segment))
    out = np.zeros((len(SEGMENTS), 4, 4))
    out[:, :3, :3] = so3.to_matrix(back)
    out[:, :3, 3] = so3.rotate(back, -turned_points(bound.t_world_joint))
    out[:, 3, 3] = 1.0
    columns: Array = out.swapaxes(1, 2).reshape(-1, 16)
    return columns
