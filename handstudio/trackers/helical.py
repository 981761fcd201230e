"""Helical axes: any motion from one pose to another is a turn about a line and a slide along it.

*Finite* axes join poses whose turn is large enough to tell; as the window shrinks they become
*instantaneous*. Of a joint that rolls they wander; the *mean* axis is the line, and the pivot the
point, nearest to all of them, heavier the further they turn (H. J. Woltring, Hum. Mov. Sci. 10
(1991) 603: ``sum of Q_i (p - s_i) = 0`` with ``Q_i = 1 - n_i n_i^T``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.estimate import (
    UNSEEN_SD_M,
    JointEstimate,
    functional_axis,
    in_lower,
    independent,
    rest_place,
)
from handstudio.trackers.pair import Pair
from handstudio.trackers.plane import Plane

WINDOW_RAD = float(np.deg2rad(15.0))
"""Turn between the two poses of an axis: with 0.1 mm of noise its place is known to 0.5 mm."""

_LEAST_AXES = 10


@dataclass(frozen=True, slots=True, eq=False)
class HelicalAxes:
    """Lines in one terminal's frame, an axis each.

    Attributes:
        direction: Unit vectors.
        point: The point of each line that is nearest to the frame's origin [m].
        angle: Turn about each [rad].
        slide: And slide along it [m].
        first: Index of the frame that each begins with.
    """

    direction: Float[Array, "m 3"]
    point: Float[Array, "m 3"]
    angle: Float[Array, " m"]
    slide: Float[Array, " m"]
    first: Array


def helical_axes(pair: Pair, window: float = WINDOW_RAD) -> HelicalAxes:
    """Of the lower terminal's motion in the upper one's frame, between poses so far apart [rad].

    Raises:
        TrackError: hardly any two poses are.
    """
    flexion = functional_axis(pair)[2]
    first, last = _windows(flexion, window)
    if len(first) < _LEAST_AXES:
        raise TrackError(
            "The joint turned by {window:.0f} deg between {count} pairs of frames; {least} are "
            "needed.",
            "Bend it further and more often.",
            window=float(np.rad2deg(window)),
            count=len(first),
            least=_LEAST_AXES,
        )
    q_first, q_last = pair.q_upper_lower[first], pair.q_upper_lower[last]
    turn = so3.log(so3.multiply(q_last, so3.conjugate(q_first)))
    angle = np.linalg.norm(turn, axis=1)
    direction = turn / angle[:, None]
    # x -> R x + s
    s = pair.t_upper_lower[last] - so3.rotate(so3.exp(turn), pair.t_upper_lower[first])
    slide = np.sum(s * direction, axis=1)
    across = s - slide[:, None] * direction
    half = 0.5 * angle
    point = 0.5 * (across + np.cross(direction, across) / np.tan(half)[:, None])
    return HelicalAxes(direction, point, angle, slide, first)


def mean_helical(pair: Pair, plane: Plane | None = None) -> JointEstimate:
    """The pivot of all axes, in the upper terminal's frame; the other way round in the lower's."""
    middle = rest_place(pair) if plane is None else plane.p1
    there, back = helical_axes(pair), helical_axes(pair.swapped())
    upper, upper_covariance = _pivot(there, middle)
    lower, lower_covariance = _pivot(back, in_lower(pair, middle))
    axis, sd = _mean_axis(there, functional_axis(pair)[0])
    zero = np.zeros(3)
    return JointEstimate(
        "helical",
        upper,
        lower,
        upper_covariance,
        lower_covariance,
        len(pair),
        axis,
        sd,
        zero,
        zero,
    )


def _windows(flexion: Array, window: float) -> tuple[Array, Array]:
    """For every frame the next one that is a window further, either way; within half a swing."""
    n = len(flexion)
    first, last = [], []
    step = max(1, n // 4000)
    for index in range(0, n, step):
        ahead = np.abs(flexion[index + 1 : index + 1 + _AHEAD] - flexion[index])
        far = np.flatnonzero(ahead >= window)
        if len(far):
            first.append(index)
            last.append(index + 1 + int(far[0]))
    return np.array(first, dtype=int), np.array(last, dtype=int)


_AHEAD = 400  # frames: a slow half swing at 240 Hz


def _pivot(axes: HelicalAxes, guess: Array) -> tuple[Array, Array]:
    outer = axes.direction[:, :, None] * axes.direction[:, None, :]
    weight = np.sin(0.5 * axes.angle) ** 2
    across = weight[:, None, None] * (np.eye(3) - outer)
    tie = np.eye(3) / UNSEEN_SD_M**2
    p = guess
    covariance = tie
    for _ in range(3):
        left = np.einsum("nij,nj->ni", np.eye(3) - outer, axes.point - p)
        spread = max(float(np.average(np.sum(left**2, axis=1) / 2.0, weights=weight)), 1e-14)
        precision = independent(left) / weight.sum() / spread
        normal = precision * across.sum(axis=0) + tie
        right = precision * np.einsum("nij,nj->i", across, axes.point) + tie @ guess
        p, covariance = np.linalg.solve(normal, right), np.linalg.inv(normal)
    return p, covariance


def _mean_axis(axes: HelicalAxes, flexion: Array) -> tuple[Array, float]:
    towards = np.where(axes.direction @ flexion < 0.0, -1.0, 1.0)[:, None] * axes.direction
    mean = towards.mean(axis=0)
    mean = mean / np.linalg.norm(mean)
    lean = towards - (towards @ mean)[:, None] * mean
    sd = np.sqrt(np.mean(np.sum(lean**2, axis=1)) / 2.0 / independent(lean))
    return mean, float(sd)
