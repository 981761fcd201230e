"""Which grasp a hand is in, and when it grasps, holds and lets go: from joint angles alone.

A posture is compared with the mean posture of every class (`grasp_prototypes`), angle by angle in
units of how much each varies. A hold is a stretch in which the fingers stay; before it they close,
after it they open.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from handstudio.analysis.grasp_prototypes import ANGLES, OPEN, PROTOTYPES, SD_DEG
from handstudio.arrays import Array

_ALIKE = 4.0  # angles go together: so many tell as much as one that is alone; ours
_STRANGE = 2.6  # mean square in these units: no class at all, such as a hand that writes
_STILL_RAD_S = 0.12  # root mean square over angles
_SMOOTHED_S = 0.05
_SHORTEST_S = 0.5
_LONGEST_MOVE_S = 2.0  # closing or opening

_MEAN = np.deg2rad([prototype.degrees for prototype in PROTOTYPES])
_SD = np.deg2rad(SD_DEG)


@dataclass(frozen=True, slots=True)
class Recognised:
    """What a posture was found to be.

    Attributes:
        name: Of the class; empty: like none.
        feix: Its name in the GRASP taxonomy.
        confidence: Probability among the classes.
        distance: Mean square from the class's mean posture, in units of its spread.
        second: The next class.
    """

    name: str
    feix: str
    confidence: float
    distance: float
    second: str


@dataclass(frozen=True, slots=True)
class GraspSegment:
    """A grasp from closing to letting go [s].

    Attributes:
        found: Which.
        start_s: The fingers begin to close.
        hold_s: They hold.
        release_s: They begin to open.
        end_s: They are open, or go on to something else.
    """

    found: Recognised
    start_s: float
    hold_s: float
    release_s: float
    end_s: float


def recognise(posture: Float[Array, " a"]) -> Recognised:
    """Of a posture [rad], as `ANGLES`; angles that are not known (NaN) are left out."""
    off = ((posture - _MEAN) / _SD) ** 2
    known = np.isfinite(posture)
    if not known.any():
        return Recognised("", "", 0.0, float("inf"), "")
    distance = off[:, known].mean(axis=1)
    weight = np.exp(-0.5 * (distance - distance.min()) * known.sum() / _ALIKE)
    best, second = np.argsort(distance)[:2]
    kind = PROTOTYPES[best]
    strange = distance[best] > _STRANGE
    return Recognised(
        "" if strange else kind.name,
        "" if strange else kind.feix,
        float(weight[best] / weight.sum()),
        float(distance[best]),
        PROTOTYPES[second].name,
    )


def grasp_segments(
    time_s: Float[Array, " n"], postures: Float[Array, "n a"]
) -> tuple[GraspSegment, ...]:
    """Every grasp of a motion, in order; a hand that rests open or in no known way is none."""
    if len(time_s) < 3:
        return ()
    still = _still(time_s, postures)
    stretches = _stretches(still)
    holds = [(a, b) for a, b in stretches if time_s[b - 1] - time_s[a] >= _SHORTEST_S]
    out = []
    for a, b in holds:
        found = recognise(np.median(postures[a:b], axis=0))
        if found.name in ("", OPEN):
            continue
        before = max([0, *(e for _, e in stretches if e <= a)])
        after = min([len(time_s), *(s for s, _ in stretches if s >= b)]) - 1
        hold_s, release_s = float(time_s[a]), float(time_s[b - 1])
        out.append(
            GraspSegment(
                found,
                max(float(time_s[before]), hold_s - _LONGEST_MOVE_S),
                hold_s,
                release_s,
                min(float(time_s[after]), release_s + _LONGEST_MOVE_S),
            )
        )
    return tuple(out)


def _still(time_s: Array, postures: Array) -> Bool[Array, " n"]:
    from scipy.ndimage import gaussian_filter1d  # noqa: PLC0415 - takes a second to load

    step_s = float(np.median(np.diff(time_s)))
    smooth = gaussian_filter1d(postures, _SMOOTHED_S / step_s, axis=0, mode="nearest")
    rate = np.gradient(smooth, time_s, axis=0)[:, np.isfinite(postures).all(axis=0)]
    return np.asarray(np.sqrt(np.mean(rate**2, axis=1)) < _STILL_RAD_S)


def _stretches(which: Array) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], which, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


assert len(ANGLES) == len(SD_DEG) == len(_MEAN[0])
