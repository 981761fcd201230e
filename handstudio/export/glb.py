"""Animated GLB: a node a segment that turns in its parent, y up, metres, quaternions x, y, z, w.

Time begins at the window's first instant. The pose is held over gaps, where a viewer would else
glide, and the place before where a room is known but not the place. Either every node has a bone
to see, or one more node has the skin (`glb_skin`).
"""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy as np

from handstudio.arrays import Array
from handstudio.colours import of_part
from handstudio.export import glb_skin
from handstudio.export.bones import CHILDREN, ends, in_parents
from handstudio.export.gltf import Document
from handstudio.export.part import BLOCK, Part, seconds
from handstudio.export.room import Placer
from handstudio.export.y_up import turned_points, turned_rotations
from handstudio.hand.skeleton import SEGMENTS, Skeleton
from handstudio.hand_fit import fit_of

NODES = range(len(SEGMENTS))
"""The nodes of the segments."""

_JUMP = 1.5  # usual steps: a longer one is a gap
_THICK = 0.12  # of a drawn bone, as a share of its length
_THICKEST_M = 0.008


def write_skin(part: Part, file: BinaryIO) -> None:
    """Write the skin of the hand and the animated skeleton that carries it."""
    write(part, file, skin=True)


def write(part: Part, file: BinaryIO, *, skin: bool = False) -> None:
    """Write skeleton and animation."""
    fit = fit_of(part.setup)
    document = Document(
        {
            "asset": {
                "version": "2.0",
                "generator": part.about["software"],
                "extras": {"handstudio": part.about},
            },
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": _nodes(fit.skeleton),
        }
    )
    if skin:
        glb_skin.draw(document, fit.skeleton, NODES)
    else:
        _draw(document, fit.skeleton)
    which, time_s = _keys(part)
    placer = Placer(part, fit)
    outputs, places = _animate(document, time_s, moves=placer.moves)
    first = document.begin(file)
    before = np.zeros((1, len(SEGMENTS), 4))
    for at in range(0, len(which), BLOCK):
        some = which[at : at + BLOCK]
        motion = part.motion[some[0] : some[-1] + 1]
        hand = placer.at(motion)
        local = in_parents(hand.q_frame_segment)[some - some[0]]
        values = _smooth_signs(turned_rotations(local), before)
        before = values[-1:]
        if places is not None:
            file.seek(first + document.place_of(places) + at * 12)
            shown = turned_points(hand.t_frame_root)[some - some[0]]
            file.write(shown.astype("<f4").tobytes())
        for node, output in zip(NODES, outputs, strict=True):
            file.seek(first + document.place_of(output) + at * 16)
            file.write(_xyzw(values[:, node]).astype("<f4").tobytes())
        part.tell(min(1.0, (at + BLOCK) / len(which)))


def _nodes(skeleton: Skeleton) -> list[dict[str, Any]]:
    """Nodes of the segments at the flat hand."""
    offsets = turned_points(skeleton.t_parent_joint)
    rest = _xyzw(turned_rotations(skeleton.q_parent_rest))
    nodes: list[dict[str, Any]] = []
    for index, name in enumerate(SEGMENTS):
        node = {
            "name": name,
            "translation": offsets[index].tolist(),
            "rotation": rest[index].tolist(),
        }
        nodes.append(node | ({"children": list(CHILDREN[index])} if CHILDREN[index] else {}))
    for index in NODES:
        if not CHILDREN[index]:
            (tip,) = ends(skeleton, index)
            nodes[index]["children"] = [len(nodes)]
            name = SEGMENTS[index].removesuffix("_distal")
            nodes.append({"name": f"{name}_tip", "translation": tip.tolist()})
    return nodes


def _draw(document: Document, skeleton: Skeleton) -> None:
    """A mesh a segment: spindles to the joints it carries, or to its tip."""
    meshes, materials = [], []
    for index, name in enumerate(SEGMENTS):
        document.about["nodes"][index]["mesh"] = index
        spindles = [_spindle(end) for end in ends(skeleton, index)]
        corners = np.concatenate(spindles)
        faces = np.concatenate([_FACES + 6 * k for k in range(len(spindles))])
        primitive = {
            "attributes": {"POSITION": document.add(corners)},
            "indices": document.add(faces.ravel().astype("<u2")),
            "material": index,
        }
        meshes.append({"name": name, "primitives": [primitive]})
        # colours are meant as screens show them, glTF wants them linear
        linear = [(channel / 255.0) ** 2.2 for channel in of_part(name)]
        surface = {"baseColorFactor": [*linear, 1.0], "metallicFactor": 0.0}
        materials.append({"name": name, "pbrMetallicRoughness": surface})
    document.about |= {"meshes": meshes, "materials": materials}


_FACES = np.array([[0, 1 + k, 1 + (k + 1) % 4] for k in range(4)]
                  + [[5, 1 + (k + 1) % 4, 1 + k] for k in range(4)])  # fmt: skip


def _spindle(end: Array) -> Array:
    """Six corners of an octahedron from the origin to a point, widest near the origin."""
    length = float(np.linalg.norm(end))
    along = end / length
    aside = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    aside /= np.linalg.norm(aside)
    third = np.cross(along, aside)
    wide = min(_THICK * length, _THICKEST_M)
    middle = 0.2 * end
    ring = [middle + wide * side for side in (aside, third, -aside, -third)]
    return np.array([np.zeros(3), *ring, end])


def _keys(part: Part) -> tuple[Array, Array]:
    """Which instant each key shows, and when [s]: all, and over gaps the one before once more."""
    time_us = part.motion.time_us - part.motion.time_us[0]
    which = np.arange(len(time_us))
    if len(time_us) < 2:
        return which, seconds(time_us)
    steps = np.diff(time_us)
    usual = int(np.median(steps))
    after = np.flatnonzero(steps > _JUMP * usual) + 1
    which, shown_us = (
        np.insert(which, after, after - 1),
        np.insert(time_us, after, time_us[after] - usual),
    )
    return which, seconds(shown_us)


def _animate(document: Document, time_s: Array, *, moves: bool) -> tuple[list[int], int | None]:
    """An animation that turns every node, and moves the first one.

    Returns where its quaternions belong, and the places of the first node, if it moves.
    """
    times = document.add(time_s)
    outputs = [document.reserve(len(time_s), 4) for _ in NODES]
    samplers = [{"input": times, "output": output} for output in outputs]
    channels: list[dict[str, Any]] = [
        {"sampler": node, "target": {"node": node, "path": "rotation"}} for node in NODES
    ]
    places = document.reserve(len(time_s), 3) if moves else None
    if places is not None:
        channels.append({"sampler": len(samplers), "target": {"node": 0, "path": "translation"}})
        samplers.append({"input": times, "output": places})
    document.about["animations"] = [{"name": "motion", "samplers": samplers, "channels": channels}]
    return outputs, places


def _smooth_signs(q: Array, before: Array) -> Array:
    """The same attitudes, each with the sign that is nearer to the one before."""
    joined = np.concatenate([before, q])
    near = np.sum(joined[1:] * joined[:-1], axis=-1, keepdims=True)
    smooth: Array = q * np.cumprod(np.where(near < 0.0, -1.0, 1.0), axis=0)
    return smooth


def _xyzw(q: Array) -> Array:
    """Scalar last, as glTF has it."""
    return np.roll(q, -1, axis=-1)
