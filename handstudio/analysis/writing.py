"""What a hand wrote: the trace of a pen on its plane, from the motion of the hand alone.

`pen_grip` finds how the pen moves, `pen_tip` its tip and the plane, `pen_down` its strokes. The
elbow must rest: where it goes nobody sees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.analysis.pen_down import pen_down, strokes
from handstudio.analysis.pen_grip import PenHand, PenMotion, held, pen_motion
from handstudio.analysis.pen_tip import Plane, pen_tip
from handstudio.arrays import Array

_ROUNDS = 2  # tip and plane again from what was found to be strokes
_LEAST_S, _LEAST_M = 0.3, 0.015  # of writing: less is none
_MOST_SD_M = 0.0015  # of the height while it writes: more is no plane
_BROAD, _BROAD_M = 3.0, 0.0008  # what is written spreads so across: in height's SDs, and at all
_LINE_SHARE = 0.5  # of the time a pen is held, at most, goes into a line


@dataclass(frozen=True, slots=True, eq=False)
class Writing:
    """What was written in one go, from taking the pen to laying it down.

    Attributes:
        time_s: Of every instant.
        tip: Of the pen, from the elbow [m].
        direction: Of the pen, from its tip to its end, unit vectors.
        down: Whether it writes.
        plane: Written on.
        axes: On the plane: to the right, and up the page, as whoever writes sees it.
        flat: Place of the tip on the page along these [m], from the middle of what is written.
        origin: That middle, from the elbow [m].
        height_sd_m: Of the tip above the plane while it writes.
        rigid_sd_m: How much the three contacts still move against one another.
        tip_sd_m: How well the tip's place in the pen is known.
    """

    time_s: Float[Array, " n"]
    tip: Float[Array, "n 3"]
    direction: Float[Array, "n 3"]
    down: Bool[Array, " n"]
    plane: Plane
    axes: Float[Array, "2 3"]
    flat: Float[Array, "n 2"]
    origin: Float[Array, "3"]
    height_sd_m: float
    rigid_sd_m: float
    tip_sd_m: Float[Array, "3"]

    @property
    def strokes(self) -> list[slice]:
        """Instants of every stroke."""
        return strokes(self.down)

    @property
    def on_plane(self) -> Float[Array, "n 3"]:
        """The tip brought onto the plane, from the elbow [m]."""
        out: Array = self.origin + self.flat @ self.axes
        return out

    @property
    def length_m(self) -> float:
        """Of all strokes."""
        steps = np.linalg.norm(np.diff(self.flat, axis=0), axis=-1)
        return float(steps[self.down[1:] & self.down[:-1]].sum())


def writings(hand: PenHand) -> list[Writing]:
    """Everything that was written; nothing where no pen was held, or none wrote."""
    found = (_written(hand.part(slice(*stretch))) for stretch in held(hand))
    return [writing for writing in found if writing is not None]


def _written(hand: PenHand) -> Writing | None:
    motion, step_s = pen_motion(hand), float(np.median(np.diff(hand.time_s)))
    found, down = pen_tip(motion), np.ones(len(hand.time_s), dtype=bool)
    axes = _axes(found.plane, found.tip)
    for _ in range(_ROUNDS):
        down = pen_down(found.height_m, found.tip @ axes.T, step_s)
        if down.sum() * step_s < _LEAST_S:
            return None
        found = pen_tip(motion, down.astype(float))
        axes = _axes(found.plane, found.tip)
    axes = _upright(axes, found.tip[down])
    flat = found.tip @ axes.T
    down = pen_down(found.height_m, flat, step_s)
    if not down.any():
        return None
    middle = 0.5 * (flat[down].min(axis=0) + flat[down].max(axis=0))
    writing = Writing(
        time_s=hand.time_s,
        tip=found.tip,
        direction=_direction(motion, found.own),
        down=down,
        plane=found.plane,
        axes=axes,
        flat=flat - middle,
        origin=found.plane.distance_m * found.plane.normal + middle @ axes,
        height_sd_m=float(np.std(found.height_m[down])),
        rigid_sd_m=motion.rigid_sd_m,
        tip_sd_m=found.own_sd_m,
    )
    return writing if _is_writing(writing) else None


def _is_writing(writing: Writing) -> bool:
    """A pen on a desk, not a pinch that happens to move level for a while, or to and fro: a line
    lies in any plane. Whoever draws one holds the pen before and after."""
    across_m = float(np.sqrt(np.linalg.eigvalsh(np.cov(writing.flat[writing.down].T))[0]))
    return (
        writing.length_m > _LEAST_M
        and writing.height_sd_m < _MOST_SD_M
        and (
            across_m > max(_BROAD_M, _BROAD * writing.height_sd_m)
            or float(writing.down.mean()) < _LINE_SHARE
        )
    )


def _direction(motion: PenMotion, own: Array) -> Array:
    direction: Array = -motion.attitude @ (own / np.linalg.norm(own))
    return direction


def _axes(plane: Plane, tip: Array) -> Array:
    """Right and up on the page: up leads away from the elbow."""
    away = tip.mean(axis=0)
    up = away - (away @ plane.normal) * plane.normal
    up = up / np.linalg.norm(up)
    return np.stack([np.cross(up, plane.normal), up])


_LINE, _SLANT = 2.5, np.deg2rad(35.0)  # so much longer than high is a line; paper lies no more so


def _upright(axes: Array, written: Array) -> Array:
    """The same turned so that a line of writing is level; paper may lie at a slant."""
    flat = (written - written.mean(axis=0)) @ axes.T
    spread, directions = np.linalg.eigh(flat.T @ flat)
    x, y = directions[:, 1] * np.sign(directions[0, 1])
    slant = float(np.arctan2(y, x))
    if spread[1] < _LINE**2 * spread[0] or abs(slant) > _SLANT:
        return axes
    cosine, sine = np.cos(slant), np.sin(slant)
    return np.asarray(np.array([[cosine, sine], [-sine, cosine]]) @ axes)
