"""Our own: a joint that rolls under terminals that skin carries along, in one least squares.

The lower terminal's place in the upper one's frame is, at flexion f (against its mean),

    t_i = (c + A f_i) - R_i (l + B f_i)

with the joint's centre c and l in the two terminals' frames, and A and B [m/rad] how it wanders
there: bones that roll, and skin that is drawn towards a joint that bends. All of it is linear. What
the motion hardly tells is what skin does to both terminals alike: a slide of 1 mm/rad under both
looks like a joint that lies 2 mm deeper. So three things that are known of every finger come in as
observations with their doubt (`Known`): how deep the joint lies under the terminals, that it lies
in the finger's middle, and that skin slides some towards the joint.

Frames in which a terminal was pushed are outweighed (Cauchy's weights) by how far they are off, in
place, and in how the axis leans: the seed's selection of steady axes, softly, and about the axis'
own path instead of one component of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handstudio.arrays import Array
from handstudio.errors import TrackError
from handstudio.maths import so3
from handstudio.trackers.attitude_noise import Equations, seeming, solved
from handstudio.trackers.estimate import JointEstimate, in_lower, independent, rest_place
from handstudio.trackers.pair import Pair
from handstudio.trackers.plane import Plane

_ROUNDS = 25
_CAUCHY = 2.0  # residuals of so many standard deviations count half
_LEAST_BEND = float(np.deg2rad(20.0))
_FRAME_M = 1e-4
_FINEST_M, _FINEST_RAD = 2e-5, 2e-4  # below it residuals are nothing but rounding


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of a finger before it moves; ours, and wider than the virtual people's.

    Attributes:
        depth_m: From a terminal's middle down to the joint's centre: half of the finger's
            thickness (adults' fingers are 12 to 20 mm thick) and half of a terminal's height.
        depth_sd_m: How well.
        middle_sd_m: How well the joint lies half way between the terminals, across the finger.
        slide_m: How far skin slides towards the joint [m/rad].
        slide_sd_m: How well.
        other_sd_m: What else the centre may wander by in a terminal's frame, each way [m/rad].
    """

    depth_m: float = 0.0128
    depth_sd_m: float = 0.002
    middle_sd_m: float = 0.002
    slide_m: float = 0.001
    slide_sd_m: float = 0.001
    other_sd_m: float = 0.0006


NOTHING = Known(0.0, 0.02, 0.02, 0.0, 1e-6, 1e-6)
"""For a hinge without skin."""


def rolling(pair: Pair, plane: Plane | None = None, known: Known | None = None) -> JointEstimate:
    """Find the joint and how it wanders.

    Args:
        pair: A joint bent.
        plane: Where it lies across the finger; half way between the terminals unless given.
        known: What is known before.

    Raises:
        TrackError: the joint was hardly bent.
    """
    known = Known() if known is None else known
    turn, weight = pair.turn, np.ones(len(pair))
    middle = rest_place(pair) if plane is None else plane.p1
    for _ in range(_ROUNDS):
        axis, flexion, lean = _path(turn, weight)
        _bent_enough(flexion, weight)
        mean = float(np.average(flexion, weights=weight))
        beyond = flexion - mean
        rows = _rows(pair, beyond)
        prior = _prior(pair, axis, middle, known)
        left = _left(rows, pair, weight, prior)
        place_sd = max(_FINEST_M, _spread(np.linalg.norm(left, axis=1)))
        lean_sd = max(_FINEST_RAD, _spread(np.linalg.norm(lean, axis=1)))
        off = (np.sum(left**2, axis=1) / place_sd**2 + np.sum(lean**2, axis=1) / lean_sd**2) / 2.0
        new = 1.0 / (1.0 + off / _CAUCHY**2)
        if np.abs(new - weight).max() < 1e-3:
            break
        weight = new
    data = _precision_of(left, weight)
    square, right = _sums(rows, pair, weight)
    x, covariance = solved(
        Equations(data * square, data * right),
        data * seeming(pair, axis, beyond, weight),
        prior,
        np.linalg.lstsq(prior.square, prior.right, rcond=1e-12)[0],
    )
    return JointEstimate(
        "rolling",
        x[0:3],
        x[3:6],
        covariance[0:3, 0:3],
        covariance[3:6, 3:6],
        len(pair),
        axis,
        _axis_sd(lean, flexion, weight),
        x[6:9],
        x[9:12],
        mean,
    )


def _path(turn: Array, weight: Array) -> tuple[Array, Array, Array]:
    """Axis, flexion of each frame, and how far each turn leans off a smooth path [rad]."""
    root = np.sqrt(weight)[:, None]
    axis = np.linalg.svd(root * turn, full_matrices=False)[2][0]
    flexion = turn @ axis
    if np.sum(weight * flexion) < 0.0:
        axis, flexion = -axis, -flexion
    aside = turn - flexion[:, None] * axis
    powers = np.stack([np.ones_like(flexion), flexion, flexion**2], axis=1)
    smooth = np.linalg.lstsq(root * powers, root * aside, rcond=None)[0]
    return axis, flexion, aside - powers @ smooth


def _rows(pair: Pair, beyond: Array) -> Array:
    """Slopes of the lower terminal's place with c, l, A and B, (n, 3, 12)."""
    n = len(beyond)
    turned = so3.to_matrix(pair.q_upper_lower)
    rows = np.empty((n, 3, 12))
    rows[:, :, 0:3] = np.eye(3)
    rows[:, :, 3:6] = -turned
    rows[:, :, 6:9] = beyond[:, None, None] * np.eye(3)
    rows[:, :, 9:12] = -beyond[:, None, None] * turned
    return rows


def _prior(pair: Pair, axis: Array, middle: Array, known: Known) -> Equations:
    to_lower = so3.conjugate(pair.rest_q_upper_lower)
    along = pair.rest_t_upper_lower - axis * (axis @ pair.rest_t_upper_lower)
    along = along / np.linalg.norm(along)
    # bending turns what points along the finger to the palm
    palm = np.cross(axis, along)
    axis_l, along_l, palm_l = (so3.rotate(to_lower, v) for v in (axis, along, palm))
    rows, values, sds = [], [], []

    def add(block: int, direction: Array, value: float, sd: float) -> None:
        row = np.zeros(12)
        row[3 * block : 3 * block + 3] = direction
        rows.append(row)
        values.append(value)
        sds.append(sd)

    add(0, axis, float(axis @ middle), known.middle_sd_m)
    add(1, axis_l, float(axis_l @ in_lower(pair, middle)), known.middle_sd_m)
    add(0, palm, known.depth_m, known.depth_sd_m)
    add(1, palm_l, known.depth_m, known.depth_sd_m)
    # a terminal that comes nearer sees the centre come nearer
    add(2, along, -known.slide_m, known.slide_sd_m)
    add(3, along_l, known.slide_m, known.slide_sd_m)
    for block, directions in ((2, (axis, palm)), (3, (axis_l, palm_l))):
        for direction in directions:
            add(block, direction, 0.0, known.other_sd_m)
    weighted = np.array(rows).T / np.array(sds) ** 2
    return Equations(weighted @ np.array(rows), weighted @ np.array(values))


def _left(rows: Array, pair: Pair, weight: Array, known: Equations) -> Array:
    """Residuals of places, with what is known counting as against frames of a tenth of a mm."""
    square, right = _sums(rows, pair, weight)
    normal = square + _FRAME_M**2 * known.square
    x = np.linalg.solve(normal, right + _FRAME_M**2 * known.right)
    return np.asarray(pair.t_upper_lower - rows @ x)


def _sums(rows: Array, pair: Pair, weight: Array) -> tuple[Array, Array]:
    weighted = weight[:, None, None] * rows
    flat = weighted.reshape(-1, rows.shape[2])
    return flat.T @ rows.reshape(-1, rows.shape[2]), flat.T @ pair.t_upper_lower.ravel()


def _spread(size: Array) -> float:
    """Standard deviation an axis of three normal ones, from the median of their length."""
    return float(np.median(size)) / 1.538


def _precision_of(left: Array, weight: Array) -> float:
    """Weight of a frame: of its variance, and of how few frames are worth one observation."""
    root = np.sqrt(weight)[:, None] * left
    variance = max(_FINEST_M**2, float(np.sum(root**2) / (3.0 * weight.sum())))
    return independent(root) / len(left) / variance


def _axis_sd(lean: Array, flexion: Array, weight: Array) -> float:
    root = np.sqrt(weight)[:, None] * lean
    size = np.sqrt(np.sum(weight * flexion**2))
    share = independent(root) / len(lean)
    return float(np.sqrt(np.sum(root**2) / 2.0 / weight.sum()) / max(size, 1e-9) / np.sqrt(share))


def _bent_enough(flexion: Array, weight: Array) -> None:
    order = np.argsort(flexion)
    mass = np.cumsum(weight[order]) / weight.sum()
    low, high = np.interp([0.05, 0.95], mass, flexion[order])
    if high - low < _LEAST_BEND:
        raise TrackError(
            "The joint was bent by {found:.0f} deg; at least {least:.0f} are needed.",
            "Bend it further, for 20 s, and check that each terminal sits on its own phalanx.",
            found=float(np.rad2deg(high - low)),
            least=float(np.rad2deg(_LEAST_BEND)),
        )
