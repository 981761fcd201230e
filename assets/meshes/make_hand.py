"""Make the surface of a hand around the bones of the average one, `hand.npz` in this folder.

    python assets/meshes/make_hand.py [FOLDER]

The hand is described as a solid, as the bones are by `make_meshes.py`: rods that taper along every
bone, pads and webs that flow into them. It stands a little spread and bent (`SPREAD`), so that
fingers do not touch and that bending and stretching draw on the skin alike. Its surface is found on
a grid that is finer where the digits are (surface nets: one point in every cell that the surface
crosses), evened out and drawn back onto the solid. Last, every point is told which bones carry it,
by how far they are; only bones that are neighbours on the hand share a point.
"""

from __future__ import annotations

import io
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy import sparse

from handstudio.hand.angles import compose
from handstudio.hand.pose import Pose, posed
from handstudio.hand.rig import BONES, MOST_BONES, rig_of
from handstudio.hand.skeleton import (
    ADULT_HAND_LENGTH_M,
    FINGERS,
    PARENTS,
    SEGMENTS,
    nominal_skeleton,
)
from handstudio.maths import so3

Array: TypeAlias = np.ndarray[Any, Any]
Solid: TypeAlias = Callable[[Array], Array]
"""Points ``(n, 3)`` in the world [m] to signed distances ``(n)``, negative inside."""

H = ADULT_HAND_LENGTH_M
MM = 1e-3
GRID = 3.2 * MM
SHORT, LONG = 0.80, 1.40
"""Edges shorter than this share of the length that is wanted are drawn together, unless that makes
one longer than that."""
SHARP_RAD = 0.55
"""Angles below this are worth turning an edge for."""
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
"""How thick fingers are; drawn, after pictures of hands and the breadths of Greiner 1991."""


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
    names = {"proximal": "mcp", "intermediate": "pip", "distal": "ip" if finger == "thumb" else "dip"}
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
    k, p, i, e = SIZE[finger], *(f"{finger}_{kind}" for kind in ("proximal", "intermediate", "distal"))
    lp, li, le = (d.far[segment][1] for segment in (p, i, e))
    tip = 6.6 * MM * k
    return union(
        3 * MM * k,
        d.in_segment(p, rod((0, 0.1 * lp, -1 * MM), (0, 0.55 * lp, -1 * MM), 9.5 * MM * k, 9.0 * MM * k, 0.95)),
        d.in_segment(p, rod((0, 0.5 * lp, -0.8 * MM), (0, lp, -0.3 * MM), 9.1 * MM * k, 9.3 * MM * k, 0.93)),
        d.in_segment(i, rod((0, 0, -0.4 * MM), (0, 0.55 * li, -0.8 * MM), 9.3 * MM * k, 8.5 * MM * k, 0.92)),
        d.in_segment(i, rod((0, 0.5 * li, -0.8 * MM), (0, li, -0.2 * MM), 8.5 * MM * k, 8.3 * MM * k, 0.9)),
        d.in_segment(e, rod((0, 0, -0.3 * MM), (0, le - tip, -0.6 * MM), 8.2 * MM * k, tip, 0.88)),
        d.in_segment(e, ellipsoid((0, 0.55 * le, -2.2 * MM * k), (7.0 * MM * k, 0.34 * le, 5.6 * MM * k))),
    )


def _metacarpals(d: Drawing) -> list[Solid]:
    solids = []
    for finger in FINGERS[1:]:
        block = "hand" if finger in ("index", "middle") else "hand_ulnar"
        end = d.joint[f"{finger}_proximal"]
        k = SIZE[finger]
        start = end * (0.25 if block == "hand" else 0.1)
        low = np.array([0.0, 0.0, -2.2 * MM])
        solids.append(d.in_segment(block, rod(start + low, end * 0.98 + low, 11.0 * MM, 12.0 * MM * k, 1.0)))
        solids.append(d.in_segment(block, ball(end * 0.985, 9.2 * MM * k)))  # knuckle
    return solids


def _webs(d: Drawing) -> list[Solid]:
    solids = []
    for one, other in zip(FINGERS[1:-1], FINGERS[2:], strict=True):
        a, b = (f"{finger}_proximal" for finger in (one, other))
        low = np.array([0.0, 0.0, -2.0 * MM])
        base_a, base_b = d.at(a, low), d.at(b, low)
        end_a, end_b = (d.at(s, 0.31 * d.far[s] + low) for s in (a, b))
        solids += [sheet(base_a, base_b, end_a, 6.0 * MM), sheet(end_a, base_b, end_b, 6.0 * MM)]
    return solids


def _carpus(d: Drawing) -> Solid:
    return d.in_segment("hand", ellipsoid((1.5 * MM, 10 * MM, -3.5 * MM), (24.5 * MM, 34 * MM, 14.5 * MM)))


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
        d.in_segment(p, rod((0, 0, -0.5 * MM), (0, 0.55 * lp, -0.8 * MM), 10.3 * MM, 9.3 * MM, 0.95)),
        d.in_segment(p, rod((0, 0.5 * lp, -0.8 * MM), (0, lp, 0), 9.3 * MM, 9.9 * MM, 0.9)),
        d.in_segment(e, rod((0, 0, 0), (0, 0.4 * le, -0.5 * MM), 9.9 * MM, 9.7 * MM, 0.86)),
        d.in_segment(e, rod((0, 0.35 * le, -0.5 * MM), (0, le - tip, -0.8 * MM), 9.7 * MM, tip, 0.82)),
        d.in_segment(e, ellipsoid((0, 0.5 * le, -2.5 * MM), (8.6 * MM, 0.4 * le, 6.4 * MM))),
    ]


def _thenar(d: Drawing) -> list[Solid]:
    cmc, mcp = d.at("thumb_metacarpal", (0, 0, -3 * MM)), d.at("thumb_proximal", (0, -2 * MM, -1 * MM))
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
        d.in_segment("forearm", rod((0, 0.60 * length, 0), (0, 1.02 * length, -5 * MM), 31 * MM, 23 * MM, 0.66)),
        d.in_segment("forearm", rod((0, 0.18 * length, 0), (0, 0.62 * length, 0), 37 * MM, 30 * MM, 0.88)),
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


def ellipsoid(centre: Any, radii: Any) -> Solid:
    """An ellipsoid with axes along x, y and z; the distance is near its surface only."""
    middle, half = np.asarray(centre, dtype=float), np.asarray(radii, dtype=float)

    def distance(points: Array) -> Array:
        inner = np.linalg.norm((points - middle) / half, axis=-1)
        slope = np.linalg.norm((points - middle) / half**2, axis=-1)
        out: Array = np.where(slope > 1.0, inner * (inner - 1.0) / np.maximum(slope, 1.0), -half.min())
        return out

    return distance


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


def union(blend: float, *solids: Solid) -> Solid:
    """All solids together, flowing into one another over a width of about ``blend``."""

    def distance(points: Array) -> Array:
        total = solids[0](points)
        for solid in solids[1:]:
            other = solid(points)
            near = np.maximum(blend - np.abs(total - other), 0.0) / blend
            total = np.minimum(total, other) - near**2 * blend / 4
        return total

    return distance


# --- its surface ----------------------------------------------------------------------------------


def surface(solid: Solid) -> tuple[Array, Array]:
    """Vertices and faces: surface nets on a fine grid, thinned out where the hand is plain."""
    sides = (-0.100, 0.090), (-0.020, 0.450), (-0.085, 0.056)
    planes = [np.arange(low, high, GRID) for low, high in sides]
    corners = np.stack(np.meshgrid(*planes, indexing="ij"), axis=-1)
    value = solid(corners.reshape(-1, 3)).reshape(corners.shape[:-1])
    vertices, quads = nets(corners, value)
    vertices = _onto(solid, _evened(vertices, quads))
    faces = _halved(vertices, quads)
    for _ in range(4):
        vertices, faces = thinned(vertices, faces, wanted_edge(vertices))
        faces = flipped(vertices, faces)
        vertices = _onto(solid, _evened(vertices, faces))
    return _onto(solid, vertices), faces


def wanted_edge(vertices: Array) -> Array:
    """How long edges should be at a point [m]: short where the digits bend."""
    wrist = nominal_skeleton("right").t_parent_joint[SEGMENTS.index("hand")][1]
    y = vertices[:, 1] - wrist
    along = np.interp(y, (-0.09, -0.02, 0.25 * H, 0.40 * H), (13.0, 6.2, 5.6, 3.9)) * MM
    thumb = np.clip((-0.030 - vertices[:, 0]) / 0.01, 0.0, 1.0) * (y > 0.0)
    out: Array = along + thumb * (np.minimum(along, 4.3 * MM) - along)
    return out


def thinned(vertices: Array, faces: Array, wanted: Array) -> tuple[Array, Array]:
    """Edges much shorter than wanted are drawn together, the shortest first."""
    place, size = vertices.copy(), wanted
    fan: list[set[int]] = [set() for _ in vertices]
    corners: list[tuple[int, int, int] | None] = [tuple(face) for face in faces.tolist()]
    for number, face in enumerate(faces.tolist()):
        for vertex in face:
            fan[vertex].add(number)
    edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    share = np.linalg.norm(place[edges[:, 0]] - place[edges[:, 1]], axis=1) / size[edges].mean(axis=1)
    moved: set[int] = set()
    for number in np.argsort(share, kind="stable"):
        if share[number] > SHORT:
            break
        a, b = edges[number].tolist()
        if a in moved or b in moved:
            continue
        around = [{v for f in fan[x] for v in corners[f] or ()} - {x} for x in (a, b)]
        if len(around[0] & around[1]) != 2 or len(around[0] | around[1]) > 11:
            continue
        middle = (place[a] + place[b]) / 2
        ring = (around[0] | around[1]) - {a, b}
        if max(np.linalg.norm(place[v] - middle) / size[v] for v in ring) > LONG:
            continue
        if not all(_stays(place, corners[f], (a, b), middle) for f in fan[a] ^ fan[b]):
            continue
        place[a] = middle
        for f in fan[a] & fan[b]:
            for v in corners[f] or ():
                if v not in (a, b):
                    fan[v].discard(f)
            corners[f] = None
        for f in fan[b]:
            old = corners[f]
            if old is not None:
                corners[f] = tuple(a if v == b else v for v in old)  # type: ignore[assignment]
                fan[a].add(f)
        fan[a] = {f for f in fan[a] if corners[f] is not None}
        fan[b] = set()
        moved |= {a, b}
    left = np.array([face for face in corners if face is not None])
    used = np.unique(left)
    number_of = np.full(len(place), -1)
    number_of[used] = np.arange(len(used))
    return place[used], number_of[left]


def _stays(place: Array, face: Any, ends: tuple[int, int], middle: Array) -> bool:
    """Whether a face keeps its side when the ends of an edge meet in the middle."""
    before = place[list(face)]
    after = np.array([middle if v in ends else place[v] for v in face])
    normals = [np.cross(c[1] - c[0], c[2] - c[0]) for c in (before, after)]
    lengths = [float(np.linalg.norm(normal)) for normal in normals]
    return bool(normals[0] @ normals[1] > 0.5 * lengths[0] * lengths[1])


def flipped(vertices: Array, faces: Array) -> Array:
    """Edges are turned within their two faces where that opens the sharpest angle."""
    out = faces.copy()
    side: dict[tuple[int, int], int] = {}
    for number, (a, b, c) in enumerate(out.tolist()):
        side[a, b] = side[b, c] = side[c, a] = number
    sharp = set(np.flatnonzero(_angles(vertices[faces]).min(axis=1) < SHARP_RAD).tolist())
    for a, b in [edge for edge, number in side.items() if number in sharp]:
        if (a, b) not in side or (b, a) not in side:
            continue  # was turned away
        one, other = side[a, b], side[b, a]
        c, d = (int(sum(out[f]) - a - b) for f in (one, other))
        if (c, d) in side or (d, c) in side:
            continue
        now, then = ((a, b, c), (b, a, d)), ((c, d, b), (d, c, a))
        if _sharpest(vertices, then) <= _sharpest(vertices, now) + 0.02:
            continue
        out[one], out[other] = then
        del side[a, b], side[b, a]
        for face, number in zip(then, (one, other), strict=True):
            for i in range(3):
                side[face[i], face[(i + 1) % 3]] = number
    return out


def _sharpest(vertices: Array, faces: Any) -> float:
    """The smallest angle of two faces [rad]; none where they fold onto one another."""
    corner = vertices[np.array(faces)]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    if normal[0] @ normal[1] < 0.7 * np.linalg.norm(normal[0]) * np.linalg.norm(normal[1]):
        return 0.0
    return float(_angles(corner).min())


def _angles(corner: Array) -> Array:
    """Angles of triangles [rad], (face, 3)."""
    edge = np.roll(corner, -1, axis=1) - corner
    edge /= np.linalg.norm(edge, axis=-1, keepdims=True)
    cosine = -np.sum(edge * np.roll(edge, 1, axis=1), axis=-1)
    out: Array = np.arccos(np.clip(cosine, -1.0, 1.0))
    return out


def nets(corners: Array, value: Array) -> tuple[Array, Array]:
    """Surface nets: a vertex a cell that is crossed, a quad an edge of the grid that is."""
    inside = value < 0.0
    cells = tuple(n - 1 for n in value.shape)
    total, count = np.zeros((*cells, 3)), np.zeros(cells)
    quads: list[Array] = []
    for axis in range(3):
        low = _cut(value.ndim, axis, slice(None, -1))
        high = _cut(value.ndim, axis, slice(1, None))
        crossed = np.argwhere(inside[low] != inside[high])
        crossed = crossed[(crossed[:, [k for k in range(3) if k != axis]] > 0).all(axis=1)]
        a, b = tuple(crossed.T), tuple((crossed + np.eye(3, dtype=int)[axis]).T)
        share = (value[a] / (value[a] - value[b]))[:, None]
        point = corners[a] + share * (corners[b] - corners[a])
        u, v = (np.eye(3, dtype=int)[(axis + k) % 3] for k in (1, 2))
        around = [crossed, crossed - u, crossed - u - v, crossed - v]
        for cell in around:
            np.add.at(total, tuple(cell.T), point)
            np.add.at(count, tuple(cell.T), 1.0)
        names = np.stack([np.ravel_multi_index(tuple(cell.T), cells) for cell in around], axis=1)
        quads.append(np.where(inside[a][:, None], names, names[:, ::-1]))
    used = np.flatnonzero(count.ravel())
    number = np.full(count.size, -1)
    number[used] = np.arange(len(used))
    vertices = total.reshape(-1, 3)[used] / count.ravel()[used, None]
    return vertices, number[np.concatenate(quads)]


def _cut(dims: int, axis: int, part: slice) -> tuple[slice, ...]:
    return tuple(part if k == axis else slice(None) for k in range(dims))


def _neighbours(count: int, faces: Array) -> Any:
    """Rows of a sparse matrix that average over the neighbours of each vertex."""
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    ones = np.ones(2 * len(a))
    link = sparse.csr_matrix((ones, (np.r_[a, b], np.r_[b, a])), shape=(count, count))
    link.data[:] = 1.0
    return sparse.diags(1.0 / np.asarray(link.sum(axis=1)).ravel()) @ link


def _evened(vertices: Array, faces: Array) -> Array:
    out: Array = 0.5 * vertices + 0.5 * (_neighbours(len(vertices), faces) @ vertices)
    return out


def _onto(solid: Solid, vertices: Array, steps: int = 1) -> Array:
    """Newton's way onto the surface along the solid's slope."""
    reach = 0.05 * MM
    for _ in range(steps):
        slope = np.stack(
            [(solid(vertices + reach * e) - solid(vertices - reach * e)) / (2 * reach) for e in np.eye(3)],
            axis=-1,
        )
        square = np.maximum((slope**2).sum(axis=-1), 0.25)
        vertices = vertices - (solid(vertices) / square)[:, None] * slope
    return vertices


def _halved(vertices: Array, quads: Array) -> Array:
    """Two triangles a quad, along its shorter diagonal."""
    corner = vertices[quads]
    first = np.linalg.norm(corner[:, 0] - corner[:, 2], axis=-1)
    other = np.linalg.norm(corner[:, 1] - corner[:, 3], axis=-1)
    quads = np.where((first <= other)[:, None], quads, np.roll(quads, -1, axis=1))
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


# --- which bones carry it -------------------------------------------------------------------------


def weights(vertices: Array, faces: Array, pose: Pose) -> tuple[Array, Array]:
    """Bones that carry each vertex and their shares, (vertex, MOST_BONES) both."""
    rig = rig_of(nominal_skeleton("right"))
    starts, ends = rig.ends(pose)
    distance = np.stack([_to_segment(vertices, a, b) for a, b in zip(starts, ends, strict=True)], axis=1)
    nearest = np.argmin(distance, axis=1)
    beyond = distance - distance[np.arange(len(vertices)), nearest][:, None]
    share = np.exp(-((beyond / FALLOFF[nearest][:, None]) ** 2)) * NEIGHBOURS[nearest]
    mean = _neighbours(len(vertices), faces)
    for _ in range(3):
        share = share / share.sum(axis=1, keepdims=True)
        share = 0.5 * share + 0.5 * (mean @ share)
    index = np.argsort(-share, axis=1, kind="stable")[:, :MOST_BONES]
    kept = np.take_along_axis(share, index, axis=1)
    kept[kept < 0.01] = 0.0
    return index, kept / kept.sum(axis=1, keepdims=True)


def _falloff() -> Array:
    palm = {"forearm": 12.0, "hand": 9.0, "hand_ulnar": 9.0, "thumb_metacarpal": 6.0}
    return np.array([palm.get(bone.segment, 3.2) * MM for bone in BONES])


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
            packed.writestr(zipfile.ZipInfo(f"{name}.npy"), content.getvalue(), zipfile.ZIP_DEFLATED)
    size = (folder / "hand.npz").stat().st_size
    print(f"{len(made['vertices'])} vertices, {len(made['faces'])} faces, {size / 1000:.0f} kB")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
