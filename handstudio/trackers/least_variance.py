"""The seed's joint: the point of one terminal whose distance from the other varies least.

For a point p fixed to the upper terminal, ``d_i = |p - t_i|`` is its distance from the lower
terminal in frame i; the joint is where the variance of d over all frames is least (seed, eq. 1 and
2). Likewise the other way round. Along the axis of a hinge the variance says nothing, so the search
is restricted to a plane (0045 to 0074): ``p = P1 + s (P2 - P1) + t (P3 - P1)``, by Nelder and
Mead's simplex, from the foot of the perpendicular of a rough guess (eq. 4, 6 to 9).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.trackers.estimate import (
    UNSEEN_SD_M,
    JointEstimate,
    functional_axis,
    in_lower,
    independent,
    no_axis,
    rest_place,
)
from handstudio.trackers.pair import Pair
from handstudio.trackers.plane import Plane, middle_plane

_TRIES = 60
_STEP_M = 2e-3


def least_variance(pair: Pair, plane: Plane | None = None) -> JointEstimate:
    """Anywhere in space (0038 to 0044), by Gauss and Newton's way.

    What the variance does not tell, a hinge's place along its axis, stays near the guess half way
    between the terminals; the covariance says so.
    """
    back = pair.swapped()
    guess = rest_place(pair)
    upper = _point(pair.t_upper_lower, guess)
    lower = _point(back.t_upper_lower, in_lower(pair, guess))
    return _estimate("variance", pair, upper, lower)


def in_plane(pair: Pair, plane: Plane | None = None) -> JointEstimate:
    """In a plane, the finger's middle one unless given, by Nelder and Mead's way."""
    plane = middle_plane(pair) if plane is None else plane
    back = pair.swapped()
    guess = rest_place(pair)
    upper = _in_plane(pair.t_upper_lower, plane, guess)
    other = Plane(*(in_lower(pair, corner) for corner in plane.corners))
    lower = _in_plane(back.t_upper_lower, other, in_lower(pair, guess))
    return _estimate("plane", pair, upper, lower)


def variance(t: Float[Array, "n 3"], p: Float[Array, "3"]) -> float:
    """Of the distance between a point and the other terminal [m²] (eq. 2)."""
    return float(np.var(np.linalg.norm(p - t, axis=1)))


def _estimate(
    method: str, pair: Pair, upper: tuple[Array, Array], lower: tuple[Array, Array]
) -> JointEstimate:
    zero = np.zeros(3)
    axis, sd = no_axis() if len(pair) < 3 else functional_axis(pair)[:2]
    return JointEstimate(
        method, upper[0], lower[0], upper[1], lower[1], len(pair), axis, sd, zero, zero
    )


def _point(t: Array, guess: Array) -> tuple[Array, Array]:
    """The point and its covariance; a weak tie to the guess where distances say nothing."""
    p = guess
    for _ in range(_TRIES):
        left, slopes = _left(t, p)
        weight = _weight(left)
        tie = np.eye(3) / UNSEEN_SD_M**2
        normal = weight * slopes.T @ slopes + tie
        step = -np.linalg.solve(normal, weight * slopes.T @ left + tie @ (p - guess))
        # far from it the parabola may be the wrong one
        while np.linalg.norm(step) > 1e-9 and variance(t, p + step) > 1.1 * variance(t, p) + 1e-12:
            step = 0.5 * step
        p = p + step
        if np.linalg.norm(step) < 1e-8:
            break
    left, slopes = _left(t, p)
    normal = _weight(left) * slopes.T @ slopes + np.eye(3) / UNSEEN_SD_M**2
    return p, np.linalg.inv(normal)


def _in_plane(t: Array, plane: Plane, guess: Array) -> tuple[Array, Array]:
    from scipy.optimize import minimize  # noqa: PLC0415 - takes a second to load

    start = plane.coordinates(plane.foot(guess))
    first, second = np.linalg.norm(plane.sides, axis=1)
    corners = start + np.array([[0.0, 0.0], [_STEP_M / first, 0.0], [0.0, _STEP_M / second]])
    cost: Callable[[Array], float] = lambda w: 1e6 * variance(t, plane.at(w))  # noqa: E731
    found = minimize(
        cost,
        start,
        method="Nelder-Mead",
        options={"initial_simplex": corners, "xatol": 1e-5, "fatol": 1e-10, "maxiter": 400},
    )
    p = plane.at(np.asarray(found.x))
    if not found.success or np.linalg.norm(p - guess) > 0.2:
        raise TrackError(
            "No point within 200 mm keeps its distance: the search ended {away:.0f} mm away.",
            "Bend the joint further, and check which terminal is which.",
            away=1e3 * float(np.linalg.norm(p - guess)),
        )
    left, slopes = _left(t, p)
    within = slopes @ plane.sides.T
    normal = _weight(left) * within.T @ within
    covariance = plane.sides.T @ np.linalg.inv(normal) @ plane.sides
    return p, covariance


def _left(t: Array, p: Array) -> tuple[Array, Array]:
    """Distances against their mean, and slopes with the point."""
    way = p - t
    distance = np.linalg.norm(way, axis=1)
    slopes = way / np.maximum(distance, 1e-9)[:, None]
    return distance - distance.mean(), slopes - slopes.mean(axis=0)


def _weight(left: Array) -> float:
    """Of a squared residual: what frames share by lasting longer than one is counted once."""
    n = len(left)
    spread = max(float(left @ left) / n, 1e-14)
    return independent(left[:, None]) / n / spread
