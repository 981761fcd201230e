"""A terminal made of markers: the pose of a rigid cluster, some of them out of sight.

The rotation is Kabsch's (Acta Cryst. A 34 (1978) 827) by singular values, without mirroring. The
cluster's own frame: the origin is the mean of its markers, x from the first marker to the second,
z square to the plane of the first three.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int64

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.track import Track

LEAST_MARKERS = 3
_THINNEST_M = 0.003
"""A cluster whose markers lie nearer to one line turns about it unseen."""

_OFF_M = 0.004  # RMS misfit at which a pose is worth nothing: a marker taken for another


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """Markers that move together, in their own frame.

    Attributes:
        name: Of the terminal.
        markers: Their names.
        t_cluster_marker: Their places [m].
    """

    name: str
    markers: tuple[str, ...]
    t_cluster_marker: Float[Array, "m 3"]

    def __post_init__(self) -> None:
        _wide_enough(self.name, self.markers, self.t_cluster_marker)


def cluster_of(
    name: str, markers: tuple[str, ...], t_room_marker: Float[Array, "n m 3"]
) -> Cluster:
    """A cluster's shape from a recording of it: the middle of all frames that show it whole.

    Raises:
        TrackError: too few markers, too nearly in a row, or never seen together.
    """
    whole = np.isfinite(t_room_marker).all(axis=(1, 2))
    if len(markers) < LEAST_MARKERS or not whole.any():
        raise TrackError(
            "{name}: {count} markers, seen together in {frames} frames; 3 markers, 1 frame are "
            "needed.",
            "Put three or more markers on it, not in a row, and show them all for a moment.",
            name=name,
            count=len(markers),
            frames=int(np.count_nonzero(whole)),
        )
    places = t_room_marker[whole]
    shape = places[0] - places[0].mean(axis=0)
    _wide_enough(name, markers, shape)
    for _ in range(3):  # every frame laid over the shape so far, then the median of all
        q, t, _ = _laid(shape, places, np.ones(places.shape[:2], dtype=bool))
        back = so3.rotate(so3.conjugate(q)[:, None], places - t[:, None])
        shape = np.median(back, axis=0)
        shape = shape - shape.mean(axis=0)
    x = shape[1] - shape[0]
    z = np.cross(x, shape[2] - shape[0])
    if np.linalg.norm(z) < 1e-12:  # the first three in a row, others not
        z = np.linalg.svd(shape)[2][2]
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return Cluster(name, markers, shape @ np.stack([x, np.cross(z, x), z], axis=1))


def track_of(
    cluster: Cluster, time_us: Int64[Array, " n"], t_room_marker: Float[Array, "n m 3"]
) -> Track:
    """Poses of a cluster; NaN where fewer than three markers were seen, or those in a row.

    The quality falls from 1 with the misfit of the markers, to 0.02 at 4 mm.

    Raises:
        TrackError: in most frames the markers are the cluster's mirror image.
    """
    seen: Array = np.asarray(np.isfinite(t_room_marker).all(axis=2))
    enough = _spans(cluster.t_cluster_marker, seen)
    n = len(time_us)
    t, q, quality = np.full((n, 3), np.nan), np.full((n, 4), np.nan), np.zeros(n)
    if enough.any():
        places = np.where(seen[..., None], t_room_marker, 0.0)[enough]
        q[enough], t[enough], misfit = _laid(cluster.t_cluster_marker, places, seen[enough])
        _not_mirrored(cluster, places, seen[enough], misfit)
        quality[enough] = np.exp(-((2.0 * misfit / _OFF_M) ** 2))
    return Track(cluster.name, time_us, t, q, quality)


def _laid(
    shape: Array, places: Array, seen: Array, mirror: float = 1.0
) -> tuple[Array, Array, Array]:
    weight = seen.astype(float)[..., None]
    count = weight.sum(axis=1)
    mine = (weight * shape).sum(axis=1) / count
    theirs = (weight * places).sum(axis=1) / count
    a, b = weight * (shape - mine[:, None]), weight * (places - theirs[:, None])
    u, _, vt = np.linalg.svd(np.swapaxes(b, 1, 2) @ a)
    sign = np.ones((len(places), 3))
    sign[:, 2] = mirror * np.sign(np.linalg.det(u @ vt))
    turned = (u * sign[:, None]) @ vt
    left = b - a @ np.swapaxes(turned, 1, 2)
    misfit = np.sqrt((left**2).sum(axis=(1, 2)) / count[:, 0])
    t = theirs - (turned @ mine[..., None])[..., 0]
    if mirror < 0.0:
        turned = -turned
    return so3.from_matrix(turned), t, misfit


def _spans(shape: Array, seen: Array) -> Bool[Array, " n"]:
    """Whether enough markers are seen, well off one line."""
    spans: Array = np.zeros(len(seen), dtype=bool)
    for which in np.unique(seen, axis=0):
        if np.count_nonzero(which) >= LEAST_MARKERS:
            spans[(seen == which).all(axis=1)] = _thickness(shape[which]) >= _THINNEST_M
    return spans


def _thickness(shape: Array) -> float:
    """RMS distance of points from the line nearest to them [m]."""
    singular = np.linalg.svd(shape - shape.mean(axis=0), compute_uv=False)
    return float(np.sqrt(np.sum(singular[1:] ** 2) / len(shape)))


def _wide_enough(name: str, markers: tuple[str, ...], shape: Array) -> None:
    thickness = _thickness(shape) if len(markers) >= LEAST_MARKERS else 0.0
    if thickness < _THINNEST_M:
        raise TrackError(
            "{name}: its {count} markers lie {found:.1f} mm off one line; {least:.0f} mm are "
            "needed to tell how it is turned.",
            "Put three or more markers on it, well off one line.",
            name=name,
            count=len(markers),
            found=1e3 * thickness,
            least=1e3 * _THINNEST_M,
        )


def _not_mirrored(cluster: Cluster, places: Array, seen: Array, misfit: Array) -> None:
    """A cluster off one plane cannot be taken for its mirror image unless markers are exchanged."""
    if np.median(misfit) < _OFF_M / 2.0:
        return
    mirrored = _laid(cluster.t_cluster_marker, places, seen, mirror=-1.0)[2]
    if np.median(mirrored) < np.median(misfit) / 2.0:
        raise TrackError(
            "{name}: what was seen is its mirror image: markers are off by {found:.1f} mm, and "
            "mirrored by {mirrored:.1f} mm.",
            "Check the names of its markers, and that the axes of the file are right-handed.",
            name=cluster.name,
            found=1e3 * float(np.median(misfit)),
            mirrored=1e3 * float(np.median(mirrored)),
        )
