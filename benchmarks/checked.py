"""Whether a calibration is said to hold where it does, and not where a board has slipped.

The person whose calibration it is does the check some times more, the glove left on. Then the
board of one sensor after the other is turned, as if it had slipped before the check.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import msgspec
import numpy as np

from handstudio.arrays import Array
from handstudio.calibration.checking import bending_off, lying_turns
from handstudio.calibration.subject import SubjectCalibration
from handstudio.calibration.swings import Swings
from handstudio.hand.skeleton import PARENTS, SEGMENTS
from handstudio.maths import so3

_SEED = 9

CHECK = "quick_start+flat_hand+open_close"
CHECKS = 2
"""How often each person does the check."""

BENT_DEG = 1.5
"""How much a joint is bent otherwise from one flat hand to the next, standard deviation; ours. The
virtual people lay their hand down exactly alike, which nobody does."""

DRAWS = 50
"""Flat hands drawn for every check."""

SLIPS_DEG = (5.0, 10.0)
AXES = 3
"""How many directions each board slips in, at random."""


class Slipped(msgspec.Struct, frozen=True):
    """A check with one board turned.

    Attributes:
        deg: By how much.
        most_deg: What is read of the segment that is furthest off.
        near_deg: And of the slipped board's own and those it carries.
    """

    deg: float
    most_deg: float
    near_deg: float


class Checks(msgspec.Struct, frozen=True):
    """What checks of one calibration read [deg].

    Attributes:
        alike: By segment, every time, the glove left on and the hand laid down exactly alike.
        held: The same, the hand laid down as people do.
        slipped: With boards turned.
    """

    alike: tuple[dict[str, float], ...]
    held: tuple[dict[str, float], ...]
    slipped: tuple[Slipped, ...]


def checks(calibration: SubjectCalibration, takes: Sequence[tuple[Swings, slice]]) -> Checks:
    """Hold checks against a calibration, with all boards where they were and with one turned.

    Args:
        calibration: The one in question.
        takes: Each check, prepared, and where in it the hand opened and closed.
    """
    rng = np.random.default_rng(_SEED)
    held = []
    for swings, grasp in takes:
        seen = _seen(swings, grasp, calibration)
        held += [_read(seen, rng) for _ in range(DRAWS)]
    alike = [_read(_seen(*take, calibration)) for take in takes]
    slipped, (swings, grasp) = [], takes[0]
    for segment in calibration.segments:
        if not segment.sensor or segment.name == "forearm":
            continue
        sensor = swings.layout.names.index(segment.sensor)
        for deg in SLIPS_DEG:
            for axis in rng.standard_normal((AXES, 3)):
                by = so3.from_axis_angle(axis / np.linalg.norm(axis), np.deg2rad(deg))
                seen = _seen(turned(swings, sensor, by), grasp, calibration)
                read = _read(seen, rng)
                near = [read[name] for name in _near(segment.name) if name in read]
                slipped.append(Slipped(deg, max(read.values()), max(near)))
    return Checks(tuple(alike), tuple(held), tuple(slipped))


def turned(swings: Swings, sensor: int, by: Array) -> Swings:
    """As if a sensor sat turned on its segment: ``q_world_sensor by``."""
    q, vectors = swings.q_world_sensor.copy(), []
    q[:, sensor] = so3.multiply(q[:, sensor], by)
    for known in (swings.gyr, swings.dgyr, swings.acc):
        other = known.copy()
        other[:, sensor] = so3.rotate(so3.conjugate(by), other[:, sensor])
        vectors.append(other)
    gyr, dgyr, acc = vectors
    return replace(swings, q_world_sensor=q, gyr=gyr, dgyr=dgyr, acc=acc)


def figures(found: Sequence[Checks], limit_deg: float) -> dict[str, Any]:
    """False alarms and slips noticed under a limit [%], and what limits would be had from these."""
    most = np.array([max(one.values()) for each in found for one in each.held])
    every = np.array([x for each in found for one in each.held for x in one.values()])
    slips = [slip for each in found for slip in each.slipped]
    out: dict[str, Any] = {
        "limit_deg": limit_deg,
        "checks": len(most),
        "false_alarm_pct": _share(most > limit_deg),
        "false_alarm_of_segments_pct": _share(every > limit_deg),
        "alike_most_deg": max(x for each in found for one in each.alike for x in one.values()),
        "held_median_deg": float(np.median(most)),
        "held_98_pct_deg": float(np.percentile(most, 98.0)),
    }
    for deg in SLIPS_DEG:
        mine = [slip for slip in slips if slip.deg == deg]
        near = np.array([slip.near_deg for slip in mine])
        out[f"slipped_{deg:.0f}_deg"] = {
            "slips": len(mine),
            "noticed_pct": _share(np.array([slip.most_deg for slip in mine]) > limit_deg),
            "at_the_right_place_pct": _share(near > limit_deg),
            "near_deg": [float(x) for x in np.percentile(near, (10, 50, 90))],
        }
    return out


_Seen: TypeAlias = tuple[dict[str, Array], dict[str, float]]


def _seen(swings: Swings, grasp: slice, calibration: SubjectCalibration) -> _Seen:
    return lying_turns(swings, calibration), bending_off(swings, grasp, calibration)


def _read(seen: _Seen, rng: np.random.Generator | None = None) -> dict[str, float]:
    """What `check` reads [deg]; with joints bent a little otherwise than at the calibration."""
    turns, bending = seen
    out = {}
    for segment, turn in turns.items():
        q = so3.exp(turn)
        if rng is not None:
            bent = np.deg2rad(BENT_DEG) * rng.standard_normal()
            q = so3.multiply(q, so3.from_axis_angle(np.array([1.0, 0.0, 0.0]), bent))
        off = float(np.linalg.norm(so3.log(q)))
        out[segment] = float(np.rad2deg(max(off, bending.get(segment, 0.0))))
    return out


def _near(segment: str) -> list[str]:
    k = SEGMENTS.index(segment)
    return [segment, *(SEGMENTS[child] for child, parent in enumerate(PARENTS) if parent == k)]


def _share(yes: Array) -> float:
    return float(100.0 * np.mean(yes))
