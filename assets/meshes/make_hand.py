"""Make the surface of a hand around the bones of the average one, `hand.npz` in this folder.

    python assets/meshes/make_hand.py [FOLDER]

The hand is described as a solid, as the bones are by `make_meshes.py`: rods that taper along every
bone, pads and webs that flow into them. It stands a little spread and bent (`SPREAD`), so that
fingers do not touch and that bending and stretching draw on the skin alike. Its surface is found on
a grid (surface nets, `meshing.py`), thinned out where the hand is plain, evened out and drawn back
onto the solid. Last, every point is told which bones carry it,
by how far they are; only bones that are neighbours on the hand share a point.
"""

from __future__ import annotations

import io
import sys
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from make_meshes import Array, Solid, ellipsoid, union
from meshing import drawn_onto, evened, flipped, halved, neighbours, nets, thinned

from handstudio.hand.angles import compose
from handstudio.hand.pose import Pose, posed
from handstudio.hand.rig import BONES, MOST_BONES, rig_of
from handstudio.hand.skeleton import (
    ADULT_HAND_LENGTH_M,
    DISTALS,
    FINGERS,
    PARENTS,
    SEGMENTS,
    nominal_skeleton,
)
from handstudio.maths import so3

H = ADULT_HAND_LENGTH_M
MM = 1e-3
GRID = 3.3 * MM
"""At some widths a cell is crossed twice, and the surface meets itself there: not at this one."""
FEWEST = 0.04
"""Smaller shares than this of a bone are left out."""
DIGITS = 6
"""Coordinates are rounded to a µm, which leaves no room for the last bits of machines."""

# turns about x, z, y [deg] of the joints away from the flat hand; flexion is negative
SPREAD = {
    "index_mcp": (-8.0, 10.0, 0.0),
    "middle_mcp": (-8.0, 1.0, 0.0),
    "ring_mcp": (-8.0, -8.0, 0.0),
    "little_mcp": (-8.0, -17.0, 0.0),
    "thumb_mcp": (-10.0, 0.0, 0.0),
    "thumb_ip": (-12.0, 0.0, 0.0),
    **{f"{finger}_pip": (-18.0, 0.0, 0.0) for finger in FINGERS[1:]},
    **{f"{finger}_dip": (-12.0, 0.0, 0.0) for finger in FINGERS[1:]},
}

SIZE = {"index": 0.94, "middle": 0.96, "ring": 0.91, "little": 0.80}
"""How thick fingers are; drawn by eye."""


# --- the hand as a solid --------------------------------------------------------------------------


def attitudes() -> Array:
    """In which attitude every segment of a right hand stands, (segment, 4)."""
    skeleton, out = nominal_skeleton("right"), np.empty((len(SEGMENTS), 4))
    turns = np.zeros((len(SEGMENTS), 3))
    for index, segment in enumerate(SEGMENTS):
        turns[index] = np.deg2rad(SPREAD.get(_joint_of(segment), (0.0, 0.0, 0.0)))
    for index, parent in enumerate(PARENTS):
        at_rest = so3.multiply(skeleton.q_parent_rest[index], compose(turns[index]))
        out[index] = at_rest if parent < 0 else so3.multiply(out[parent], at_rest)
    return out


def _joint_of(segment: str) -> str:
    finger, _, kind = segment.partition("_")
    names = {
        "proximal": "mcp",
        "intermediate": "pip",
        "distal": "ip" if finger == "thumb" else "dip",
    }
    return f"{finger}_{names.get(kind, kind)}"


class Drawing:
    """Solids that are fixed to the segments of the standing hand."""

    def __init__(self, pose: Pose) -> None:
        self._pose = pose
        skeleton = nominal_skeleton("right")
        self.far = dict(zip(SEGMENTS, skeleton.t_far_end, strict=True))
        self.joint = dict(zip(SEGMENTS, skeleton.t_parent_joint, strict=True))

    def at(self, segment: str, point: Any) -> Array:
        """A point of a segment's frame in the world."""
        index = SEGMENTS.index(segment)
        turned = so3.rotate(self._pose.q_world_segment[index], np.asarray(point, dtype=float))
        place: Array = self._pose.t_world_joint[index] + turned
        return place

    def in_segment(self, segment: str, solid: Solid) -> Solid:
        """A solid of a segment's frame in the world."""
        index = SEGMENTS.index(segment)
        matrix = so3.to_matrix(self._pose.q_world_segment[index])
        return lambda p: solid((p - self._pose.t_world_joint[index]) @ matrix)


def hand(pose: Pose) -> Solid:
    """Forearm, palm, five digits."""
    d = Drawing(pose)
    fingers = [_finger(d, finger) for finger in FINGERS[1:]]
    palm = union(8 * MM, *_metacarpals(d), _carpus(d), _hypothenar(d), *_webs(d))
    thumb = union(12 * MM, union(2.5 * MM, *_thumb(d)), *_thenar(d))
    arm = union(22 * MM, *_forearm(d))
    body = union(10 * MM, arm, union(8 * MM, palm, thumb))
    return union(4 * MM, body, *(union(4 * MM, body, finger) for finger in fingers))


def _finger(d: Drawing, finger: str) -> Solid:
    k, p, i, e = (
        SIZE[finger],
        *(f"{finger}_{kind}" for kind in ("proximal", "intermediate", "distal")),
    )
    lp, li, le = (d.far[segment][1] for segment in (p, i, e))
    tip = 6.6 * MM * k
    return union(
        3 * MM * k,
        d.in_segment(
            p,
            rod((0, 0.1 * lp, -1 * MM), (0, 0.55 * lp, -1 * MM), 9.5 * MM * k, 9.0 * MM * k, 0.95),
        ),
        d.in_segment(
            p, rod((0, 0.5 * lp, -0.8 * MM), (0, lp, -0.3 * MM), 9.1 * MM * k, 9.3 * MM * k, 0.93)
        ),
        d.in_segment(
            i, rod((0, 0, -0.4 * MM), (0, 0.55 * li, -0.8 * MM), 9.3 * MM * k, 8.5 * MM * k, 0.92)
        ),
        d.in_segment(
            i, rod((0, 0.5 * li, -0.8 * MM), (0, li, -0.2 * MM), 8.5 * MM * k, 8.3 * MM * k, 0.9)
        ),
        d.in_segment(e, rod((0, 0, -0.3 * MM), (0, le - tip, -0.6 * MM), 8.2 * MM * k, tip, 0.88)),
        d.in_segment(
            e, ellipsoid((0, 0.50 * le, -2.2 * MM * k), (7.0 * MM * k, 0.32 * le, 5.6 * MM * k))
        ),
    )


def _metacarpals(d: Drawing) -> list[Solid]:
    solids = []
    for finger in FINGERS[1:]:
        block = "hand" if finger in ("index", "middle") else "hand_ulnar"
        end = d.joint[f"{finger}_proximal"]
        k = SIZE[finger]
        start = end * (0.25 if block == "hand" else 0.1)
        low = np.array([0.0, 0.0, -2.2 * MM])
        solids.append(
            d.in_segment(block, rod(start + low, end * 0.98 + low, 11.0 * MM, 12.0 * MM * k, 1.0))
        )
        solids.append(d.in_segment(block, ball(end * 0.985, 9.2 * MM * k)))  # knuckle
    return solids


def _webs(d: Drawing) -> list[Solid]:
    solids = []
    for one, other in pairwise(FINGERS[1:]):
        a, b = (f"{finger}_proximal" for finger in (one, other))
        low = np.array([0.0, 0.0, -2.0 * MM])
        base_a, base_b = d.at(a, low), d.at(b, low)
        end_a, end_b = (d.at(s, 0.31 * d.far[s] + low) for s in (a, b))
        solids += [sheet(base_a, base_b, end_a, 6.0 * MM), sheet(end_a, base_b, end_b, 6.0 * MM)]
    return solids


def _carpus(d: Drawing) -> Solid:
    return d.in_segment(
        "hand", ellipsoid((1.5 * MM, 10 * MM, -3.5 * MM), (24.5 * MM, 34 * MM, 14.5 * MM))
    )


def _hypothenar(d: Drawing) -> Solid:
    end = d.at("little_proximal", (1 * MM, -14 * MM, -5 * MM))
    start = d.at("hand", (19 * MM, 16 * MM, -11 * MM))
    return between(start, end, 11.5 * MM, 9.0 * MM)


def _thumb(d: Drawing) -> list[Solid]:
    m, p, e = (f"thumb_{kind}" for kind in ("metacarpal", "proximal", "distal"))
    lm, lp, le = (d.far[segment][1] for segment in (m, p, e))
    tip = 7.6 * MM
    return [
        d.in_segment(m, rod((0, 0.1 * lm, -2 * MM), (0, lm, -0.5 * MM), 12.0 * MM, 10.3 * MM, 1.0)),
        d.in_segment(
            p, rod((0, 0, -0.5 * MM), (0, 0.55 * lp, -0.8 * MM), 10.3 * MM, 9.3 * MM, 0.95)
        ),
        d.in_segment(p, rod((0, 0.5 * lp, -0.8 * MM), (0, lp, 0), 9.3 * MM, 9.9 * MM, 0.9)),
        d.in_segment(e, rod((0, 0, 0), (0, 0.4 * le, -0.5 * MM), 9.9 * MM, 9.7 * MM, 0.86)),
        d.in_segment(
            e, rod((0, 0.35 * le, -0.5 * MM), (0, le - tip, -0.8 * MM), 9.7 * MM, tip, 0.82)
        ),
        d.in_segment(e, ellipsoid((0, 0.46 * le, -2.5 * MM), (8.6 * MM, 0.34 * le, 6.4 * MM))),
    ]


def _thenar(d: Drawing) -> list[Solid]:
    cmc, mcp = (
        d.at("thumb_metacarpal", (0, 0, -3 * MM)),
        d.at("thumb_proximal", (0, -2 * MM, -1 * MM)),
    )
    index = d.at("hand", 0.80 * d.joint["index_proximal"] + np.array([0, 0, -3 * MM]))
    carpus = d.at("hand", (-8 * MM, 14 * MM, -12 * MM))
    palm = d.at("hand", (-9 * MM, 46 * MM, -10 * MM))
    return [
        sheet(cmc, 0.85 * mcp + 0.15 * cmc, index, 6.5 * MM),
        sheet(carpus, 0.3 * cmc + 0.7 * mcp, palm, 8.0 * MM),
        between(carpus, 0.35 * cmc + 0.65 * mcp, 11.0 * MM, 11.0 * MM),
    ]


def _forearm(d: Drawing) -> list[Solid]:
    length = d.far["forearm"][1]
    return [
        d.in_segment(
            "forearm",
            rod((0, 0.60 * length, 0), (0, 1.02 * length, -5 * MM), 31 * MM, 23 * MM, 0.66),
        ),
        d.in_segment(
            "forearm", rod((0, 0.18 * length, 0), (0, 0.62 * length, 0), 37 * MM, 30 * MM, 0.88)
        ),
    ]


# --- solids ---------------------------------------------------------------------------------------


def rod(start: Any, end: Any, first: float, last: float, flat: float) -> Solid:
    """A rod with round ends that tapers between two points, flattened along z about its axis."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    across = np.cross(along, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    up = np.cross(across, along)
    slope = (first - last) / length
    steep = np.sqrt(1.0 - slope**2)

    def distance(points: Array) -> Array:
        offset = points - start
        y = offset @ along
        r = np.hypot(offset @ across, offset @ up / flat)
        k = steep * y - slope * r
        side = steep * r + slope * y - first
        out: Array = np.where(k < 0.0, np.hypot(r, y) - first, side)
        return np.where(k > steep * length, np.hypot(r, y - length) - last, out) * flat

    return distance


def between(start: Array, end: Array, first: float, last: float) -> Solid:
    """A round rod that tapers between two points."""
    return rod(start, end, first, last, flat=1.0)


def ball(centre: Any, radius: float) -> Solid:
    """A ball."""
    return lambda p: np.linalg.norm(p - np.asarray(centre, dtype=float), axis=-1) - radius


def sheet(a: Array, b: Array, c: Array, half: float) -> Solid:
    """A triangle this thick to either side, its rim round."""
    edges = [(a, b), (b, c), (c, a)]
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)

    def distance(points: Array) -> Array:
        to_rim = np.min([_to_segment(points, p, q) for p, q in edges], axis=0)
        inside = np.all([(points - p) @ np.cross(normal, q - p) >= 0 for p, q in edges], axis=0)
        out: Array = np.where(inside, np.abs((points - a) @ normal), to_rim) - half
        return out

    return distance


def _to_segment(points: Array, start: Array, end: Array) -> Array:
    along = end - start
    share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
    out: Array = np.linalg.norm(points - start - share[:, None] * along, axis=-1)
    return out


# --- its surface ----------------------------------------------------------------------------------


def surface(solid: Solid) -> tuple[Array, Array]:
    """Vertices and faces: surface nets on a fine grid, thinned out where the hand is plain."""
    sides = (-0.100, 0.090), (-0.020, 0.450), (-0.085, 0.056)
    planes = [np.arange(low, high, GRID) for low, high in sides]
    corners = np.stack(np.meshgrid(*planes, indexing="ij"), axis=-1)
    value = solid(corners.reshape(-1, 3)).reshape(corners.shape[:-1])
    vertices, quads = nets(corners, value)
    vertices = drawn_onto(solid, evened(vertices, quads))
    faces = halved(vertices, quads)
    for _ in range(4):
        vertices, faces = thinned(vertices, faces, wanted_edge(vertices))
        faces = flipped(vertices, faces)
        vertices = drawn_onto(solid, evened(vertices, faces))
    return drawn_onto(solid, vertices), faces


def wanted_edge(vertices: Array) -> Array:
    """How long edges should be at a point [m]: short where the digits bend."""
    wrist = nominal_skeleton("right").t_parent_joint[SEGMENTS.index("hand")][1]
    y = vertices[:, 1] - wrist
    along = np.interp(y, (-0.09, -0.02, 0.25 * H, 0.40 * H), (13.0, 6.2, 5.6, 3.9)) * MM
    thumb = np.clip((-0.030 - vertices[:, 0]) / 0.01, 0.0, 1.0) * (y > 0.0)
    out: Array = along + thumb * (np.minimum(along, 4.3 * MM) - along)
    return out


def fitted(vertices: Array, pose: Pose) -> Array:
    """Ends of digits moved to the very tips, by what blending added, less the nearer the joint."""
    out, rig = vertices.copy(), rig_of(nominal_skeleton("right"))
    nearest = _to_bones(vertices, pose).argmin(axis=1)
    for bone, tip in zip(BONES, rig.end, strict=True):
        if bone.segment not in DISTALS:
            continue
        index = SEGMENTS.index(bone.segment)
        own = nearest == BONES.index(bone)
        along = so3.rotate(pose.q_world_segment[index], tip / np.linalg.norm(tip))
        y = (vertices[own] - pose.t_world_joint[index]) @ along
        share = np.clip(y / y.max(), 0.0, 1.0) ** 2
        out[own] += ((np.linalg.norm(tip) - y.max()) * share)[:, None] * along
    return out


def _to_bones(vertices: Array, pose: Pose) -> Array:
    """Distances to every bone, (vertex, bone)."""
    starts, ends = rig_of(nominal_skeleton("right")).ends(pose)
    pairs = zip(starts, ends, strict=True)
    return np.stack([_to_segment(vertices, start, end) for start, end in pairs], axis=1)


# --- which bones carry it -------------------------------------------------------------------------


def weights(vertices: Array, faces: Array, pose: Pose) -> tuple[Array, Array]:
    """Bones that carry each vertex and their shares, (vertex, MOST_BONES) both."""
    distance = _to_bones(vertices, pose)
    nearest = np.argmin(distance, axis=1)
    beyond = distance - distance[np.arange(len(vertices)), nearest][:, None]
    share = np.exp(-((beyond / FALLOFF[nearest][:, None]) ** 2)) * NEIGHBOURS[nearest]
    mean = neighbours(len(vertices), faces)
    for _ in range(3):
        share = share / share.sum(axis=1, keepdims=True)
        share = 0.5 * share + 0.5 * (mean @ share)
    index = np.argsort(-share, axis=1, kind="stable")[:, :MOST_BONES]
    kept = np.take_along_axis(share, index, axis=1)
    kept[kept < FEWEST] = 0.0
    return index, kept / kept.sum(axis=1, keepdims=True)


def _falloff() -> Array:
    palm = {"forearm": 12.0, "hand": 9.0, "hand_ulnar": 9.0, "thumb_metacarpal": 6.0}
    return np.array([palm.get(bone.segment, 2.9) * MM for bone in BONES])


def _are_neighbours() -> Array:
    """Which bones may share a point: of one segment, joined by a joint, or both in the palm."""
    palm = ("forearm", "hand", "hand_ulnar", "thumb_metacarpal")

    def parted(a: str, b: str) -> bool:
        one, other = SEGMENTS.index(a), SEGMENTS.index(b)
        joined = PARENTS[one] == other or PARENTS[other] == one
        return not (a == b or joined or (a in palm and b in palm))

    may = np.array([[not parted(a.segment, b.segment) for b in BONES] for a in BONES])
    for i, a in enumerate(BONES):  # a finger knows its own bone of the palm
        for j, b in enumerate(BONES):
            if a.segment.endswith("proximal") and b.segment in ("hand", "hand_ulnar"):
                may[i, j] = may[j, i] = a.finger == b.finger
    return may.astype(float)


FALLOFF = _falloff()
NEIGHBOURS = _are_neighbours()


# --- the file -------------------------------------------------------------------------------------


def make() -> dict[str, Array]:
    """Everything that is in the file, by name."""
    standing = posed(nominal_skeleton("right"), attitudes())
    vertices, faces = surface(hand(standing))
    vertices = fitted(vertices, standing)
    index, share = weights(vertices, faces, standing)
    return {
        "vertices": np.round(vertices, DIGITS).astype(np.float32),
        "faces": faces.astype(np.uint16),
        "bones": index.astype(np.uint8),
        "weights": np.round(share * 255).astype(np.uint8),
        "q_world_segment": attitudes(),
    }


def write(folder: Path) -> None:
    """Write the file; the same content gives the same bytes."""
    made = make()
    with zipfile.ZipFile(folder / "hand.npz", "w", zipfile.ZIP_DEFLATED) as packed:
        for name, array in made.items():
            content = io.BytesIO()
            np.save(content, array)
            packed.writestr(
                zipfile.ZipInfo(f"{name}.npy"), content.getvalue(), zipfile.ZIP_DEFLATED
            )
    size = (folder / "hand.npz").stat().st_size
    print(f"{len(made['vertices'])} vertices, {len(made['faces'])} faces, {size / 1000:.0f} kB")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
