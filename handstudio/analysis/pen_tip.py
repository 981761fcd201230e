"""Where a pen's tip is, and the plane it writes on: both from the take alone.

While a pen writes, its tip stays on one plane however the pen leans. So the place of the tip in
the pen and the plane are those that put the most instants on the plane; instants at which the pen
is lifted count for nothing. What this leaves open, leaning on the index finger's base tells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.analysis.pen_grip import PenMotion
from handstudio.arrays import Array

_TIP_M, _TIP_SD_M = 0.030, 0.003  # from the contacts to the tip, and how sure we are; ours
_LEVEL_SD, _TILT_SD = np.deg2rad([2.0, 10.0])  # of a desk; of the first guess of another plane
_BETTER = 1.5  # a plane that is no desk must have so many times as much written on it
_SCALES_M = (*(4e-3,) * 5, *(2e-3,) * 5, *(1e-3,) * 5, *(5e-4,) * 10)  # what is near, step by step
_SD_M, _COUNTED = 0.0005, 50.0  # of a height on paper; instants that tell as one fit
_STEEPEST = np.cos(np.deg2rad(60.0))
_UP = np.array([0.0, 0.0, 1.0])
_GUESS_SCALES_M = (*(5e-3,) * 10, *(2e-3,) * 10)


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """A plane in the world: points x with ``normal @ x == distance_m``, the normal pointing up."""

    normal: Float[Array, "3"]
    distance_m: float

    def height(self, points: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
        """Of points above it [m]."""
        out: Array = points @ self.normal - self.distance_m
        return out


@dataclass(frozen=True, slots=True, eq=False)
class PenTip:
    """The tip of a pen.

    Attributes:
        own: Its place in the pen, from the middle of the contacts [m].
        own_sd_m: How well that is known, along its axes.
        plane: What it writes on.
        tip: Its place, from the elbow [m].
    """

    own: Float[Array, "3"]
    own_sd_m: Float[Array, "3"]
    plane: Plane
    tip: Float[Array, "n 3"]

    @property
    def height_m(self) -> Float[Array, " n"]:
        """Above the paper [m]."""
        return self.plane.height(self.tip)


def pen_tip(motion: PenMotion, weight: Float[Array, " n"] | None = None) -> PenTip:
    """Tip and plane.

    Args:
        motion: Of the pen, for as long as it is held.
        weight: 1 where it is known to write, 0 where it does not; by height alone unless told.
    """
    known = np.ones(len(motion.middle)) if weight is None else weight
    guess = _guess(_tips(motion, _TIP_M * motion.leans), known)
    level = Plane(_UP, float(np.median(_tips(motion, _TIP_M * motion.leans)[known > 0.0, 2])))
    on_desk, on_other = _fit(motion, known, level, _LEVEL_SD), _fit(motion, known, guess, _TILT_SD)
    more = _written(on_other, known) > _BETTER * _written(on_desk, known)
    # a steep one is what the hand crossed on its way to the paper
    return on_other if more and on_other.plane.normal[2] > _STEEPEST else on_desk


def _fit(motion: PenMotion, known: Array, plane: Plane, tilt_sd: float) -> PenTip:
    """Tip and plane, from a plane nearby that is known that well."""
    own = usual = _TIP_M * motion.leans
    meant, spread = plane.normal, np.zeros((6, 6))
    for scale in _SCALES_M:
        tip = _tips(motion, own)
        height = plane.height(tip)
        counts = known * _near(height / scale)
        counts = counts / (_SD_M**2 * max(1.0, counts.sum() / _COUNTED))
        across = _across(plane.normal)
        # how a height changes with the tip in the pen, two tilts of the plane, and its distance
        own_slope = np.swapaxes(motion.attitude, 1, 2) @ plane.normal
        slopes = np.concatenate([own_slope, tip @ across.T, np.full((len(tip), 1), -1.0)], axis=1)
        information = slopes.T @ (slopes * counts[:, None])
        information[range(5), range(5)] += [_TIP_SD_M**-2] * 3 + [tilt_sd**-2] * 2
        pull = -slopes.T @ (counts * height)
        pull[:3] += (usual - own) / _TIP_SD_M**2
        pull[3:5] += across @ meant / tilt_sd**2
        spread = np.linalg.inv(information)
        step = spread @ pull
        own = own + step[:3]
        normal = plane.normal + step[3:5] @ across
        plane = Plane(normal / np.linalg.norm(normal), plane.distance_m + float(step[5]))
    return PenTip(own, np.sqrt(np.diag(spread)[:3]), plane, _tips(motion, own))


def _written(found: PenTip, known: Array) -> float:
    """How many instants lie on the plane."""
    return float(known @ _near(found.height_m / _SCALES_M[-1]))


def _tips(motion: PenMotion, own: Array) -> Array:
    tips: Array = motion.middle + motion.attitude @ own
    return tips


def _near(height: Array) -> Array:
    """Weights of S. Geman and D. McClure: what is far counts for nothing."""
    weights: Array = 1.0 / (1.0 + height**2) ** 2
    return weights


def _guess(tips: Array, known: Array) -> Plane:
    """A plane through most of these points, no steeper than 45 degrees or so."""
    rows = np.concatenate([tips[:, :2], np.ones((len(tips), 1))], axis=1)
    weight, found = known, np.zeros(3)
    for scale in _GUESS_SCALES_M:
        root = np.sqrt(weight)
        found = np.linalg.lstsq(rows * root[:, None], tips[:, 2] * root)[0]
        weight = known * _near((tips[:, 2] - rows @ found) / scale)
    length = float(np.hypot(1.0, np.hypot(found[0], found[1])))
    return Plane(np.array([-found[0], -found[1], 1.0]) / length, float(found[2]) / length)


def _across(normal: Array) -> Array:
    """Two directions in a plane."""
    x = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(normal, x)])
